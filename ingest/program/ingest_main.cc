// SPDX-License-Identifier: Apache-2.0
// dsg-ingest: sensor logs and scene-graph files in, committed revisions out.
// Refuses to report success before everything is on disk.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "ingest/files/spill_file.h"
#include "ingest/log/log_source.h"
#include "ingest/log/moved_log.h"
#include "ingest/log/peeked_log.h"
#include "ingest/log/read_ahead_log.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/pipeline/upright.h"
#include "ingest/program/config_file.h"
#include "ingest/program/destination.h"
#include "ingest/program/ingest_flags.h"
#include "ingest/program/progress.h"
#include "ingest/program/run_report.h"
#include "ingest/program/yield.h"
#include "schema/base/allocator.h"
#include "schema/base/status.h"
#include "schema/program/command_line.h"
#include "schema/program/manual.h"

namespace dsg::ingest {
namespace {

std::atomic<bool> is_stopped = false;

// A second signal ends the program at once.
void StopAtSignals() {
  struct sigaction action = {};
  action.sa_handler = [](int) { is_stopped = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

// A log is taken up where its last commit ended, so nothing has to be brought to an end.
void SayWhenInterrupted() {
  struct sigaction action = {};
  action.sa_handler = [](int signal) {
    constexpr char kText[] =
        "\ndsg-ingest: interrupted; what is committed stays, and the same command goes on from "
        "there\n";
    // The only output that a signal handler may make; there is nobody to tell if it fails.
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kText, sizeof(kText) - 1);
    std::raise(signal);
  };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

// Neither a number nor one relative to something.
bool IsDate(const std::string& epoch) { return epoch.find('T') != std::string::npos; }

MapSpec MakeSpec(const IngestFlags& flags, const LogOptions& options, const LogInfo& info) {
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
  if (isatty(STDERR_FILENO) == 1) std::fputs("\r\033[K", stderr);
  TellError("dsg-ingest", sentence);
}

absl::StatusOr<std::unique_ptr<Destination>> OpenDestination(const IngestFlags& flags,
                                                             const MapSpec& spec) {
  if (flags.is_dry_run) return OpenTrial(flags.store, spec);
  if (flags.server.empty()) return OpenLocal(flags.store, spec, flags.limits);
  RemoteOptions options;
  DSG_ASSIGN_OR_RETURN(options.retry_ns_max, ParseRetryFor(flags.retry_for));
  DSG_ASSIGN_OR_RETURN(options.credentials, client::ReadCredentials(flags.credentials));
  if (!flags.is_quiet) options.tell = SayAboveProgress;
  return OpenRemote(flags.server, spec, options);
}

// What a map is created with holds for its life; flags that say otherwise would be ignored.
absl::Status CheckAgainstMap(const IngestFlags& flags, const LogOptions& options,
                             const MapSpec& spec) {
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
  // Somebody has reverted the map; what can be done about that the failure says.
  if (absl::IsAborted(failure) && ReasonOf(failure) == Reason::kUnspecified) return failure;
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

void Tell(const IngestFlags& flags, const RunReport& report) {
  if (flags.is_json) {
    std::printf("%s\n", ReportJson(report).c_str());
    std::fflush(stdout);
  } else if (!flags.is_quiet) {
    PrintReport(report, flags.mapping.has_timings);
  }
}

// How often a log is begun again because others name agents in the map at the same time.
constexpr int kConflictsMax = 100;

// Measurements that odometry and recognition are ahead of the layers: three seconds of a log.
constexpr size_t kAheadCount = 1000;

// Those from `first` on; how many there are.
size_t TellNotes(const IngestFlags& flags, const std::string& path, const LogInfo& info,
                 size_t first) {
  for (size_t i = first; i < info.notes.size() && !flags.is_quiet; ++i) {
    TellNote(path, info.notes[i]);
  }
  return info.notes.size();
}

// Opens a log, and shows how far that is where it takes a pass over a bag. What a followed log
// waits for is told meanwhile and later.
absl::StatusOr<std::unique_ptr<LogSource>> OpenShown(const IngestFlags& flags,
                                                     const std::string& path, LogOptions options) {
  const std::string what =
      absl::StrCat("looking through ", std::filesystem::path(path).filename().string());
  Progress progress(what, 0, flags.is_quiet);
  options.on_pass = [&](int64_t done, int64_t total) { progress.Update(what, done, total); };
  if (options.follow.has_value() && !flags.is_quiet) {
    options.follow->tell = [path](const std::string& sentence) {
      SayAboveProgress(absl::StrCat(path, ": ", sentence));
    };
  }
  return OpenLog(path, options);
}

void TellPause(const IngestFlags& flags, const std::string& path) {
  if (flags.is_quiet) return;
  TellNote(path,
           "stopped before the end of the log: the map keeps what is committed; run the same again "
           "to go on, with --follow-timeout 0 to end it");
}

// Beside the map, where there is room if there is any; TMPDIR may be memory.
std::string SpillFolderOf(const IngestFlags& flags) {
  std::error_code error;
  const bool is_beside = flags.spill_folder.empty() && !flags.is_dry_run && flags.server.empty() &&
                         std::filesystem::is_directory(flags.store, error);
  return is_beside ? flags.store : flags.spill_folder;
}

// What is put into a log that it does not hold.
struct Additions {
  std::optional<OdometryLogOptions> odometry;
  std::optional<Segmentation> segmentation;
  std::optional<RecognizedLogOptions> recognition;
};

absl::StatusOr<std::unique_ptr<LogSource>> WithAdditions(std::unique_ptr<LogSource> log,
                                                         const LogOptions& options,
                                                         const Additions& additions) {
  if (additions.segmentation.has_value()) {
    DSG_ASSIGN_OR_RETURN(log, SegmentLog(std::move(log), *additions.segmentation));
  }
  if (additions.odometry.has_value()) {
    DSG_ASSIGN_OR_RETURN(log, EstimatePoses(std::move(log), options, *additions.odometry));
  }
  if (additions.recognition.has_value()) {
    DSG_ASSIGN_OR_RETURN(log, RecognizePlaces(std::move(log), *additions.recognition));
  }
  return log;
}

// The log with what is made of it, turned upright. Poses that are estimated stand upright as far as
// anybody knows, unless the user does.
absl::StatusOr<std::unique_ptr<LogSource>> MakeUpright(
    std::unique_ptr<LogSource> log, const IngestFlags& flags, const std::string& path,
    const LogOptions& options, const IngestOptions& ingest_options, const Additions& additions,
    std::string* note) {
  const auto turn = [&](std::unique_ptr<LogSource> lying) {
    return TurnUpright(std::move(lying), path, options, flags.up, ingest_options.upright, note);
  };
  const bool is_estimated = additions.odometry.has_value();
  if (!is_estimated) {
    DSG_ASSIGN_OR_RETURN(log, turn(std::move(log)));
  }
  DSG_ASSIGN_OR_RETURN(log, WithAdditions(std::move(log), options, additions));
  if (!is_estimated || flags.up == "auto") return log;
  return turn(std::move(log));
}

// That in the frame of the map.
absl::StatusOr<std::unique_ptr<LogSource>> Prepare(std::unique_ptr<LogSource> log,
                                                   const IngestFlags& flags,
                                                   const std::string& path,
                                                   const LogOptions& options,
                                                   const IngestOptions& ingest_options,
                                                   const Additions& additions, std::string* note) {
  DSG_ASSIGN_OR_RETURN(
      log, MakeUpright(std::move(log), flags, path, options, ingest_options, additions, note));
  if (!flags.transform.empty()) {
    DSG_ASSIGN_OR_RETURN(const Pose3d map_T_log, ParseTransform(flags.transform));
    log = MoveLog(std::move(log), map_T_log);
  }
  const bool is_made = additions.odometry.has_value() || additions.recognition.has_value() ||
                       additions.segmentation.has_value();
  return is_made ? ReadAhead(std::move(log), kAheadCount) : std::move(log);
}

void TellLostFrames(const std::string& path, SkipCounts skipped, bool has_odometry) {
  // Odometry itself tells of how many images it has none.
  if (has_odometry) skipped.erase("no pose");
  for (const std::string& hint : HintsOnLostFrames(skipped)) {
    TellNote(path, hint);
  }
}

// The log once more, with the images and detections that it had.
absl::StatusOr<std::unique_ptr<LogSource>> OpenForImages(const std::string& path,
                                                         const LogOptions& options,
                                                         const Additions& additions) {
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<LogSource> log, OpenLog(path, options));
  if (!additions.segmentation.has_value()) return log;
  DSG_ASSIGN_OR_RETURN(log, SegmentLog(std::move(log), *additions.segmentation));
  return ReadAhead(std::move(log), kAheadCount);
}

absl::Status IngestOne(const IngestFlags& flags, const std::string& path, LogOptions options,
                       IngestOptions ingest_options, const Additions& additions,
                       std::unique_ptr<Destination>* destination) {
  const auto begin = std::chrono::steady_clock::now();
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<LogSource> log, OpenShown(flags, path, options));
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
    DSG_ASSIGN_OR_RETURN(log, OpenShown(flags, path, options));
  }
  // What a followed log has become may be read in another way than what it was.
  if (!flags.is_followed) {
    ingest_options.open_again = [&] { return OpenForImages(path, options, additions); };
  }
  size_t told_count = TellNotes(flags, path, log->info(), 0);
  absl::StatusOr<IngestSummary> summary = absl::UnknownError("not run");
  for (int tries = 0; tries < kConflictsMax; ++tries) {
    if (tries > 0) {
      DSG_ASSIGN_OR_RETURN(log, OpenShown(flags, path, options));
    }
    std::string note;
    DSG_ASSIGN_OR_RETURN(
        log, Prepare(std::move(log), flags, path, options, ingest_options, additions, &note));
    if (!flags.is_quiet && !note.empty() && tries == 0) {
      TellNote(path, note);
    }
    told_count = TellNotes(flags, path, log->info(), told_count);
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<MapView> view, (*destination)->View());
    Progress progress(std::filesystem::path(path).filename().string(),
                      log->info().measurement_count, flags.is_quiet);
    ingest_options.on_work = [&progress](const char* what, int64_t done, int64_t total) {
      progress.Update(what, done, total);
    };
    ingest_options.robot_graph.robust.on_work = ingest_options.on_work;
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
  if (summary->is_paused) TellPause(flags, path);
  if (!summary->is_paused) DSG_RETURN_IF_ERROR(CheckYield(log->info(), *summary));
  Tell(flags, {path, log->info(), *summary, elapsed.count(), flags.is_dry_run});
  if (!flags.is_quiet && summary->mapping.has_value()) {
    TellLostFrames(path, summary->mapping->skipped, additions.odometry.has_value());
  }
  return absl::OkStatus();
}

// The mesh is of one log, and a file.
absl::Status CheckMesh(const IngestFlags& flags) {
  if (flags.odometry.mesh.empty() || (flags.logs.size() == 1 && !flags.is_dry_run)) {
    return absl::OkStatus();
  }
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--odometry-mesh ", flags.odometry.mesh,
                                flags.is_dry_run ? ": --dry-run writes nothing; leave one out"
                                                 : " takes one log; ingest them one by one"),
                   {{"field", "odometry-mesh"}, {"value", flags.odometry.mesh}});
}

absl::Status CheckTransform(const IngestFlags& flags) {
  if (!flags.transform.empty()) DSG_RETURN_IF_ERROR(ParseTransform(flags.transform).status());
  if (flags.poses != "vio" || flags.logs.size() < 2) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--poses vio takes one log, not ", flags.logs.size(),
                                ": each begins in a frame of its own; ingest them one by one, into "
                                "maps of their own or with --transform"),
                   {{"field", "poses"}, {"value", flags.poses}});
}

absl::Status Run(const IngestFlags& flags) {
  DSG_RETURN_IF_ERROR(CheckMapName(flags.map));
  DSG_RETURN_IF_ERROR(CheckUp(flags.up));
  DSG_RETURN_IF_ERROR(CheckMesh(flags));
  DSG_RETURN_IF_ERROR(CheckTransform(flags));
  DSG_RETURN_IF_ERROR(ParseRetryFor(flags.retry_for).status());
  // Hours into a log is too late to find out.
  if (!flags.spill_folder.empty()) DSG_RETURN_IF_ERROR(SpillFile(flags.spill_folder).Open());
  flags.is_followed ? StopAtSignals() : SayWhenInterrupted();
  DSG_ASSIGN_OR_RETURN(const LogOptions options, MakeLogOptions(flags, &is_stopped));
  DSG_ASSIGN_OR_RETURN(const IngestOptions ingest_options, MakeIngestOptions(flags));
  Additions additions;
  DSG_ASSIGN_OR_RETURN(additions.odometry,
                       MakeOdometryOptions(flags.odometry, flags.poses == "vio"));
  if (additions.odometry.has_value()) additions.odometry->gravity = ingest_options.upright.gravity;
  additions.recognition = MakeRecognitionOptions(flags.odometry);
  DSG_ASSIGN_OR_RETURN(additions.segmentation, MakeSegmentation(flags.segmenter));
  std::unique_ptr<Destination> destination;
  bool is_first = true;
  for (const std::string& path : flags.logs) {
    const absl::Status status =
        IngestOne(flags, path, options, ingest_options, additions, &destination);
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

// The first option that is given an empty value, as of a variable of the shell that is not set; it
// would count as 0, or as not given. A prefix may be empty.
const CLI::Option* FirstEmpty(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->check_lname("agent-prefix")) continue;
    for (const std::string& value : option->results()) {
      if (value.empty()) return option;
    }
  }
  return nullptr;
}

// What CLI11's own checks cannot see. Throws CLI::ParseError.
void CheckTogether(const CLI::App& app, const IngestFlags& flags) {
  if (const CLI::Option* const empty = FirstEmpty(app)) {
    throw CLI::ValidationError(
        absl::StrCat(empty->get_name(), " has an empty value; give one, or leave the option out"));
  }
  if (flags.store.empty() && flags.server.empty()) {
    throw CLI::ValidationError("give --store DIR or --server ADDR");
  }
  if (flags.is_dry_run && !flags.server.empty()) {
    throw CLI::ValidationError("--dry-run works on a copy of a local map; leave --server out");
  }
  const SpaceLimits usual;
  if (!flags.server.empty() && (flags.limits.quota_bytes != usual.quota_bytes ||
                                flags.limits.reserve_bytes != usual.reserve_bytes)) {
    throw CLI::ValidationError(
        "--quota and --reserve are of a local store; leave them out with --server");
  }
  if (flags.server.empty() && flags.retry_for != IngestFlags().retry_for) {
    throw CLI::ValidationError(
        "--retry-for is how long a server that does not answer is waited for, and a local store is "
        "not waited for; leave it out without --server");
  }
}

int Main(int argc, char** argv) {
  CLI::App app("dsg-ingest: reads logs and scene graphs into a map of a dynamic scene graph store",
               "dsg-ingest");
  IngestFlags flags;
  app.set_version_flag("--version", DSG_VERSION);
  AddIngestFlags(&app, &flags);
  AddConfigFile(&app);
  AddManual(&app, DSG_VERSION);
  app.callback([&] { CheckTogether(app, flags); });
  return RunProgram(argc, argv, &app, [&] { return Run(flags); });
}

}  // namespace
}  // namespace dsg::ingest

int main(int argc, char** argv) {
  // Images and what is made of them.
  dsg::KeepFreedMemory(size_t{64} << 20);
  // A file over the limit of the shell is a failed write with a message, not a sudden end.
  std::signal(SIGXFSZ, SIG_IGN);
  return dsg::ingest::Main(argc, argv);
}
