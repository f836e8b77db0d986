// SPDX-License-Identifier: Apache-2.0
// Human detections of a log as the lines they are, by time.
// Refuses to read more of a line than its stamp.
#pragma once

#include <fstream>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "schema/base/time.h"

namespace dsg::simulator {

/// One line after the other; holds one line.
class DetectionLines {
 public:
  /// A missing file is an empty one. Errors: FILE_MALFORMED in the first line.
  static absl::StatusOr<std::unique_ptr<DetectionLines>> Open(const std::string& path);

  bool at_end() const { return at_end_; }
  /// Of the present line, without its end. Requires: not at_end().
  TimeNs time_ns() const { return time_ns_; }
  const std::string& text() const { return text_; }
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file and line for a line without a stamp, or
  /// one before the line above.
  absl::Status Advance();

 private:
  explicit DetectionLines(const std::string& path) : path_(path), in_(path, std::ios::binary) {}
  absl::Status Malformed(const std::string& message) const;

  std::string path_;
  std::ifstream in_;
  int64_t line_number_ = 0;
  bool at_end_ = false;
  TimeNs time_ns_ = kTimeMin;
  std::string text_;
};

}  // namespace dsg::simulator
