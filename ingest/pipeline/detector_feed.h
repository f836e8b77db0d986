// SPDX-License-Identifier: Apache-2.0
// Detections of a log that has images and no detections: a network of the user's looks at them.
// Refuses to look at every image: some a second are enough for tracks.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/agents/detector/person_detector.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class DetectorFeed {
 public:
  /// Sees nobody.
  DetectorFeed() = default;

  /// Looks at color0, or at cam0 where the log has no color0, at most every `period_ns`.
  /// Errors: of PersonDetector::Load; FIELD_INVALID when the log has neither.
  static absl::StatusOr<DetectorFeed> Make(const LogInfo& info,
                                           const PersonDetectorOptions& options, TimeNs period_ns);

  /// Where a network looks, the log's own detections would be the same people twice.
  bool is_on() const { return detector_ != nullptr; }

  /// The people in an image; none when it is none, is of another channel, too soon after the last,
  /// or cannot be decoded. Errors: of PersonDetector::Detect.
  absl::StatusOr<std::vector<HumanDetection>> Look(const Measurement& measurement);

  int64_t broken_image_count() const { return broken_image_count_; }

 private:
  DetectorFeed(std::string channel, std::unique_ptr<PersonDetector> detector, TimeNs period_ns)
      : channel_(std::move(channel)), detector_(std::move(detector)), period_ns_(period_ns) {}

  std::string channel_;
  std::unique_ptr<PersonDetector> detector_;
  TimeNs period_ns_ = 0;
  TimeNs next_ns_ = kTimeMin;
  int64_t next_id_ = 0;
  int64_t broken_image_count_ = 0;
};

}  // namespace dsg::ingest
