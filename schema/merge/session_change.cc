// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/session_change.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "schema/base/status.h"
#include "schema/merge/mesh_surface.h"
#include "schema/merge/origins.h"
#include "schema/merge/point_grid.h"

namespace dsg::merge {
namespace {

constexpr int kSamplesASide = 4;
// Free space further from a place is not considered.
constexpr double kReachMaxM = 6.0;

std::vector<Eigen::Vector3d> SamplesOf(const Node& node, double slack_m) {
  std::vector<Eigen::Vector3d> samples;
  if (node.box_node.isEmpty()) return {node.map_T_node.position};
  const Eigen::Vector3d center = node.box_node.center();
  const Eigen::Vector3d half = (0.5 * node.box_node.sizes().array() - slack_m).max(0.0);
  for (int x = 0; x < kSamplesASide; ++x) {
    for (int y = 0; y < kSamplesASide; ++y) {
      for (int z = 0; z < kSamplesASide; ++z) {
        const Eigen::Vector3d at = Eigen::Vector3d(x, y, z) * (2.0 / (kSamplesASide - 1));
        samples.push_back(node.map_T_node *
                          (center + half.cwiseProduct(at - Eigen::Vector3d::Ones())));
      }
    }
  }
  return samples;
}

// Height range of a body, in which the clearance of a place on the floor is measured.
constexpr double kBodyHeightM = 1.8;
constexpr double kFloorSlackM = 0.15;
constexpr int kMatterVertexCountMin = 10;

bool Holds(const FreeSpot& spot, const Eigen::Vector3d& point_map, double slack_m) {
  const Eigen::Vector3d at = spot.map_T_spot.Inverse() * point_map;
  if (at.norm() < spot.radius_m - slack_m) return true;
  if (spot.box_spot.isEmpty()) return false;
  const Eigen::Vector3d& low = spot.box_spot.min();
  const Eigen::Vector3d& high = spot.box_spot.max();
  if (((at - low).array() > 0.0).all() && ((high - at).array() > 0.0).all()) return true;
  const bool is_on_floor = std::abs(low.z()) < kFloorSlackM;
  return is_on_floor && at.head<2>().norm() < spot.radius_m - slack_m && at.z() > low.z() &&
         at.z() < std::min(high.z(), kBodyHeightM);
}

class FreeSpace {
 public:
  FreeSpace(std::vector<FreeSpot> spots, double slack_m)
      : spots_(std::move(spots)), slack_m_(slack_m), grid_(PositionsOf(spots_), 1.0) {}

  double Share(const Node& node, TimeNs* first_ns) const {
    const std::vector<Eigen::Vector3d> samples = SamplesOf(node, slack_m_);
    int free_count = 0;
    *first_ns = kTimeMax;
    for (const Eigen::Vector3d& sample : samples) {
      bool is_free = false;
      grid_.ForEachNear(sample, kReachMaxM, [&](int i) {
        const FreeSpot& spot = spots_[static_cast<size_t>(i)];
        if (!Holds(spot, sample, slack_m_)) return;
        is_free = true;
        *first_ns = std::min(*first_ns, spot.from_ns);
      });
      free_count += is_free ? 1 : 0;
    }
    return static_cast<double>(free_count) / static_cast<double>(samples.size());
  }

 private:
  static std::vector<Eigen::Vector3d> PositionsOf(const std::vector<FreeSpot>& spots) {
    std::vector<Eigen::Vector3d> positions;
    for (const FreeSpot& spot : spots) positions.push_back(spot.map_T_spot.position);
    return positions;
  }

  std::vector<FreeSpot> spots_;
  double slack_m_;
  PointGrid grid_;
};

TimeNs LastSeen(const MapContent& content, const Node& node) {
  if (node.last_observed_ns.has_value()) return *node.last_observed_ns;
  return content.observed.has_value() ? content.observed->to_ns - 1 : kTimeMin;
}

std::vector<char> SeenAgain(const MapContent& into, const MapContent& other,
                            const std::vector<int>& pair_of) {
  std::vector<char> is_seen(into.nodes.size(), 0);
  for (const int pair : pair_of) {
    if (pair >= 0) is_seen[static_cast<size_t>(pair)] = 1;
  }
  // Copies from the same map are not older beliefs that it could contradict.
  for (size_t i = 0; i < into.nodes.size(); ++i) {
    const auto copy = CopiedFrom(into.nodes[i]);
    if (copy.has_value() && copy->map == other.spec.name) is_seen[i] = 1;
  }
  return is_seen;
}

// Things on or in a thing that is gone went with it, unless they were seen again.
void AddCarried(const MapContent& into, const std::vector<char>& is_seen,
                std::map<int, TimeNs>* gone) {
  bool is_growing = true;
  while (is_growing) {
    is_growing = false;
    for (const Edge& edge : into.edges) {
      if (edge.relation != relations::kOn && edge.relation != relations::kIn) continue;
      const int carried = into.IndexOf(edge.source);
      const auto carrier = gone->find(into.IndexOf(edge.target));
      if (carried < 0 || carrier == gone->end() || gone->contains(carried)) continue;
      const Node& node = into.nodes[static_cast<size_t>(carried)];
      if (into.ClassOf(carried) != NodeClass::kObject ||
          is_seen[static_cast<size_t>(carried)] != 0 || node.valid.to_ns <= carrier->second ||
          LastSeen(into, node) >= carrier->second) {
        continue;
      }
      (*gone)[carried] = carrier->second;
      is_growing = true;
    }
  }
}

// Colours vary with the light, but do not change from red to blue.
bool AreColorsAlike(const Node& a, const Node& b) {
  constexpr int kDifferenceMax = 80;
  if (!a.object.has_value() || !b.object.has_value()) return true;
  if (!a.object->color.has_value() || !b.object->color.has_value()) return true;
  for (size_t i = 0; i < 3; ++i) {
    const int difference = (*a.object->color)[i] - (*b.object->color)[i];
    if (std::abs(difference) > kDifferenceMax) return false;
  }
  return true;
}

bool CouldBeSame(const Node& before, const Node& after) {
  if (before.kind != after.kind || ClassKey(before).empty() ||
      ClassKey(before) != ClassKey(after) || !AreColorsAlike(before, after)) {
    return false;
  }
  if (before.box_node.isEmpty() || after.box_node.isEmpty()) return true;
  const double a = before.box_node.sizes().norm();
  const double b = after.box_node.sizes().norm();
  return a < 1.3 * b + 0.1 && b < 1.3 * a + 0.1;
}

// Least cost of a row or column, except one entry.
double Rival(const Eigen::VectorXd& costs, Eigen::Index besides) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < costs.size(); ++i) {
    if (i != besides) least = std::min(least, costs[i]);
  }
  return least;
}

// Things that are still there, by class.
std::map<std::string, int> CountClasses(const MapContent& content) {
  std::map<std::string, int> counts;
  for (const int i : content.OfClass(NodeClass::kObject)) {
    const Node& node = content.nodes[static_cast<size_t>(i)];
    if (node.valid.to_ns == kTimeMax) ++counts[ClassKey(node)];
  }
  return counts;
}

std::vector<std::pair<int, int>> PairMoved(const MapContent& into, const MapContent& other,
                                           const std::vector<Gone>& gone,
                                           const std::vector<int>& arrived,
                                           const ChangeOptions& options) {
  std::vector<std::pair<int, int>> moved;
  // If everything is new, nothing has moved.
  constexpr size_t kPairsMax = 4'000'000;
  if (gone.empty() || arrived.empty() || gone.size() * arrived.size() > kPairsMax) return moved;
  Eigen::MatrixXd cost = Eigen::MatrixXd::Constant(static_cast<Eigen::Index>(gone.size()),
                                                   static_cast<Eigen::Index>(arrived.size()), 1e6);
  for (size_t i = 0; i < gone.size(); ++i) {
    for (size_t k = 0; k < arrived.size(); ++k) {
      const Node& before = into.nodes[static_cast<size_t>(gone[i].into)];
      const Node& after = other.nodes[static_cast<size_t>(arrived[k])];
      if (!CouldBeSame(before, after)) continue;
      cost(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          (before.map_T_node.position - after.map_T_node.position).norm();
    }
  }
  std::map<std::string, int> mine = CountClasses(into);
  std::map<std::string, int> theirs = CountClasses(other);
  for (Eigen::Index i = 0; i < cost.rows(); ++i) {
    const size_t row = static_cast<size_t>(i);
    Eigen::Index best = 0;
    const double distance = cost.row(i).minCoeff(&best);
    const double rival = std::min(Rival(cost.row(i).transpose(), best), Rival(cost.col(best), i));
    const bool is_nudge =
        distance < options.nudge_max_m && rival > options.nudge_ratio_min * distance;
    const std::string key = ClassKey(into.nodes[static_cast<size_t>(gone[row].into)]);
    const bool is_only_one = mine[key] == 1 && theirs[key] == 1 && distance < options.move_max_m;
    if (!is_nudge && !is_only_one) continue;
    moved.emplace_back(gone[row].into, arrived[static_cast<size_t>(best)]);
  }
  return moved;
}

// Whether the later session saw free space where a thing stood, and since when.
class AbsenceJudge {
 public:
  AbsenceJudge(const MapContent& into, const MapContent& other, const ChangeOptions& options,
               const SurfaceProbe& probe)
      : into_(into),
        options_(options),
        probe_(probe),
        session_ns_(other.observed->from_ns),
        later_(FreeSpaceOf(other, session_ns_), options.slack_m) {}

  absl::StatusOr<std::optional<TimeNs>> GoneAt(const Node& node) const {
    TimeNs first_ns = kTimeMax;
    const bool is_free = later_.Share(node, &first_ns) >= options_.free_share_min;
    // No free space, so the mesh need not be read.
    if (LastSeen(into_, node) >= std::max(session_ns_, is_free ? first_ns : session_ns_)) {
      return std::optional<TimeNs>();
    }
    if (probe_) {
      DSG_ASSIGN_OR_RETURN(const BoxSurface surface,
                           probe_(node.map_T_node, node.box_node, options_.slack_m));
      if (surface.inside_count >= kMatterVertexCountMin) return std::optional<TimeNs>();
      if (!is_free && surface.ground_share < options_.ground_share_min) {
        return std::optional<TimeNs>();
      }
      if (!is_free) first_ns = std::max(session_ns_, surface.ground_first_ns);
    } else if (!is_free) {
      return std::optional<TimeNs>();
    }
    const bool was_there = node.valid.Contains(first_ns) && node.valid.from_ns < first_ns &&
                           LastSeen(into_, node) < first_ns;
    return was_there ? std::optional<TimeNs>(first_ns) : std::nullopt;
  }

 private:
  const MapContent& into_;
  const ChangeOptions& options_;
  const SurfaceProbe& probe_;
  TimeNs session_ns_;
  FreeSpace later_;
};

constexpr double kBlocksOfBoxMax = 512.0;
constexpr double kCellM = 0.1;
// Largest error of surfaces.
constexpr double kGroundSlackM = 0.08;
constexpr size_t kProbeCachedBlocks = 64;

// The inside of a box without its sides and underside, because walls and floors touch those.
Box3d CoreOf(const Box3d& box, double slack_m) {
  const Eigen::Vector3d slack = (0.25 * box.sizes()).cwiseMin(Eigen::Vector3d::Constant(slack_m));
  return Box3d(box.min() + slack, box.max() - slack);
}

// The cells of the underside of a box where there is surface.
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

// What the mesh of a map shows at a box: surface in it, and surface to stand on. Boxes of a whole
// storey count as full.
class MeshProbe {
 public:
  /// `map_T_other` takes the mesh to the frame of the boxes.
  MeshProbe(const Snapshot& other, const Pose3d& map_T_other);

  absl::StatusOr<BoxSurface> Look(const Pose3d& map_T_box, const Box3d& box, double slack_m);

 private:
  Pose3d other_T_map_;
  double block_size_m_;
  BlockCache blocks_;
};

MeshProbe::MeshProbe(const Snapshot& other, const Pose3d& map_T_other)
    : other_T_map_(map_T_other.Inverse()),
      block_size_m_(other.spec().mesh_block_size_m),
      blocks_(std::shared_ptr<const Snapshot>(std::shared_ptr<const Snapshot>(), &other), Pose3d(),
              kProbeCachedBlocks) {}

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

}  // namespace

std::vector<FreeSpot> FreeSpaceOf(const MapContent& content, TimeNs default_ns) {
  std::vector<FreeSpot> spots;
  for (const Node& node : content.nodes) {
    if (!node.place.has_value() || node.valid.to_ns != kTimeMax) continue;
    FreeSpot spot{node.map_T_node, node.place->free_box, node.place->clearance_m,
                  node.first_observed_ns.value_or(default_ns)};
    if (!spot.box_spot.isEmpty() || spot.radius_m > 0.0) spots.push_back(std::move(spot));
  }
  return spots;
}

absl::StatusOr<SessionChanges> FindChanges(const MapContent& into, const MapContent& other,
                                           const std::vector<int>& pair_of,
                                           const ChangeOptions& options, const SurfaceProbe& probe,
                                           const StopCheck& stop) {
  SessionChanges changes;
  if (!other.observed.has_value() || !into.observed.has_value()) return changes;
  const AbsenceJudge judge(into, other, options, probe);
  const std::vector<char> is_seen = SeenAgain(into, other, pair_of);
  std::map<int, TimeNs> gone;
  StopCounter counter(stop, 256);
  for (const int i : into.OfClass(NodeClass::kObject)) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const Node& node = into.nodes[static_cast<size_t>(i)];
    if (is_seen[static_cast<size_t>(i)] != 0 || node.box_node.isEmpty()) continue;
    DSG_ASSIGN_OR_RETURN(const std::optional<TimeNs> at_ns, judge.GoneAt(node));
    if (at_ns.has_value()) gone[i] = *at_ns;
  }
  AddCarried(into, is_seen, &gone);
  for (const auto& [index, at_ns] : gone) changes.gone.push_back({index, at_ns});
  const FreeSpace earlier(FreeSpaceOf(into, into.observed->from_ns), options.slack_m);
  std::vector<int> arrived;
  for (const int i : other.OfClass(NodeClass::kObject)) {
    TimeNs unused = 0;
    if (pair_of[static_cast<size_t>(i)] >= 0) continue;
    const Node& node = other.nodes[static_cast<size_t>(i)];
    if (earlier.Share(node, &unused) >= options.free_share_min) arrived.push_back(i);
  }
  changes.moved = PairMoved(into, other, changes.gone, arrived, options);
  return changes;
}

SurfaceProbe ProbeMesh(const Snapshot& other, const Pose3d& map_T_other) {
  return [mesh = std::make_shared<MeshProbe>(other, map_T_other)](
             const Pose3d& map_T_box, const Box3d& box, double slack_m) {
    return mesh->Look(map_T_box, box, slack_m);
  };
}

}  // namespace dsg::merge
