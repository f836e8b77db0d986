// SPDX-License-Identifier: Apache-2.0
// Which images of a log tell distances at features, and which of them belong together.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/odometry/estimator/stereo_eye.h"

namespace dsg::ingest {

/// cam0 and cam1, or color0 (or cam0) and depth0 where there is no pair.
struct LogEye {
  std::string left;
  std::string other;
  /// Two cameras, not one with depth.
  bool is_pair = false;
  std::unique_ptr<OdometryEye> eye;
};

/// `flag` wants it, for errors: "--poses vio".
/// Errors: FIELD_INVALID when the log has no such images; of MakeStereoEye and MakeDepthEye.
absl::StatusOr<LogEye> MakeLogEye(const LogInfo& info, const StereoMatchOptions& options,
                                  const std::string& flag);

/// The images of one moment.
struct PairedImages {
  /// Of the left one; of the other, or of labels, where there is no left one.
  TimeNs time_ns = 0;
  std::optional<ImageMeasurement> left;
  std::optional<ImageMeasurement> other;
  std::optional<ImageMeasurement> label;

  bool is_whole() const { return left.has_value() && other.has_value(); }
};

/// Gathers the images of a log by stamp: equal ones, or those that are nearest to each other and at
/// most `apart_ns_max` apart. Threads: one caller at a time.
class ImagePairing {
 public:
  ImagePairing(std::string left, std::string other, bool with_labels, TimeNs apart_ns_max = 0)
      : left_(std::move(left)),
        other_(std::move(other)),
        with_labels_(with_labels),
        apart_ns_max_(apart_ns_max) {}

  /// Whatever the log gives next.
  void Add(const Measurement& measurement);
  /// What belongs to an image of this stamp may still come, but for the end of the log: its
  /// partner, or a nearer one of its partner.
  bool IsOpen(TimeNs time_ns) const { return now_ns_ <= time_ns + 2 * apart_ns_max_; }

  /// The latest stamp so far.
  TimeNs now_ns() const { return now_ns_; }
  bool empty() const { return waiting_.empty(); }
  TimeNs front_ns() const { return waiting_.front().time_ns; }
  PairedImages Take();

 private:
  // The nearest of those waiting that has what `images` lacks; past the end if none is near enough.
  std::deque<PairedImages>::iterator PartnerOf(const PairedImages& images);

  std::string left_;
  std::string other_;
  bool with_labels_;
  TimeNs apart_ns_max_;
  TimeNs now_ns_ = kTimeMin;
  std::deque<PairedImages> waiting_;
};

}  // namespace dsg::ingest
