// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/ingest_flags.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "ingest/config/option_flags.h"
#include "ingest/log/format.h"
#include "ingest/pipeline/robot_model.h"
#include "query/client/credential_flags.h"
#include "schema/base/byte_size.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Which topics of a bag, how the robot moved, and in which frame.
void AddRobotFlags(CLI::App* app, IngestFlags* flags) {
  app->add_option(
         "--topic", flags->topics,
         "Topic of a bag's channel, as depth0=/camera/depth, where its name and type do "
         "not tell: cam0, cam1, color0, depth0, label0, lidar0, imu0, poses, truth, detections0, "
         "loops0; CHANNEL=none leaves the channel out; may be given several times")
      ->allow_extra_args(false);
  app->add_option(
         "--poses", flags->poses,
         "Whose poses of the robot a sensor log is taken with: gt (its ground truth), "
         "external (other software's), auto (external if there are some) or vio (estimated "
         "from its images, and its inertial unit if it has one)")
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
  app->add_option("--transform", flags->transform,
                  "Where the log's frame is in the map: X,Y,Z,YAW in metres and radians, as "
                  "dsg-align prints it; without it both are the same");
}

void AddFollowFlags(CLI::App* app, IngestFlags* flags) {
  app->add_flag("--follow", flags->is_followed,
                "Read a file that is still written, a table of poses or tracks or an MCAP file: at "
                "its end wait for more, and commit meanwhile; SIGINT or SIGTERM end it");
  app->add_option("--follow-timeout", flags->follow_timeout_s,
                  "With --follow: the log has ended after so many seconds without growth; 0 = "
                  "with what is there. Without it, it never ends by itself")
      ->check(CLI::Range(0.0, 86400.0 * 365))
      ->needs("--follow");
  app->add_option("--follow-late", flags->follow_late_s,
                  "With --follow: seconds that a topic of a bag may be recorded later than others; "
                  "the map is so far behind, and what comes later still ends the log with an error")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str()
      ->needs("--follow");
}

}  // namespace

void AddIngestFlags(CLI::App* app, IngestFlags* flags) {
  app->add_option("--store", flags->store, "Folder of the store; made if missing")
      ->envname("DSG_STORE");
  app->add_option(
      "--server", flags->server,
      "Commit through this dsg-server (unix:PATH or HOST:PORT); --store is not touched");
  client::AddCredentialFlags(app, &flags->credentials);
  app->add_option("--retry-for", flags->retry_for,
                  "With --server: how long to wait for one that does not answer (90s, 10m, 24h); "
                  "the log waits too")
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
  app->add_flag("--after-revert", flags->tells_undone_again,
                "Tell again what a revert has undone of the log; without it such a log is refused");
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
  UseShortHelp(app);
  AddMappingFlags(app, &flags->mapping);
  AddOdometryFlags(app, &flags->odometry);
  AddPeopleFlags(app, &flags->people);
  AddSegmenterFlags(app, &flags->segmenter);
  AddTuning(flags->numbers.Groups(), app);
  app->add_flag("--quiet", flags->is_quiet, "Write nothing but errors");
  app->add_flag("--json", flags->is_json, "Write the summary of each log as a line of JSON");
  app->add_flag("--dry-run", flags->is_dry_run,
                "With --store: do all the work on a copy of the map in memory, and write nothing");
  app->add_option("LOG", flags->logs, "Log files or folders, taken one after another")->required();
}

namespace {

PoseSource PoseSourceOf(const std::string& text) {
  if (text == "vio") return PoseSource::kOdometry;
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

absl::Status SetFollow(const IngestFlags& flags, const std::atomic<bool>* stop,
                       LogOptions* options) {
  if (!flags.is_followed) return absl::OkStatus();
  if (flags.logs.size() != 1) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--follow takes one log, not ", flags.logs.size(),
                                  ": it would never come to the second one"),
                     {{"field", "follow"}, {"value", absl::StrCat(flags.logs.size())}});
  }
  FollowOptions& follow = options->follow.emplace();
  follow.stop = stop;
  follow.late_ns = std::llround(flags.follow_late_s * 1e9);
  if (flags.follow_timeout_s.has_value()) {
    follow.timeout = std::chrono::milliseconds(std::llround(*flags.follow_timeout_s * 1e3));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<LogOptions> MakeLogOptions(const IngestFlags& flags, const std::atomic<bool>* stop) {
  LogOptions options;
  DSG_RETURN_IF_ERROR(SetFollow(flags, stop, &options));
  options.format = flags.format;
  options.pose_file = flags.pose_file;
  options.loop_file = flags.loop_file;
  options.label_folder = flags.label_folder;
  DSG_RETURN_IF_ERROR(SetTopics(flags.topics, &options));
  options.poses = PoseSourceOf(flags.poses);
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

absl::StatusOr<IngestOptions> MakeIngestOptions(const IngestFlags& flags) {
  IngestOptions options = flags.numbers;
  options.poses_per_delta = flags.commit_poses;
  options.up = flags.up;
  options.transform = flags.transform;
  DSG_ASSIGN_OR_RETURN(options.mapping, MakeMappingOptions(flags.mapping));
  options.is_size_bounded = !flags.server.empty();
  options.tells_undone_again = flags.tells_undone_again;
  options.robot_graph.odometry_m_per_m = flags.odometry_m_per_m;
  options.robot_graph.odometry_rad_per_m = flags.odometry_rad_per_m;
  if (!flags.robot_cad.empty()) {
    DSG_ASSIGN_OR_RETURN(options.robot_model, ReadRobotModel(flags.robot_cad));
  }
  DSG_ASSIGN_OR_RETURN(options.people, MakePeopleOptions(flags.people));
  return options;
}

}  // namespace dsg::ingest
