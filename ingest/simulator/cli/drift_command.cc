// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>

#include "absl/strings/str_format.h"
#include "ingest/simulator/cli/command.h"
#include "ingest/simulator/sensors/drift_files.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

struct DriftArguments {
  std::string folder;
  std::string out;
  double loop_period_s = 10.0;
  DriftOptions options;
};

absl::Status RunDrift(DriftArguments& arguments) {
  arguments.options.loop_period_ns =
      static_cast<TimeNs>(std::llround(arguments.loop_period_s * 1e9));
  DSG_ASSIGN_OR_RETURN(const DriftSummary summary,
                       WriteDrift(arguments.folder, arguments.out, arguments.options));
  std::cout << absl::StreamFormat(
      "wrote %s/odometry.csv (%d poses, %.1f m, off by %.3f m at the end)\n"
      "wrote %s/loops.jsonl (%d right, %d wrong; loop_truth.csv says which)\n",
      arguments.out, summary.pose_count, summary.way_m, summary.end_error_m, arguments.out,
      summary.right_count, summary.wrong_count);
  return absl::OkStatus();
}

}  // namespace

Command AddDriftCommand(CLI::App* app) {
  auto arguments = std::make_shared<DriftArguments>();
  DriftOptions& options = arguments->options;
  app->add_option("folder", arguments->folder, "what `dsg-simulate sensors --out` was given")
      ->required();
  app->add_option("--out", arguments->out, "folder to write: odometry.csv, loops.jsonl")
      ->required();
  app->add_option("--seed", options.seed, "same seed, same bytes")->capture_default_str();
  app->add_option("--drift-m-per-m", options.drift_m_per_m,
                  "standard deviation on each axis after one metre; grows with the root of the way")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app->add_option("--drift-rad-per-m", options.drift_rad_per_m, "the same about the vertical")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app->add_option("--loop-period", arguments->loop_period_s,
                  "seconds between two loop closures, at least")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app->add_option("--wrong-loops", options.wrong_share,
                  "share of wrong ones among all loop closures, 0 to 0.95")
      ->check(CLI::Range(0.0, 0.95))
      ->capture_default_str();
  return [arguments] { return RunDrift(*arguments); };
}

}  // namespace dsg::simulator
