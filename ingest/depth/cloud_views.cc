// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/cloud_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace dsg::ingest {
namespace {

constexpr int kSidePx = 256;
constexpr float kFocalPx = 0.5f * kSidePx;
constexpr float kCenterPx = 0.5f * (kSidePx - 1);
constexpr size_t kViewCount = 6;

constexpr OptionField<CloudOptions> kCloudFields[] = {
    {"scan-near", &CloudOptions::near_m, 0.0, 10.0,
     "Points nearer to the lidar are of the robot, metres: most robots reach less far around it"},
    {"scan-row-gap", &CloudOptions::row_gap_px, 1.0, 256.0,
     "Readings are put between beams up to so far apart, pixels of a third of a degree: lidars of "
     "16 beams have 2 degrees between them"},
    {"scan-column-gap", &CloudOptions::column_gap_px, 1.0, 256.0,
     "The same along a beam, pixels: there only single readings are missing"},
    {"scan-alike", &CloudOptions::alike_share, 0.0, 1.0,
     "Two readings that differ by less, of the nearer one, are of one surface whatever is beside "
     "them: a tenth or more is an edge of furniture"},
    {"scan-slant", &CloudOptions::slant_ratio_max, 1.0, 100.0,
     "Readings that differ by more than this factor are of no surface: it is seen so flatly that "
     "little of it is known between two beams"},
    {"scan-readings", &CloudOptions::reading_count_min, 1.0, 10000.0,
     "Least number of readings on a side of the cube: fewer are strayed points"},
};

// Columns: x (right), y (down), z (forward) of each camera in the lidar's frame.
std::array<Eigen::Matrix3f, kViewCount> MakeAxes() {
  std::array<Eigen::Matrix3f, kViewCount> axes;
  const Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
  const std::array<Eigen::Vector3f, 4> around = {Eigen::Vector3f::UnitX(), Eigen::Vector3f::UnitY(),
                                                 -Eigen::Vector3f::UnitX(),
                                                 -Eigen::Vector3f::UnitY()};
  for (size_t i = 0; i < around.size(); ++i) {
    axes[i] << around[i].cross(up), -up, around[i];
  }
  const Eigen::Vector3f right = -Eigen::Vector3f::UnitY();
  axes[4] << right, up.cross(right), up;
  axes[5] << right, (-up).cross(right), -up;
  return axes;
}

size_t ViewOf(const Eigen::Vector3f& point) {
  Eigen::Index axis = 0;
  point.cwiseAbs().maxCoeff(&axis);
  const bool is_behind = point[axis] < 0.0f;
  if (axis == 2) return is_behind ? 5 : 4;
  return static_cast<size_t>(axis) + (is_behind ? 2 : 0);
}

// One row or column of a picture. A reading is put between two others if they are of one plane.
class Line {
 public:
  Line(float* first, std::ptrdiff_t stride, const CloudOptions& options)
      : first_(first),
        stride_(stride),
        alike_share_(static_cast<float>(options.alike_share)),
        slant_ratio_max_(static_cast<float>(options.slant_ratio_max)) {
    for (int i = 0; i < kSidePx; ++i) {
      if (At(i) > 0.0f) readings_.push_back({i, 1.0f / At(i)});
    }
  }

  void CloseGaps(double gap_max) {
    for (size_t k = 0; k + 1 < readings_.size(); ++k) {
      const Reading& a = readings_[k];
      const Reading& b = readings_[k + 1];
      if (b.at - a.at < 2 || b.at - a.at > gap_max || !IsOneSurface(k, gap_max)) continue;
      const float slope = (b.inverse - a.inverse) / static_cast<float>(b.at - a.at);
      for (int i = a.at + 1; i < b.at; ++i) {
        At(i) = 1.0f / (a.inverse + slope * static_cast<float>(i - a.at));
      }
    }
  }

 private:
  struct Reading {
    int at = 0;
    float inverse = 0.0f;
  };

  float& At(int i) const { return first_[i * stride_]; }

  // Between readings k and k + 1.
  bool IsOneSurface(size_t k, double gap_max) const {
    const Reading& a = readings_[k];
    const Reading& b = readings_[k + 1];
    const float ratio = std::max(a.inverse, b.inverse) / std::min(a.inverse, b.inverse);
    if (ratio < 1.0f + alike_share_) return true;
    if (ratio > slant_ratio_max_) return false;
    return (k > 0 && LeadsTo(readings_[k - 1], a, b, gap_max)) ||
           (k + 2 < readings_.size() && LeadsTo(readings_[k + 2], b, a, gap_max));
  }

  bool LeadsTo(const Reading& from, const Reading& over, const Reading& to, double gap_max) const {
    if (std::abs(over.at - from.at) > gap_max) return false;
    const float slope = (over.inverse - from.inverse) / static_cast<float>(over.at - from.at);
    const float expected = over.inverse + slope * static_cast<float>(to.at - over.at);
    return std::abs(expected - to.inverse) <= alike_share_ * to.inverse;
  }

  float* first_;
  std::ptrdiff_t stride_;
  float alike_share_;
  float slant_ratio_max_;
  std::vector<Reading> readings_;
};

DepthFrame EmptyView(TimeNs time_ns, const Pose3d& map_T_lidar, const Eigen::Matrix3f& axes) {
  DepthFrame view;
  view.time_ns = time_ns;
  view.camera.name = "lidar0";
  view.camera.width = view.camera.height = kSidePx;
  view.camera.fx = view.camera.fy = kFocalPx;
  view.camera.cx = view.camera.cy = kCenterPx;
  view.map_T_camera.position = map_T_lidar.position;
  view.map_T_camera.orientation =
      (map_T_lidar.orientation * Eigen::Quaterniond(axes.cast<double>())).normalized();
  view.depth_m.assign(size_t{kSidePx} * kSidePx, 0.0f);
  return view;
}

}  // namespace

std::vector<BoundOption> CloudOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<CloudOptions>(kCloudFields, this, &bound);
  return bound;
}

std::vector<DepthFrame> ViewsOfCloud(const Image& points, TimeNs time_ns, const Pose3d& map_T_lidar,
                                     const CloudOptions& options) {
  const auto near_m = static_cast<float>(options.near_m);
  static const std::array<Eigen::Matrix3f, kViewCount> axes = MakeAxes();
  std::array<DepthFrame, kViewCount> views;
  std::array<int, kViewCount> counts{};
  for (size_t i = 0; i < kViewCount; ++i) views[i] = EmptyView(time_ns, map_T_lidar, axes[i]);
  for (int row = 0; row < points.height; ++row) {
    for (int column = 0; column < points.width; ++column) {
      const Eigen::Vector3f point = PointAt(points, column, row);
      if (!point.allFinite() || point.norm() < near_m) continue;
      const size_t side = ViewOf(point);
      const Eigen::Vector3f seen = axes[side].transpose() * point;
      if (seen.z() > kDepthMaxM) continue;
      const auto pixel_of = [&](float along) {
        const float pixel = std::round(kFocalPx * along / seen.z() + kCenterPx);
        return static_cast<size_t>(std::clamp(pixel, 0.0f, static_cast<float>(kSidePx - 1)));
      };
      float& depth_m = views[side].depth_m[pixel_of(seen.y()) * kSidePx + pixel_of(seen.x())];
      counts[side] += depth_m == 0.0f ? 1 : 0;
      if (depth_m == 0.0f || seen.z() < depth_m) depth_m = seen.z();
    }
  }
  std::vector<DepthFrame> frames;
  for (size_t i = 0; i < kViewCount; ++i) {
    if (counts[i] < options.reading_count_min) continue;
    float* const depth_m = views[i].depth_m.data();
    for (int line = 0; line < kSidePx; ++line) {
      Line(depth_m + std::ptrdiff_t{line} * kSidePx, 1, options).CloseGaps(options.column_gap_px);
    }
    for (int line = 0; line < kSidePx; ++line) {
      Line(depth_m + line, kSidePx, options).CloseGaps(options.row_gap_px);
    }
    frames.push_back(std::move(views[i]));
  }
  return frames;
}

}  // namespace dsg::ingest
