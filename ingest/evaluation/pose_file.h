// SPDX-License-Identifier: Apache-2.0
// Trajectories from files, true ones and estimates: what EuRoC, TUM and KITTI write, and the truth
// beside a simulated log.
// Refuses stamps that do not grow.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/evaluation/loops.h"
#include "ingest/evaluation/trajectory.h"

namespace dsg::evaluation {

struct PoseFile {
  /// The file that was read.
  std::string path;
  /// False for matrices: `time_ns` is the number of the row then.
  bool has_times = true;
  /// Ascending by time.
  std::vector<StampedPose> poses;
  /// What a reader of the figures should know.
  std::vector<std::string> notes;
};

/// Whether a folder holds the truth that dsg-simulate writes beside a log.
bool IsSimulatedTruth(const std::string& path);

/// A file of EuRoC's or TUM's columns or of KITTI's matrices, told by its first row; a folder that
/// holds state_groundtruth_estimate0 (also in mav0), data.csv or groundtruth.txt; or the robot of a
/// simulated truth. A stamp that a file repeats counts once, if they are at most one of a hundred.
/// `epoch_ns`: TUM stamps before 2001-09-09 count from there.
///
/// Errors: NOT_FOUND when there is nothing; INVALID_ARGUMENT/FILE_MALFORMED naming file, line,
/// field and value; of truth::ReadTruth.
absl::StatusOr<PoseFile> ReadPoseFile(const std::string& path, TimeNs epoch_ns);

/// Loop closures as lines of JSON (docs/sensor_logs.md). All count as believed.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field and value.
absl::StatusOr<std::vector<FoundLoop>> ReadLoopFile(const std::string& path,
                                                    std::vector<std::string>* notes);

}  // namespace dsg::evaluation
