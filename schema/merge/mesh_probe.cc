// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/mesh_probe.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <utility>

#include "schema/base/status.h"
#include "schema/merge/block_span.h"

namespace dsg::merge {
namespace {

constexpr double kBlocksOfBoxMax = 512.0;
constexpr double kCellM = 0.1;
// Surfaces are this far off at most.
constexpr double kGroundSlackM = 0.08;
constexpr size_t kCachedBlocks = 64;

// The inside of a box, sides and underside left out: walls and floors that it touches are not it.
Box3d CoreOf(const Box3d& box, double slack_m) {
  const Eigen::Vector3d slack = (0.25 * box.sizes()).cwiseMin(Eigen::Vector3d::Constant(slack_m));
  return Box3d(box.min() + slack, box.max() - slack);
}

// Marks cells of the underside of a box on which there is surface.
class Ground {
 public:
  explicit Ground(const Box3d& box) : box_(box) {
    columns_ = std::max(1, static_cast<int>(std::ceil(box.sizes().x() / kCellM)));
    rows_ = std::max(1, static_cast<int>(std::ceil(box.sizes().y() / kCellM)));
  }

  bool Mark(const Eigen::Vector3d& at_box) {
    if (std::abs(at_box.z() - box_.min().z()) > kGroundSlackM) return false;
    const Eigen::Vector3d offset = at_box - box_.min();
    const int column = static_cast<int>(std::floor(offset.x() / kCellM));
    const int row = static_cast<int>(std::floor(offset.y() / kCellM));
    if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return false;
    marked_.insert({column, row});
    return true;
  }

  double Share() const {
    return static_cast<double>(marked_.size()) / (static_cast<double>(columns_) * rows_);
  }

 private:
  Box3d box_;
  int columns_;
  int rows_;
  std::set<std::pair<int, int>> marked_;
};

}  // namespace

MeshProbe::MeshProbe(const Snapshot& other, const Pose3d& map_T_other)
    : other_T_map_(map_T_other.Inverse()),
      block_size_m_(other.spec().mesh_block_size_m),
      blocks_(std::shared_ptr<const Snapshot>(std::shared_ptr<const Snapshot>(), &other), Pose3d(),
              kCachedBlocks) {}

absl::StatusOr<BoxSurface> MeshProbe::Look(const Pose3d& map_T_box, const Box3d& box,
                                           double slack_m) {
  BoxSurface surface;
  const Pose3d other_T_box = other_T_map_ * map_T_box;
  Box3d around = TransformBox(other_T_box, box);
  around = Box3d(around.min().array() - kGroundSlackM, around.max().array() + kGroundSlackM);
  if (((around.sizes() / block_size_m_).array() + 2.0).prod() > kBlocksOfBoxMax) {
    surface.inside_count = std::numeric_limits<int>::max();
    return surface;
  }
  const Pose3d box_T_other = other_T_box.Inverse();
  const Box3d core = CoreOf(box, slack_m);
  Ground ground(box);
  TimeNs first_ns = kTimeMax;
  for (const BlockIndex index : BlocksIn(around, block_size_m_)) {
    const auto block = blocks_.Read(index);
    if (absl::IsNotFound(block.status())) continue;
    DSG_RETURN_IF_ERROR(block.status());
    const std::vector<TimeNs>& times = (*block)->first_seen_ns;
    for (size_t i = 0; i < (*block)->positions_map.size(); ++i) {
      const Eigen::Vector3d at = box_T_other * (*block)->positions_map[i].cast<double>();
      if (core.contains(at)) ++surface.inside_count;
      if (ground.Mark(at) && !times.empty()) first_ns = std::min(first_ns, times[i]);
    }
  }
  surface.ground_share = ground.Share();
  if (first_ns != kTimeMax) surface.ground_first_ns = first_ns;
  return surface;
}

}  // namespace dsg::merge
