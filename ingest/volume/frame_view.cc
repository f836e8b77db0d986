// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/frame_view.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "ingest/volume/block_map.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::Status Bad(const std::string& field, const std::string& value, const std::string& bound) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("depth frame: ", field, " is ", value, "; it must be ", bound),
                   {{"field", field}, {"value", value}});
}

absl::Status CheckSize(const std::string& channel, size_t size, size_t pixels, bool may_be_empty) {
  if (size == pixels || (may_be_empty && size == 0)) return absl::OkStatus();
  return Bad(absl::StrCat("size of ", channel), absl::StrCat(size),
             absl::StrCat(pixels, ", as many as the camera has"));
}

}  // namespace

BandLengths::BandLengths(const VolumeOptions& options)
    : voxel_m(static_cast<float>(options.voxel_m)),
      truncation_m(static_cast<float>(options.truncation_m > 0.0
                                          ? options.truncation_m
                                          : options.fusion.truncation_voxels * options.voxel_m)) {}

absl::Status FrameView::Check(const DepthFrame& frame, double voxel_m) {
  DSG_RETURN_IF_ERROR(frame.camera.Validate());
  if (frame.camera.distortion != Distortion::kNone) {
    return Bad("camera.distortion", "not none", "none: rectify the frame first");
  }
  const size_t pixels = size_t{1} * frame.camera.width * frame.camera.height;
  DSG_RETURN_IF_ERROR(CheckSize("depth_m", frame.depth_m.size(), pixels, false));
  DSG_RETURN_IF_ERROR(CheckSize("rgb", frame.rgb.size(), 3 * pixels, true));
  DSG_RETURN_IF_ERROR(CheckSize("labels", frame.labels.size(), pixels, true));
  DSG_RETURN_IF_ERROR(CheckSize("dynamic", frame.dynamic.size(), pixels, true));
  if (!IsValidPose(frame.map_T_camera)) {
    return Bad("map_T_camera", "no rigid pose", "finite, with a unit quaternion");
  }
  const double far_m = frame.map_T_camera.position.cwiseAbs().maxCoeff();
  const double bound_m = 0.5 * BlockMap::kKeyMax * VoxelBlock::kSide * voxel_m;
  if (far_m > bound_m) {
    return Bad("map_T_camera.position", absl::StrCat(far_m),
               absl::StrCat("within ", bound_m, " m of the origin"));
  }
  return absl::OkStatus();
}

FrameView::FrameView(const DepthFrame& frame, const VolumeOptions& options)
    : frame_(&frame),
      band_(options),
      near_behind_m_(std::min(band_.truncation_m,
                              static_cast<float>(options.fusion.behind_voxels) * band_.voxel_m)),
      noise_m_(static_cast<float>(options.fusion.noise_spread) *
               static_cast<float>(options.fusion.noise_m)),
      noise_per_m2_(static_cast<float>(options.fusion.noise_spread) *
                    static_cast<float>(frame.is_stereo ? options.fusion.stereo_noise_per_m2
                                                       : options.fusion.noise_per_m2)),
      scale_min_(static_cast<float>(options.fusion.scale_min)),
      edge_px_(options.fusion.edge_px),
      edge_m_(static_cast<float>(options.fusion.edge_m)),
      edge_per_m2_(static_cast<float>(options.fusion.edge_per_m2)),
      reach_(MakeReach(options)),
      pyramid_(reach_, frame.camera.width, frame.camera.height),
      normals_(reach_, frame.camera, options.fusion, options.thread_count) {}

std::vector<float> FrameView::MakeReach(const VolumeOptions& options) {
  const float range = static_cast<float>(options.range_m);
  const float person_gap = band_.truncation_m + static_cast<float>(options.fusion.person_margin_m);
  const bool sees_people = !frame_->dynamic.empty();
  std::vector<float> reach(frame_->depth_m.size(), 0.0f);
  for (size_t i = 0; i < reach.size(); ++i) {
    const float depth = frame_->depth_m[i];
    if (!std::isfinite(depth) || depth <= 0.0f) continue;
    const bool is_person = sees_people && frame_->dynamic[i] != 0;
    if (is_person) ++dynamic_count_;
    if (is_person && options.masking == DynamicMasking::kDrop) continue;
    ++used_count_;
    if (is_person && options.masking == DynamicMasking::kCarve) {
      reach[i] = -std::max(std::min(depth - person_gap, range), 0.0f);
    } else if (depth > range) {
      reach[i] = -std::min(range, depth - band_.truncation_m);
    } else {
      reach[i] = depth;
    }
  }
  return reach;
}

bool FrameView::Read(float u, float v, Reading* reading) const {
  const int width = frame_->camera.width;
  const int height = frame_->camera.height;
  if (!(u > -0.5f && v > -0.5f && u < static_cast<float>(width) - 0.5f &&
        v < static_cast<float>(height) - 0.5f)) {
    return false;
  }
  reading->column = static_cast<int>(u + 0.5f);
  reading->row = static_cast<int>(v + 0.5f);
  const float nearest = Reach(reading->column, reading->row);
  reading->is_surface = nearest > 0.0f;
  reading->depth_m = std::abs(nearest);
  if (nearest <= 0.0f) return nearest < 0.0f;
  const int left = std::min(static_cast<int>(std::max(u, 0.0f)), width - 2);
  const int top = std::min(static_cast<int>(std::max(v, 0.0f)), height - 2);
  if (left < 0 || top < 0) return true;
  const float* upper = &reach_[Offset(left, top)];
  const float* lower = upper + width;
  const float low = std::min(std::min(upper[0], upper[1]), std::min(lower[0], lower[1]));
  const float high = std::max(std::max(upper[0], upper[1]), std::max(lower[0], lower[1]));
  if (low <= 0.0f || high - low > band_.truncation_m) return true;
  const float a = u - static_cast<float>(left);
  const float b = v - static_cast<float>(top);
  const float above = upper[0] + a * (upper[1] - upper[0]);
  const float below = lower[0] + a * (lower[1] - lower[0]);
  reading->depth_m = above + b * (below - above);
  return true;
}

float FrameView::DistanceScale(const Reading& reading, float x, float y) const {
  const Eigen::Vector3f& normal = normals_.At(reading.column, reading.row);
  if (normal.isZero()) return std::sqrt(x * x + y * y + 1.0f);
  return std::max(normal.x() * x + normal.y() * y + normal.z(), scale_min_);
}

bool FrameView::IsInsideSurface(int column, int row) const {
  if (column < edge_px_ || row < edge_px_ || column >= frame_->camera.width - edge_px_ ||
      row >= frame_->camera.height - edge_px_) {
    return false;
  }
  const float* center = &reach_[Offset(column, row)];
  const std::ptrdiff_t down = std::ptrdiff_t{edge_px_} * frame_->camera.width;
  const float depth = *center;
  const float tolerance = edge_m_ + edge_per_m2_ * depth * depth;
  for (const std::ptrdiff_t step : {std::ptrdiff_t{edge_px_}, down}) {
    const float before = center[-step];
    const float after = center[step];
    if (before <= 0.0f || after <= 0.0f) return false;
    // On a plane the inverse depth changes linearly.
    const float expected = 2.0f / (1.0f / before + 1.0f / after);
    if (std::abs(expected - depth) > tolerance) return false;
  }
  return true;
}

}  // namespace dsg::ingest
