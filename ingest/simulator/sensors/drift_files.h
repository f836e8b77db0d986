// SPDX-License-Identifier: Apache-2.0
// Drifting odometry and loop closures beside a simulated log that is finished.
// Refuses to touch the log itself.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "ingest/simulator/motion/odometry_drift.h"

namespace dsg::simulator {

struct DriftSummary {
  int64_t pose_count = 0;
  int64_t right_count = 0;
  int64_t wrong_count = 0;
  double way_m = 0.0;
  /// How far odometry is from the truth at the end of the way.
  double end_error_m = 0.0;
};

/// From truth/robot.csv of `folder` (what `dsg-simulate sensors --out` was given) makes
/// odometry.csv (EuRoC columns), loops.jsonl (docs/sensor_logs.md) and loop_truth.csv (for each
/// line of loops.jsonl 1 if it is right) in `out`. Same options, same bytes.
/// Errors: of DriftOptions::Validate, truth::ReadTruth and OutputFile.
absl::StatusOr<DriftSummary> WriteDrift(const std::string& folder, const std::string& out,
                                        const DriftOptions& options);

}  // namespace dsg::simulator
