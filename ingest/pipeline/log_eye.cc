// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/log_eye.h"

#include <algorithm>
#include <cstdlib>
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
                                  "depth (depth0) with their calibration, which a bag tells by "
                                  "sensor_msgs/CameraInfo and a folder by sensor.yaml"),
                     {{"field", flag}});
  }
  LogEye eye{left->name, other->name, is_pair, nullptr};
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

std::deque<PairedImages>::iterator ImagePairing::PartnerOf(const PairedImages& images) {
  auto best = waiting_.end();
  TimeNs best_ns = apart_ns_max_ + 1;
  for (auto other = waiting_.begin(); other != waiting_.end(); ++other) {
    const bool fits = other->left.has_value() != images.left.has_value() &&
                      other->other.has_value() != images.other.has_value();
    const TimeNs apart_ns = std::abs(other->time_ns - images.time_ns);
    if (!fits || apart_ns >= best_ns) continue;
    best = other;
    best_ns = apart_ns;
  }
  return best;
}

PairedImages ImagePairing::Take() {
  const bool is_half = waiting_.front().left.has_value() != waiting_.front().other.has_value();
  if (apart_ns_max_ > 0 && is_half) {
    const auto partner = PartnerOf(waiting_.front());
    if (partner != waiting_.end() && PartnerOf(*partner) == waiting_.begin()) {
      PairedImages& front = waiting_.front();
      if (partner->left.has_value()) {
        front.left = std::move(partner->left);
        front.time_ns = partner->time_ns;
      } else {
        front.other = std::move(partner->other);
      }
      if (!front.label.has_value()) front.label = std::move(partner->label);
      waiting_.erase(partner);
    }
  }
  PairedImages front = std::move(waiting_.front());
  waiting_.pop_front();
  return front;
}

}  // namespace dsg::ingest
