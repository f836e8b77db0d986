// SPDX-License-Identifier: Apache-2.0
// dsg-ingest: sensor logs and scene-graph files in, committed revisions out.
// Refuses to report success before everything is on disk.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "ingest/log/format.h"
#include "ingest/log/log_source.h"
#include "ingest/log/peeked_log.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/pipeline/upright.h"
#include "ingest/program/config_file.h"
#include "ingest/program/destination.h"
#include "ingest/program/mapping_flags.h"
#include "ingest/program/people_flags.h"
#include "ingest/program/progress.h"
#include "ingest/program/run_report.h"
#include "ingest/program/segmenter_flags.h"
#include "ingest/program/yield.h"
#include "schema/base/byte_size.h"
#include "schema/base/exit_code.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

struct Flags {
  std::string store;
  std::string server;
  std::string retry_for = "10m";
  SpaceLimits limits;
  std::string spill_folder;
  std::string map;
  std::string format = "auto";
  /// Unset = what the format is used to.
  std::optional<double> frame_period_s;
  std::string agent_prefix;
  bool is_strict = false;
  std::string epoch;
  std::string codec;
  std::string poses = "auto";
  std::string pose_file;
  std::string loop_file;
  std::string label_folder;
  std::vector<std::string> topics;
  bool is_followed = false;
  /// Unset = never.
  std::optional<double> follow_timeout_s;
  std::string robot_cad;
  double odometry_m_per_m = RobotGraphOptions().odometry_m_per_m;
  double odometry_rad_per_m = RobotGraphOptions().odometry_rad_per_m;
  std::string up = "auto";
  int64_t commit_poses = IngestOptions().poses_per_delta;
  MappingFlags mapping;
  PeopleFlags people;
  SegmenterFlags segmenter;
  bool is_quiet = false;
  bool is_json = false;
  bool is_dry_run = false;
  std::vector<std::string> logs;
};

// Which topics of a bag, how the robot moved, and in which frame.
void AddRobotFlags(CLI::App* app, Flags* flags) {
  app->add_option(
         "--topic", flags->topics,
         "Topic of a bag's channel, as depth0=/camera/depth, where its name and type do "
         "not tell: cam0, cam1, color0, depth0, label0, lidar0, imu0, poses, truth, detections0, "
         "loops0; CHANNEL=none leaves the channel out; may be given several times")
      ->allow_extra_args(false);
  app->add_option("--poses", flags->poses,
                  "Whose poses of the robot a sensor log is taken with: gt (its ground truth), "
                  "external (other software's), auto (external if there are some) or vio (our own, "
                  "not built yet)")
      ->check(CLI::IsMember({"auto", "gt", "external", "vio"}))
      ->capture_default_str();
  app->add_option("--pose-file", flags->pose_file,
                  "Poses of the robot, EuRoC or TUM columns, instead of the sensor log's own");
  app->add_option("--loops", flags->loop_file,
                  "Loop closures of the robot (JSON lines), instead of the log's own");
  app->add_option("--labels", flags->label_folder,
                  "Label pictures of an RGB-D folder: a folder of PNGs of numbers, and labels.csv "
                  "with id,name");
  app->add_option("--odometry-m-per-m", flags->odometry_m_per_m,
                  "How far off the robot's poses are after one metre (one standard deviation), "
                  "where loop closures may correct them; grows with the root of the way")
      ->check(CLI::Range(1e-4, 1.0))
      ->capture_default_str();
  app->add_option("--odometry-rad-per-m", flags->odometry_rad_per_m, "The same about the vertical")
      ->check(CLI::Range(1e-5, 1.0))
      ->capture_default_str();
  app->add_option("--robot-cad", flags->robot_cad, "CAD model of the robot (PLY, OBJ), metres");
  app->add_option("--up", flags->up,
                  "Which way is up in the log's frame: x, -x, y, -y, z, -z, \"x,y,z\", none, or "
                  "auto (RGB-D folders: told from the pictures; others: z)")
      ->capture_default_str();
}

void AddFollowFlags(CLI::App* app, Flags* flags) {
  app->add_flag("--follow", flags->is_followed,
                "Read a file that is still written, a table of poses or tracks or an MCAP file: at "
                "its end wait for more, and commit meanwhile; SIGINT or SIGTERM end it");
  app->add_option("--follow-timeout", flags->follow_timeout_s,
                  "With --follow: the log has ended after so many seconds without growth; 0 = "
                  "with what is there. Without it, it never ends by itself")
      ->check(CLI::Range(0.0, 86400.0 * 365))
      ->needs("--follow");
}

void AddFlags(CLI::App* app, Flags* flags) {
  app->set_version_flag("--version", DSG_VERSION);
  app->add_option("--store", flags->store, "Folder of the store; made if missing")
      ->envname("DSG_STORE");
  app->add_option(
      "--server", flags->server,
      "Commit through this dsg-server (unix:PATH or HOST:PORT); --store is not touched");
  app->add_option("--retry-for", flags->retry_for,
                  "How long to wait for a server that does not answer (90s, 10m, 24h); the log "
                  "waits too")
      ->capture_default_str();
  app->add_option("--quota", flags->limits.quota_bytes,
                  "With --store: refuse to let the map grow beyond (10GB, 500MiB); 0 = no limit")
      ->transform(CLI::Validator(TakeByteSize, "SIZE"));
  app->add_option("--reserve", flags->limits.reserve_bytes,
                  "With --store: space kept so that forgetting works on a full disk; 0 = none")
      ->transform(CLI::Validator(TakeByteSize, "SIZE"));
  app->add_option("--spill-folder", flags->spill_folder,
                  "Folder for working memory on disk, in a file without a name; the store's if not "
                  "given, or TMPDIR without a local store")
      ->check(CLI::Validator(
          [](const std::string& folder) {
            return folder.empty() ? std::string() : CLI::ExistingDirectory(folder);
          },
          "DIR"));
  app->add_option("--map", flags->map, "Name of the map; made if missing")
      ->envname("DSG_MAP")
      ->required();
  app->add_option("--format", flags->format, absl::StrCat("auto, or one of: ", FormatList()))
      ->capture_default_str();
  app->add_option("--frame-period", flags->frame_period_s,
                  "Seconds from frame to frame of a log without a clock; 0.4 for annotated tracks, "
                  "1/30 for images if not given");
  app->add_option("--agent-prefix", flags->agent_prefix,
                  "Put before every agent's name, to keep apart logs that reuse names");
  app->add_flag("--strict", flags->is_strict,
                "Refuse a scene graph with edges to nodes that are not there and the like; without "
                "it they are skipped and counted");
  app->add_option("--epoch", flags->epoch,
                  "World time a new map begins at (nanoseconds or RFC 3339); default: the first "
                  "stamp of a log with a clock, else 0");
  app->add_option("--codec", flags->codec,
                  "How a new map keeps trajectories: quantized (default) or lossless")
      ->check(CLI::IsMember({"quantized", "lossless"}));
  AddRobotFlags(app, flags);
  AddFollowFlags(app, flags);
  app->add_option("--commit-poses", flags->commit_poses, "Poses a revision, of logs without depth")
      ->capture_default_str();
  AddMappingFlags(app, &flags->mapping);
  AddPeopleFlags(app, &flags->people);
  AddSegmenterFlags(app, &flags->segmenter);
  app->add_flag("--quiet", flags->is_quiet, "Write nothing but errors");
  app->add_flag("--json", flags->is_json, "Write the summary of each log as a line of JSON");
  app->add_flag("--dry-run", flags->is_dry_run,
                "With --store: do all the work on a copy of the map in memory, and write nothing");
  app->add_option("LOG", flags->logs, "Log files or folders, taken one after another")->required();
  AddConfigFile(app);
}

absl::StatusOr<PoseSource> ParsePoseSource(const std::string& text) {
  if (text == "vio") {
    return absl::UnimplementedError(
        "--poses vio: estimating the robot's poses from its sensors is not built yet; use gt or "
        "external");
  }
  if (text == "gt") return PoseSource::kGroundTruth;
  return text == "external" ? PoseSource::kExternal : PoseSource::kAuto;
}

absl::Status SetFramePeriod(double period_s, LogOptions* options) {
  const double period_ns = period_s * static_cast<double>(kNsPerSecond);
  // A day an annotation step is past any use, and keeps the product in range.
  if (!(period_ns >= 1.0 && period_s <= 86400.0)) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("--frame-period ", period_s, " is no duration from 1e-9 to 86400 seconds"),
        {{"field", "frame-period"}, {"value", absl::StrCat(period_s)}});
  }
  options->frame_period_ns = std::llround(period_ns);
  options->image_period_ns = options->frame_period_ns;
  return absl::OkStatus();
}

absl::Status SetTopics(const std::vector<std::string>& topics, LogOptions* options) {
  for (const std::string& text : topics) {
    const std::pair<std::string, std::string> named = absl::StrSplit(text, absl::MaxSplits('=', 1));
    const bool is_whole = !named.first.empty() && !named.second.empty();
    if (is_whole && options->topics.insert(named).second) continue;
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--topic ", text,
                                  is_whole ? ": the channel has a topic already"
                                           : " is no CHANNEL=TOPIC, as depth0=/camera/depth"),
                     {{"field", "topic"}, {"value", text}});
  }
  return absl::OkStatus();
}

std::atomic<bool> is_stopped = false;

// A second signal ends the program at once.
void StopAtSignals() {
  struct sigaction action = {};
  action.sa_handler = [](int) { is_stopped = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

absl::Status SetFollow(const Flags& flags, LogOptions* options) {
  if (!flags.is_followed) return absl::OkStatus();
  if (flags.logs.size() != 1) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--follow takes one log, not ", flags.logs.size(),
                                  ": it would never come to the second one"),
                     {{"field", "follow"}, {"value", absl::StrCat(flags.logs.size())}});
  }
  StopAtSignals();
  FollowOptions& follow = options->follow.emplace();
  follow.stop = &is_stopped;
  if (flags.follow_timeout_s.has_value()) {
    follow.timeout = std::chrono::milliseconds(std::llround(*flags.follow_timeout_s * 1e3));
  }
  return absl::OkStatus();
}

absl::StatusOr<LogOptions> MakeLogOptions(const Flags& flags) {
  LogOptions options;
  DSG_RETURN_IF_ERROR(SetFollow(flags, &options));
  options.format = flags.format;
  options.pose_file = flags.pose_file;
  options.loop_file = flags.loop_file;
  options.label_folder = flags.label_folder;
  DSG_RETURN_IF_ERROR(SetTopics(flags.topics, &options));
  DSG_ASSIGN_OR_RETURN(options.poses, ParsePoseSource(flags.poses));
  options.agent_prefix = flags.agent_prefix;
  options.is_strict = flags.is_strict;
  if (flags.frame_period_s.has_value()) {
    DSG_RETURN_IF_ERROR(SetFramePeriod(*flags.frame_period_s, &options));
  }
  if (!flags.epoch.empty()) {
    DSG_ASSIGN_OR_RETURN(options.epoch_ns, ParseTime(flags.epoch, 0));
  }
  return options;
}

// Neither a number nor one relative to something.
bool IsDate(const std::string& epoch) { return epoch.find('T') != std::string::npos; }

MapSpec MakeSpec(const Flags& flags, const LogOptions& options, const LogInfo& info) {
  MapSpec spec;
  spec.name = flags.map;
  spec.epoch_ns = options.epoch_ns;
  if (flags.epoch.empty() && info.has_clock) spec.epoch_ns = info.first_ns;
  // A date as the begin of a log without a clock says which clock its times are to be read on.
  const Clock clock = IsDate(flags.epoch) ? Clock::kUnix : Clock::kMonotonic;
  spec.clock = info.has_clock ? info.clock : clock;
  if (flags.codec == "lossless") spec.codec = TrajectoryCodec::kLossless;
  return spec;
}

absl::StatusOr<TimeNs> ParseRetryFor(const std::string& text) {
  const absl::StatusOr<TimeNs> span = ParseTime(absl::StrCat("+", text), 0);
  if (span.ok() && *span >= 0) return *span;
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("--retry-for \"", text, "\" is no duration; write it as 90s, 10m or 24h"),
      {{"field", "retry-for"}, {"value", text}});
}

// A progress bar is drawn over, and drawn again below.
void SayAboveProgress(const std::string& sentence) {
  std::fprintf(stderr, "%sdsg-ingest: %s\n", isatty(STDERR_FILENO) == 1 ? "\r\033[K" : "",
               sentence.c_str());
}

absl::StatusOr<std::unique_ptr<Destination>> OpenDestination(const Flags& flags,
                                                             const MapSpec& spec) {
  if (flags.is_dry_run) return OpenTrial(flags.store, spec);
  if (flags.server.empty()) return OpenLocal(flags.store, spec, flags.limits);
  RemoteOptions options;
  DSG_ASSIGN_OR_RETURN(options.retry_ns_max, ParseRetryFor(flags.retry_for));
  if (!flags.is_quiet) options.tell = SayAboveProgress;
  return OpenRemote(flags.server, spec, options);
}

// What a map is created with holds for its life; flags that say otherwise would be ignored.
absl::Status CheckAgainstMap(const Flags& flags, const LogOptions& options, const MapSpec& spec) {
  if (!flags.epoch.empty() && options.epoch_ns != spec.epoch_ns) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("map \"", spec.name, "\" begins at ", spec.epoch_ns, " ns, --epoch says ",
                     options.epoch_ns, " ns; leave --epoch out, or name another --map"),
        {{"field", "epoch"}, {"value", flags.epoch}});
  }
  const std::string codec = spec.codec == TrajectoryCodec::kLossless ? "lossless" : "quantized";
  if (!flags.codec.empty() && flags.codec != codec) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("map \"", spec.name, "\" keeps its trajectories ", codec, ", --codec says ",
                     flags.codec, "; leave --codec out, or name another --map"),
        {{"field", "codec"}, {"value", flags.codec}});
  }
  return absl::OkStatus();
}

// Whether the same log would fail in the same way again: it is malformed, contradicts itself, or
// gives nothing (CheckYield). A disk that was full is another matter.
bool IsRefusal(const absl::Status& failure) {
  const bool gives_nothing =
      absl::IsFailedPrecondition(failure) && ReasonOf(failure) == Reason::kUnspecified;
  return gives_nothing || absl::IsInvalidArgument(failure) || absl::IsAlreadyExists(failure) ||
         absl::IsOutOfRange(failure);
}

absl::Status WithEnd(const absl::Status& failure, const std::string& end) {
  absl::Status told(failure.code(), absl::StrCat(failure.message(), end));
  failure.ForEachPayload(
      [&](absl::string_view url, const absl::Cord& payload) { told.SetPayload(url, payload); });
  return told;
}

// What the log has brought before it failed stays in a map that had something else.
absl::Status TellWhatStays(const absl::Status& failure, Destination* destination) {
  const std::optional<RevisionRange> committed = destination->TakeCommitted();
  if (!committed.has_value()) return failure;
  const bool is_one = committed->first == committed->last;
  return WithEnd(
      failure,
      absl::StrCat("; map \"", destination->spec().name, "\" keeps what was committed of the log, ",
                   is_one ? "revision " : "revisions ", committed->first,
                   is_one ? "" : absl::StrCat(" to ", committed->last),
                   ": run the same again to go on, or take it back with `dsg revert ",
                   committed->first - 1, "`"));
}

// After a failure nothing is left of a map that this run has made, if all that is in it comes from
// a log that is refused and can be read again; after others what is committed stays, and the same
// run goes on with it.
absl::Status EndFailedRun(const absl::Status& failure, const std::string& path, bool is_first,
                          bool is_followed, Destination* destination) {
  // Whether the last commit was made is open, or nobody answers.
  if (destination == nullptr || absl::IsUnavailable(failure)) return failure;
  if (!is_first || !destination->is_new()) return TellWhatStays(failure, destination);
  // Somebody has dropped or renamed it meanwhile.
  const Reason reason = ReasonOf(failure);
  if (reason == Reason::kMapUnknown || reason == Reason::kMapReplaced) return failure;
  const std::string map = destination->spec().name;
  std::error_code error;
  const auto type = std::filesystem::status(path, error).type();
  // What was seen of a log that was followed may be gone from its file.
  const bool can_be_read_again = !is_followed && (type == std::filesystem::file_type::regular ||
                                                  type == std::filesystem::file_type::directory);
  const absl::StatusOr<bool> dropped =
      destination->DropIfOwn(/*only_empty=*/!IsRefusal(failure) || !can_be_read_again);
  std::string end = absl::StrCat("; map \"", map, "\" is not made");
  if (!dropped.ok()) {
    end = absl::StrCat("; map \"", map, "\", which was made for it, stays (",
                       dropped.status().message(), "), remove it with `dsg drop ", map, "`");
  } else if (!*dropped) {
    end = absl::StrCat("; map \"", map, "\" keeps what is committed, remove it with `dsg drop ",
                       map, "` or run the same again to go on");
  }
  return WithEnd(failure, end);
}

void Tell(const Flags& flags, const RunReport& report) {
  if (flags.is_json) {
    std::printf("%s\n", ReportJson(report).c_str());
    std::fflush(stdout);
  } else if (!flags.is_quiet) {
    PrintReport(report, flags.mapping.has_timings);
  }
}

// How often a log is begun again because others name agents in the map at the same time.
constexpr int kConflictsMax = 100;

// Those from `first` on; how many there are.
size_t TellNotes(const Flags& flags, const std::string& path, const LogInfo& info, size_t first) {
  for (size_t i = first; i < info.notes.size() && !flags.is_quiet; ++i) {
    std::fprintf(stderr, "%s: note: %s\n", path.c_str(), info.notes[i].c_str());
  }
  return info.notes.size();
}

// Beside the map, where there is room if there is any; TMPDIR may be memory.
std::string SpillFolderOf(const Flags& flags) {
  std::error_code error;
  const bool is_beside = flags.spill_folder.empty() && !flags.is_dry_run && flags.server.empty() &&
                         std::filesystem::is_directory(flags.store, error);
  return is_beside ? flags.store : flags.spill_folder;
}

absl::Status IngestOne(const Flags& flags, const std::string& path, LogOptions options,
                       IngestOptions ingest_options,
                       const std::optional<Segmentation>& segmentation,
                       std::unique_ptr<Destination>* destination) {
  const auto begin = std::chrono::steady_clock::now();
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<LogSource> log, OpenLog(path, options));
  // A log without a sound beginning must not leave a map, nor give it its epoch.
  DSG_ASSIGN_OR_RETURN(log, PeekLog(std::move(log)));
  if (*destination == nullptr) {
    const MapSpec wanted = MakeSpec(flags, options, log->info());
    DSG_ASSIGN_OR_RETURN(*destination, OpenDestination(flags, wanted));
  }
  ingest_options.spill_folder = SpillFolderOf(flags);
  const MapSpec& spec = (*destination)->spec();
  DSG_RETURN_IF_ERROR(CheckAgainstMap(flags, options, spec));
  const LogOptions opened_with = options;
  options.epoch_ns = spec.epoch_ns;
  options.mesh_block_size_m = spec.mesh_block_size_m;
  // The map must be open to know its epoch, and the log to make the map; so a log is at times
  // read twice.
  const bool is_shifted = !log->info().has_clock && options.epoch_ns != opened_with.epoch_ns;
  if (is_shifted || options.mesh_block_size_m != opened_with.mesh_block_size_m) {
    DSG_ASSIGN_OR_RETURN(log, OpenLog(path, options));
  }
  size_t told_count = TellNotes(flags, path, log->info(), 0);
  absl::StatusOr<IngestSummary> summary = absl::UnknownError("not run");
  for (int tries = 0; tries < kConflictsMax; ++tries) {
    if (tries > 0) {
      DSG_ASSIGN_OR_RETURN(log, OpenLog(path, options));
    }
    std::string note;
    DSG_ASSIGN_OR_RETURN(log, TurnUpright(std::move(log), path, options, flags.up, &note));
    if (!flags.is_quiet && !note.empty() && tries == 0) {
      std::fprintf(stderr, "%s: note: %s\n", path.c_str(), note.c_str());
    }
    if (segmentation.has_value()) {
      DSG_ASSIGN_OR_RETURN(log, SegmentLog(std::move(log), *segmentation));
      told_count = TellNotes(flags, path, log->info(), told_count);
    }
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<MapView> view, (*destination)->View());
    Progress progress(std::filesystem::path(path).filename().string(),
                      log->info().measurement_count, flags.is_quiet);
    summary = IngestLog(*log, options, ingest_options, *view, (*destination)->writer(),
                        [&progress](int64_t done) { progress.Update(done); });
    // Another robot has given an id away that we had chosen for a new agent. What is committed of
    // the log stays, and is passed over.
    if (ReasonOf(summary.status()) != Reason::kParentRevisionStale) break;
  }
  if (!summary.ok()) return summary.status();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  // What only the end of a followed log told.
  TellNotes(flags, path, log->info(), told_count);
  if (summary->is_paused && !flags.is_quiet) {
    std::fprintf(stderr,
                 "%s: note: stopped before the end of the log: the map keeps what is committed; "
                 "run the same again to go on, with --follow-timeout 0 to end it\n",
                 path.c_str());
  }
  if (!summary->is_paused) DSG_RETURN_IF_ERROR(CheckYield(log->info(), *summary));
  Tell(flags, {path, log->info(), *summary, elapsed.count(), flags.is_dry_run});
  if (!flags.is_quiet && summary->mapping.has_value()) {
    for (const std::string& hint : HintsOnLostFrames(summary->mapping->skipped)) {
      std::fprintf(stderr, "%s: note: %s\n", path.c_str(), hint.c_str());
    }
  }
  return absl::OkStatus();
}

absl::Status Run(const Flags& flags) {
  DSG_RETURN_IF_ERROR(CheckMapName(flags.map));
  DSG_RETURN_IF_ERROR(CheckUp(flags.up));
  DSG_RETURN_IF_ERROR(ParseRetryFor(flags.retry_for).status());
  DSG_ASSIGN_OR_RETURN(const LogOptions options, MakeLogOptions(flags));
  IngestOptions ingest_options{.poses_per_delta = flags.commit_poses, .up = flags.up};
  DSG_ASSIGN_OR_RETURN(ingest_options.mapping, MakeMappingOptions(flags.mapping));
  ingest_options.is_size_bounded = !flags.server.empty();
  ingest_options.robot_graph.odometry_m_per_m = flags.odometry_m_per_m;
  ingest_options.robot_graph.odometry_rad_per_m = flags.odometry_rad_per_m;
  if (!flags.robot_cad.empty()) {
    DSG_ASSIGN_OR_RETURN(ingest_options.robot_model, ReadRobotModel(flags.robot_cad));
  }
  DSG_ASSIGN_OR_RETURN(ingest_options.people, MakePeopleOptions(flags.people));
  DSG_ASSIGN_OR_RETURN(const std::optional<Segmentation> segmentation,
                       MakeSegmentation(flags.segmenter));
  std::unique_ptr<Destination> destination;
  bool is_first = true;
  for (const std::string& path : flags.logs) {
    const absl::Status status =
        IngestOne(flags, path, options, ingest_options, segmentation, &destination);
    // What earlier logs have brought stays.
    if (!status.ok()) {
      return flags.is_dry_run
                 ? status
                 : EndFailedRun(status, path, is_first, flags.is_followed, destination.get());
    }
    destination->TakeCommitted();
    is_first = false;
  }
  return absl::OkStatus();
}

ExitCode Report(const absl::Status& status) {
  if (status.ok()) return kDone;
  std::fprintf(stderr, "dsg-ingest: %s: %s\n",
               std::string(absl::StatusCodeToString(status.code())).c_str(),
               std::string(status.message()).c_str());
  return ExitCodeOf(status);
}

int Main(int argc, char** argv) {
  CLI::App app("dsg-ingest: reads logs and scene graphs into a map of a dynamic scene graph store",
               "dsg-ingest");
  Flags flags;
  AddFlags(&app, &flags);
  app.failure_message([](const CLI::App* program, const CLI::Error& error) {
    return absl::StrCat(program->get_name(), ": ", CLI::FailureMessage::simple(program, error));
  });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  if (flags.store.empty() && flags.server.empty()) {
    std::fputs("dsg-ingest: give --store DIR or --server ADDR\n", stderr);
    return kUsage;
  }
  if (flags.is_dry_run && !flags.server.empty()) {
    std::fputs("dsg-ingest: --dry-run works on a copy of a local map; leave --server out\n",
               stderr);
    return kUsage;
  }
  return Report(Run(flags));
}

}  // namespace
}  // namespace dsg::ingest

int main(int argc, char** argv) {
  // A file over the limit of the shell is a failed write with a message, not a sudden end.
  std::signal(SIGXFSZ, SIG_IGN);
  return dsg::ingest::Main(argc, argv);
}
