// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/block_search.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

constexpr double kBlockNearM = 0.05;
// Corners of wide images look further than the range along the axis; not without end, though.
constexpr double kRayRanges = 2.0;

class Search {
 public:
  Search(const FrameView& view, const VolumeOptions& options, int64_t count_max)
      : view_(view),
        camera_T_map_(view.frame().map_T_camera.Inverse()),
        range_m_(options.range_m),
        block_m_(options.voxel_m * VoxelBlock::kSide),
        count_max_(count_max) {}

  std::vector<BlockKey> Run() {
    // Cubes of 2^level blocks around the camera that together hold all it can see.
    const double reach_m = kRayRanges * range_m_ + view_.BehindM(static_cast<float>(range_m_));
    int level = 0;
    while (block_m_ * (1 << level) < reach_m) ++level;
    const Eigen::Vector3d at = view_.frame().map_T_camera.position / (block_m_ * (1 << level));
    const Eigen::Vector3i home = at.array().floor().cast<int>();
    for (int i = 0; i < 27; ++i) {
      Descend(home + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1), level);
    }
    std::sort(found_.begin(), found_.end());
    return std::move(found_);
  }

 private:
  void Descend(const Eigen::Vector3i& cell, int level) {
    if (static_cast<int64_t>(found_.size()) > count_max_) return;
    const double edge_m = block_m_ * (1 << level);
    const Eigen::Vector3d center = (cell.cast<double>().array() + 0.5) * edge_m;
    if (!MaySee(camera_T_map_ * center, 0.5 * std::sqrt(3.0) * edge_m)) return;
    if (level == 0) {
      found_.push_back({cell.x(), cell.y(), cell.z()});
      return;
    }
    for (int i = 0; i < 8; ++i) {
      Descend(2 * cell + Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2), level - 1);
    }
  }

  // `center` of a ball, in the camera's frame.
  bool MaySee(const Eigen::Vector3d& center, double radius) const {
    const double near_m = center.z() - radius;
    if (center.z() + radius < kBlockNearM) return false;
    if (center.norm() - radius > kRayRanges * range_m_) return false;
    const CameraCalibration& camera = view_.frame().camera;
    const auto [left, right] =
        Span(center.x(), center.z(), radius, camera.fx, camera.cx, camera.width);
    const auto [top, bottom] =
        Span(center.y(), center.z(), radius, camera.fy, camera.cy, camera.height);
    const float max_m = view_.pyramid().Max(left, top, right, bottom);
    return max_m > 0.0f && near_m < max_m + kRayRanges * view_.BehindM(max_m);
  }

  // Pixels that a ball covers on one axis of the image.
  static std::pair<int, int> Span(double side, double z, double radius, double focal,
                                  double principal, int size) {
    const double low = side - radius;
    const double high = side + radius;
    const double front = std::max(z - radius, kBlockNearM);
    const double back = z + radius;
    const double first = focal * low / (low < 0.0 ? front : back) + principal;
    const double last = focal * high / (high < 0.0 ? back : front) + principal;
    const double end = size;
    return {static_cast<int>(std::floor(std::clamp(first, -2.0, end + 1.0))),
            static_cast<int>(std::ceil(std::clamp(last, -2.0, end + 1.0)))};
  }

  const FrameView& view_;
  Pose3d camera_T_map_;
  double range_m_;
  double block_m_;
  int64_t count_max_;
  std::vector<BlockKey> found_;
};

}  // namespace

std::vector<BlockKey> FindVisibleBlocks(const FrameView& view, const VolumeOptions& options,
                                        int64_t count_max) {
  return Search(view, options, count_max).Run();
}

}  // namespace dsg::ingest
