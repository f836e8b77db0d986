// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/log_eye.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {

absl::StatusOr<LogEye> MakeLogEye(const LogInfo& info, const StereoMatchOptions& options,
                                  const std::string& flag) {
  const auto find = [&](const char* channel) {
    return info.channel_counts.contains(channel) ? info.rig.FindCamera(channel) : nullptr;
  };
  const CameraCalibration* const color = find("color0");
  const CameraCalibration* left = find("cam0");
  const CameraCalibration* other = find("cam1");
  const bool is_pair = left != nullptr && other != nullptr;
  if (!is_pair) {
    left = color != nullptr ? color : left;
    other = find("depth0");
  }
  if (left == nullptr || other == nullptr) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(flag, ": ", info.path,
                                  " has neither a pair of cameras (cam0, cam1) nor a camera with "
                                  "depth (depth0); leave it out"),
                     {{"field", flag}});
  }
  LogEye eye{left->name, other->name, nullptr};
  DSG_ASSIGN_OR_RETURN(eye.eye, is_pair ? MakeStereoEye(*left, *other, options)
                                        : MakeDepthEye(*left, *other, options));
  return eye;
}

void ImagePairing::Add(const Measurement& measurement) {
  now_ns_ = std::max(now_ns_, StampOf(measurement));
  const auto* image = std::get_if<ImageMeasurement>(&measurement);
  if (image == nullptr) return;
  const bool is_label = with_labels_ && image->channel == "label0";
  if (image->channel != left_ && image->channel != other_ && !is_label) return;
  if (waiting_.empty() || waiting_.back().time_ns != image->time_ns) {
    waiting_.push_back({image->time_ns, {}, {}, {}});
  }
  PairedImages& pair = waiting_.back();
  if (image->channel == left_) pair.left = *image;
  if (image->channel == other_) pair.other = *image;
  if (is_label) pair.label = *image;
}

PairedImages ImagePairing::Take() {
  PairedImages front = std::move(waiting_.front());
  waiting_.pop_front();
  return front;
}

}  // namespace dsg::ingest
