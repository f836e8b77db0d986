// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "absl/strings/str_format.h"
#include "ingest/simulator/cli/command.h"
#include "ingest/simulator/cli/progress_line.h"
#include "ingest/simulator/sensors/sensors_log.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

struct SensorsArguments {
  SensorsOptions options;
  SensorsRun run;
  std::string world = "apartment";
  std::string frames;
};

void AddOptions(CLI::App* app, SensorsArguments* arguments) {
  SensorsOptions& options = arguments->options;
  SensorsRun& run = arguments->run;
  app->add_option("--out", run.out, "folder to write: log/, truth/, README.txt")->required();
  app->add_option("--world", arguments->world, "apartment, wing or office")->capture_default_str();
  app->add_option("--humans,--people", options.people_count, "0 to 250")->capture_default_str();
  app->add_option("--seed", options.world.seed, "same seed, same bytes")->capture_default_str();
  app->add_option("--seconds", options.duration_s, "1 to 3600")->capture_default_str();
  app->add_option("--rate", options.rate_hz, "stereo pairs a second, 1 to 60")
      ->capture_default_str();
  app->add_option("--keyframe-every", options.keyframe_every,
                  "pairs to a keyframe with colour, depth, labels and detections")
      ->capture_default_str();
  app->add_option("--imu-noise", options.imu_noise_factor,
                  "inertial noise against the data sheet that the log states")
      ->capture_default_str();
  app->add_option("--calibration-error", options.calibration_error_factor,
                  "errors of the log's calibration: 1 = 0.3 px, 0.1 degrees, 2 mm, 1 ms")
      ->capture_default_str();
  app->add_flag("--bodies", options.has_bodies,
                "detections have the vertices of bodies too, 13 kB each");
  app->add_flag("--bag", run.bag, "write log.bag too");
  app->add_flag("--force", run.force, "replace a finished log, or one begun with other options");
  app->add_option("--frames", arguments->frames,
                  "BEGIN:END; render these only, for several processes side by side; a run "
                  "without this finishes the log");
  app->add_option("--threads", run.thread_count, "0 = one a core")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
}

void PrintSensorsSummary(const SensorsArguments& arguments, const SensorsSummary& summary) {
  const std::string& out = arguments.run.out;
  if (summary.is_bag_only) {
    std::cout << "the log was finished before; wrote " << out << "/log.bag\n";
    return;
  }
  if (!summary.is_finished) {
    std::cout << absl::StreamFormat(
        "rendered frames %s of %d; the same command without --frames finishes the log\n",
        arguments.frames, summary.frame_count);
    return;
  }
  std::cout << absl::StreamFormat(
      "%d stereo pairs, %d keyframes, %d inertial samples, %d picks\n"
      "%d of %d rooms and corridors visited, %.0f %% of the free floor seen\n",
      summary.frame_count, summary.keyframe_count, summary.imu_count, summary.pick_count,
      summary.rooms_visited, summary.room_count, 100.0 * summary.free_observed_share);
  if (summary.detections.raw.count > 0) {
    std::cout << FormatDetectionStatistics(summary.detections);
  }
  std::cout << absl::StreamFormat(
      "wrote %s; next: dsg-simulate preview %s; dsg-ingest --store DIR --map NAME --poses gt "
      "%s/log\n",
      out, out, out);
}

absl::Status RunSensors(SensorsArguments arguments) {
  DSG_ASSIGN_OR_RETURN(arguments.options.world.kind, ParseWorldKind(arguments.world));
  if (!arguments.frames.empty()) {
    DSG_ASSIGN_OR_RETURN(arguments.run.frames, ParseFrameRange(arguments.frames));
  }
  absl::StatusOr<SensorsSummary> summary;
  {
    ProgressLine line;
    summary = WriteSensors(arguments.options, arguments.run,
                           [&line](const char* step, double share) { line.Show(step, share); });
  }
  if (!summary.ok()) return summary.status();
  PrintSensorsSummary(arguments, *summary);
  return absl::OkStatus();
}

}  // namespace

Command AddSensorsCommand(CLI::App* app) {
  auto arguments = std::make_shared<SensorsArguments>();
  AddOptions(app, arguments.get());
  return [arguments] { return RunSensors(*arguments); };
}

}  // namespace dsg::simulator
