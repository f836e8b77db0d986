// SPDX-License-Identifier: Apache-2.0
// What a bag takes from a log's folder as it stands, beside the measurements.
// Refuses to read images and tables; the readers of ingest/log do.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/simulator/bag/detection_lines.h"
#include "ingest/simulator/bag/label_colors.h"

namespace dsg::simulator {

struct FolderText {
  /// The bytes of labels.csv, if there is one.
  std::optional<std::string> labels;
  LabelColors colors;
  /// The bytes of detections0/topology.json, if there is one.
  std::optional<std::string> body_topology;
  /// Never null.
  std::unique_ptr<DetectionLines> detections;
};

/// Errors: NOT_FOUND naming the file when `info` counts label images or detections and their file
/// is missing; as ingest::ReadLabelTable and DetectionLines.
absl::StatusOr<FolderText> ReadFolderText(const std::string& log_folder,
                                          const ingest::LogInfo& info);

}  // namespace dsg::simulator
