// SPDX-License-Identifier: Apache-2.0
// Sensor logs as ROS 1 bags, with the topics of docs/sensor_logs.md.
// Refuses to leave half a bag under its final name.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "ingest/log/log_source.h"

namespace dsg::simulator {

enum class BagCompression { kNone, kBz2, kLz4 };

struct BagOptions {
  BagCompression compression = BagCompression::kLz4;
  /// Called with 0 to 1 as the work goes on; may be empty.
  std::function<void(double)> progress;
};

/// Converts a finished sensor-log folder, with the robot's true poses. Two runs over one folder
/// give equal bytes.
///
/// Errors: as OpenLog; NOT_FOUND when the log has label images but no labels.csv;
/// INVALID_ARGUMENT/FILE_MALFORMED when the log holds what a bag cannot, such as stamps before
/// 1970; INVALID_ARGUMENT/FIELD_INVALID when the bag cannot be created;
/// RESOURCE_EXHAUSTED/DISK_FULL.
/// Cost: one image and one chunk in memory.
absl::Status WriteBag(const std::string& log_folder, const std::string& bag_path,
                      const std::function<void(double)>& progress);
absl::Status WriteBag(const std::string& log_folder, const std::string& bag_path,
                      const BagOptions& options);

/// The same from an opened log; detections and labels.csv are still taken from `log_folder`, as
/// they stand there.
absl::Status WriteBag(ingest::LogSource* log, const std::string& log_folder,
                      const std::string& bag_path, const BagOptions& options);

}  // namespace dsg::simulator
