// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/match_nodes.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "schema/base/disjoint_sets.h"
#include "schema/base/status.h"
#include "schema/matching/assignment.h"
#include "schema/merge/footprint.h"
#include "schema/merge/point_grid.h"

namespace dsg::merge {
namespace {

constexpr size_t kAssignmentCellsMax = 250'000;

double SizeOf(const Node& node) {
  return node.box_node.isEmpty() ? 0.0 : node.box_node.sizes().norm();
}

// Custom kinds without a class, such as the poses of an imported robot, cannot be told apart.
bool CouldMeet(const Node& a, const Node& b) {
  if (a.kind != kinds::kObject && ClassKey(a).empty()) return false;
  return a.kind == b.kind && a.layer == b.layer && a.valid.Overlaps(b.valid);
}

bool AreCompatible(const Node& a, const Node& b) {
  const std::string key_a = ClassKey(a);
  const std::string key_b = ClassKey(b);
  return key_a.empty() || key_b.empty() || key_a == key_b;
}

// Shared volume over the smaller volume; thin boxes get a little depth.
double Containment(const Node& a, const Node& b) {
  if (a.box_node.isEmpty() || b.box_node.isEmpty()) return 0.0;
  const auto thick = [](const Node& node) {
    const Box3d box = node.BoxMap();
    return Box3d(box.min().array() - 0.02, box.max().array() + 0.02);
  };
  const Box3d box_a = thick(a);
  const Box3d box_b = thick(b);
  const Box3d shared = box_a.intersection(box_b);
  if (shared.isEmpty()) return 0.0;
  return shared.volume() / std::min(box_a.volume(), box_b.volume());
}

// Intersection over union.
double Sameness(const Node& a, const Node& b) {
  if (a.box_node.isEmpty() || b.box_node.isEmpty()) return 0.0;
  const Box3d box_a = a.BoxMap();
  const Box3d box_b = b.BoxMap();
  const Box3d shared = box_a.intersection(box_b);
  if (shared.isEmpty()) return 0.0;
  return shared.volume() / (box_a.volume() + box_b.volume() - shared.volume());
}

struct Option {
  int into = 0;
  int other = 0;
  double cost = 0.0;
  double containment = 0.0;
};

// Splits the options into groups that share no object, which keeps assignments small.
std::vector<std::vector<Option>> GroupsOf(const std::vector<Option>& options) {
  std::map<int, int> slot_of_into;
  std::map<int, int> slot_of_other;
  DisjointSets sets;
  const auto slot = [&](std::map<int, int>* slots, int node) {
    const auto [found, is_new] = slots->try_emplace(node, 0);
    if (is_new) found->second = sets.Add();
    return found->second;
  };
  for (const Option& option : options) {
    const int a = slot(&slot_of_into, option.into);
    sets.Merge(a, slot(&slot_of_other, option.other));
  }
  std::map<int, std::vector<Option>> groups;
  for (const Option& option : options) {
    groups[sets.Find(slot_of_into[option.into])].push_back(option);
  }
  std::vector<std::vector<Option>> list;
  for (auto& [root, group] : groups) list.push_back(std::move(group));
  return list;
}

// Greedy, for groups that are too large for the optimal assignment.
void AssignGreedily(std::vector<Option> group, std::vector<int>* pair_of) {
  std::stable_sort(group.begin(), group.end(),
                   [](const Option& a, const Option& b) { return a.cost < b.cost; });
  std::set<int> taken;
  for (const Option& option : group) {
    int& pair = (*pair_of)[static_cast<size_t>(option.other)];
    if (pair < 0 && taken.insert(option.into).second) pair = option.into;
  }
}

void AssignGroup(const std::vector<Option>& group, std::vector<int>* pair_of) {
  constexpr double kApart = 10.0;
  std::map<int, int> row_of;
  std::map<int, int> column_of;
  for (const Option& option : group) {
    row_of.try_emplace(option.other, static_cast<int>(row_of.size()));
    column_of.try_emplace(option.into, static_cast<int>(column_of.size()));
  }
  if (row_of.size() * column_of.size() > kAssignmentCellsMax) {
    AssignGreedily(group, pair_of);
    return;
  }
  Eigen::MatrixXd cost =
      Eigen::MatrixXd::Constant(static_cast<Eigen::Index>(row_of.size()),
                                static_cast<Eigen::Index>(column_of.size()), kApart);
  for (const Option& option : group) {
    cost(row_of[option.other], column_of[option.into]) = option.cost;
  }
  std::vector<int> into_of(column_of.size());
  for (const auto& [into, column] : column_of) into_of[static_cast<size_t>(column)] = into;
  const std::vector<int> assigned = GatedAssignment(cost, 1.0);
  for (const auto& [other, row] : row_of) {
    const int column = assigned[static_cast<size_t>(row)];
    if (column < 0) continue;
    (*pair_of)[static_cast<size_t>(other)] = into_of[static_cast<size_t>(column)];
  }
}

// Unmatched objects inside an object of their class are fragments of it.
void TakeFragments(const std::vector<Option>& options, double containment_min,
                   std::vector<int>* pair_of) {
  std::map<int, Option> best;
  for (const Option& option : options) {
    if ((*pair_of)[static_cast<size_t>(option.other)] >= 0) continue;
    if (option.containment < containment_min) continue;
    auto [found, is_new] = best.try_emplace(option.other, option);
    if (!is_new && option.containment > found->second.containment) found->second = option;
  }
  for (const auto& [other, option] : best) (*pair_of)[static_cast<size_t>(other)] = option.into;
}

// Finds candidate pairs among objects without a partner.
class OptionFinder {
 public:
  OptionFinder(const MapContent& into, const MapContent& other, const MatchOptions& options)
      : into_(into),
        other_(other),
        options_(options),
        mine_(into.OfClass(NodeClass::kObject)),
        positions_(MiddlesOf(into, mine_)),
        grid_(positions_, 1.0) {
    for (const int i : mine_) {
      size_max_ = std::max(size_max_, SizeOf(into.nodes[static_cast<size_t>(i)]));
    }
    size_max_ = std::min(size_max_, 6.0);
  }

  // Candidates of one class that are close or contain each other.
  std::vector<Option> Alike(const std::vector<int>& pair_of) const {
    return Find(pair_of, [&](const Node& known, const Node& node, double distance) {
      Option option;
      option.cost = 2.0;
      if (!AreCompatible(known, node)) return option;
      const double gate = options_.object_noise_m + 0.125 * (SizeOf(known) + SizeOf(node));
      option.containment = Containment(known, node);
      option.cost = distance / gate;
      if (option.containment >= options_.object_containment_min) {
        option.cost = std::min(option.cost, 1.0);
      }
      return option;
    });
  }

  // Candidates in the same space whatever their classes: one of the maps has the wrong class.
  std::vector<Option> InOnePlace(const std::vector<int>& pair_of) const {
    return Find(pair_of, [&](const Node& known, const Node& node, double) {
      Option option;
      const double sameness = Sameness(known, node);
      option.cost = sameness >= options_.object_sameness_min ? 1.0 - sameness : 2.0;
      return option;
    });
  }

 private:
  static std::vector<Eigen::Vector3d> MiddlesOf(const MapContent& content,
                                                const std::vector<int>& nodes) {
    std::vector<Eigen::Vector3d> middles;
    for (const int i : nodes) middles.push_back(MiddleOf(content.nodes[static_cast<size_t>(i)]));
    return middles;
  }

  template <typename Judge>
  std::vector<Option> Find(const std::vector<int>& pair_of, Judge judge) const {
    std::vector<char> is_taken(into_.nodes.size(), 0);
    for (const int pair : pair_of) {
      if (pair >= 0) is_taken[static_cast<size_t>(pair)] = 1;
    }
    std::vector<Option> found;
    for (const int i : other_.OfClass(NodeClass::kObject)) {
      if (pair_of[static_cast<size_t>(i)] >= 0) continue;
      const Node& node = other_.nodes[static_cast<size_t>(i)];
      const Eigen::Vector3d middle = MiddleOf(node);
      const double reach = 0.5 * (SizeOf(node) + size_max_) + options_.object_noise_m;
      grid_.ForEachNear(middle, reach, [&](int k) {
        const int candidate = mine_[static_cast<size_t>(k)];
        const Node& known = into_.nodes[static_cast<size_t>(candidate)];
        if (is_taken[static_cast<size_t>(candidate)] != 0 || !CouldMeet(known, node)) return;
        Option option = judge(known, node, (positions_[static_cast<size_t>(k)] - middle).norm());
        option.into = candidate;
        option.other = i;
        if (option.cost <= 1.0) found.push_back(option);
      });
    }
    return found;
  }

  const MapContent& into_;
  const MapContent& other_;
  const MatchOptions& options_;
  std::vector<int> mine_;
  std::vector<Eigen::Vector3d> positions_;
  PointGrid grid_;
  double size_max_ = 0.0;
};

}  // namespace

void MatchObjects(const MapContent& into, const MapContent& other, const MatchOptions& options,
                  std::vector<int>* pair_of) {
  const OptionFinder finder(into, other, options);
  const std::vector<Option> alike = finder.Alike(*pair_of);
  for (const std::vector<Option>& group : GroupsOf(alike)) AssignGroup(group, pair_of);
  TakeFragments(alike, options.object_containment_min, pair_of);
  const std::vector<Option> confused = finder.InOnePlace(*pair_of);
  for (const std::vector<Option>& group : GroupsOf(confused)) AssignGroup(group, pair_of);
}

namespace {

// Within half of the smaller clearance the straight line between both is free of obstacles.
double RadiusOf(const Node& a, const Node& b, const MatchOptions& options) {
  const double half = 0.5 * std::min(ClearanceOf(a), ClearanceOf(b));
  return std::clamp(half, options.place_radius_min_m, options.place_radius_max_m);
}

bool AreCoplanar(const Node& a, const Node& b, const MatchOptions& options) {
  const Eigen::Vector3d& normal = a.structure->plane_normal_map;
  if (normal.isZero() || b.structure->plane_normal_map.isZero()) return false;
  // Signed: the two faces of a wall are two structures.
  if (normal.dot(b.structure->plane_normal_map) < std::cos(options.plane_angle_max_rad)) {
    return false;
  }
  const Eigen::Vector3d middle = b.map_T_node * b.box_node.center();
  return std::abs(normal.dot(middle) + a.structure->plane_offset_m) < options.plane_distance_max_m;
}

// Shared volume over the smaller volume, in the frame of `a`.
double SharedExtent(const Node& a, const Node& b) {
  Box3d box_b = TransformBox(a.map_T_node.Inverse() * b.map_T_node, b.box_node);
  Box3d box_a = a.box_node;
  for (Box3d* box : {&box_a, &box_b}) {
    *box = Box3d(box->min().array() - 0.1, box->max().array() + 0.1);
  }
  const Box3d shared = box_a.intersection(box_b);
  if (shared.isEmpty()) return 0.0;
  return shared.volume() / std::min(box_a.volume(), box_b.volume());
}

bool IsFlat(const Node& node) { return node.structure.has_value() && !node.box_node.isEmpty(); }

}  // namespace

void MatchPlaces(const MapContent& into, const MapContent& other, const MatchOptions& options,
                 std::vector<int>* pair_of) {
  const std::vector<int> mine = into.OfClass(NodeClass::kPlace);
  std::vector<Eigen::Vector3d> positions;
  for (const int i : mine) {
    positions.push_back(into.nodes[static_cast<size_t>(i)].map_T_node.position);
  }
  const PointGrid grid(positions, 1.0);
  for (const int i : other.OfClass(NodeClass::kPlace)) {
    int& pair = (*pair_of)[static_cast<size_t>(i)];
    if (pair >= 0) continue;
    const Node& node = other.nodes[static_cast<size_t>(i)];
    double best = 2.0;
    grid.ForEachNear(node.map_T_node.position, options.place_radius_max_m, [&](int k) {
      const int candidate = mine[static_cast<size_t>(k)];
      const Node& known = into.nodes[static_cast<size_t>(candidate)];
      if (known.layer != node.layer) return;
      const double distance = (positions[static_cast<size_t>(k)] - node.map_T_node.position).norm();
      const double relative = distance / RadiusOf(known, node, options);
      if (relative > 1.0 || relative > best || (relative == best && candidate > pair)) return;
      best = relative;
      pair = candidate;
    });
  }
}

void MatchStructures(const MapContent& into, const MapContent& other, const MatchOptions& options,
                     std::vector<int>* pair_of) {
  const std::vector<int> mine = into.OfClass(NodeClass::kStructure);
  for (const int i : other.OfClass(NodeClass::kStructure)) {
    int& pair = (*pair_of)[static_cast<size_t>(i)];
    const Node& node = other.nodes[static_cast<size_t>(i)];
    if (pair >= 0 || !IsFlat(node)) continue;
    const Box3d box = node.BoxMap();
    double best = 0.3;
    for (const int candidate : mine) {
      const Node& known = into.nodes[static_cast<size_t>(candidate)];
      if (!IsFlat(known) || known.structure->structure_type != node.structure->structure_type) {
        continue;
      }
      if (known.BoxMap().exteriorDistance(box) > options.plane_distance_max_m) continue;
      if (!AreCoplanar(known, node, options)) continue;
      const double shared = SharedExtent(known, node);
      if (shared <= best) continue;
      best = shared;
      pair = candidate;
    }
  }
}

namespace {

// Regions whose heights overlap by less than this share of the lower one are on different storeys.
constexpr double kHeightShareMin = 0.5;
constexpr double kChildShareMin = 0.5;
// Buildings that overlap by a tenth are one building.
constexpr double kBuildingOverlapMin = 0.1;

bool AreOnOneStorey(const Node& a, const Node& b) {
  const HeightSpan ha = HeightsOf(a);
  const HeightSpan hb = HeightsOf(b);
  const double shared = std::min(ha.z_max_m, hb.z_max_m) - std::max(ha.z_min_m, hb.z_min_m);
  const double lower = std::min(ha.z_max_m - ha.z_min_m, hb.z_max_m - hb.z_min_m);
  if (lower <= 0.0) return std::abs(ha.z_min_m - hb.z_min_m) < 1.0;
  return shared > kHeightShareMin * lower;
}

// Number of matched children by pair of parents (into, other).
using SharedChildren = std::map<std::pair<int, int>, int>;

struct Children {
  SharedChildren shared;
  std::map<int, int> of_into;
  std::map<int, int> of_other;
};

Children CountChildren(const MapContent& into, const MapContent& other,
                       const std::vector<int>& pair_of) {
  Children children;
  for (const int parent : into.parent) ++children.of_into[parent];
  for (size_t i = 0; i < other.nodes.size(); ++i) {
    const int parent = other.parent[i];
    if (parent < 0) continue;
    ++children.of_other[parent];
    if (pair_of[i] < 0) continue;
    const int home = into.parent[static_cast<size_t>(pair_of[i])];
    if (home >= 0) ++children.shared[{home, parent}];
  }
  return children;
}

double ChildShare(const Children& children, int into, int other) {
  const auto shared = children.shared.find({into, other});
  if (shared == children.shared.end()) return 0.0;
  const int fewer = std::min(children.of_into.at(into), children.of_other.at(other));
  return static_cast<double>(shared->second) / fewer;
}

double OverlapNeeded(const Node& a, const Node& b, int32_t rank, const MatchOptions& options) {
  if (rank > 400) return kBuildingOverlapMin;
  const bool is_same_class = !ClassKey(a).empty() && ClassKey(a) == ClassKey(b);
  return is_same_class ? options.room_overlap_min_same_class : options.room_overlap_min;
}

// Floor plan overlap plus share of common children, 0 to 2; 0 if neither suffices.
double Likeness(const Node& known, const Node& node, double child_share, double overlap_needed) {
  if (known.layer != node.layer || known.kind != node.kind) return 0.0;
  const Polygon2d a = FootprintOf(known);
  const Polygon2d b = FootprintOf(node);
  const double smaller = std::min(std::abs(SignedArea(a)), std::abs(SignedArea(b)));
  double overlap = 0.0;
  if (smaller > 0.0 && AreOnOneStorey(known, node)) overlap = SharedArea(a, b) / smaller;
  if (overlap < overlap_needed && child_share < kChildShareMin) return 0.0;
  return overlap + child_share;
}

}  // namespace

void MatchRegions(const MapContent& into, const MapContent& other, const MatchOptions& options,
                  std::vector<int>* pair_of) {
  const auto rank = [&](const MapContent& content, int i) {
    const auto found = content.rank_of.find(content.nodes[static_cast<size_t>(i)].layer);
    return found == content.rank_of.end() ? 0 : found->second;
  };
  const std::vector<int> mine = into.OfClass(NodeClass::kRegion);
  std::vector<int> theirs = other.OfClass(NodeClass::kRegion);
  std::stable_sort(theirs.begin(), theirs.end(),
                   [&](int a, int b) { return rank(other, a) < rank(other, b); });
  Children children = CountChildren(into, other, *pair_of);
  int32_t counted_rank = 0;
  for (const int i : theirs) {
    if (rank(other, i) != counted_rank) {
      // Pairs of the layer below count as common children here.
      children = CountChildren(into, other, *pair_of);
      counted_rank = rank(other, i);
    }
    int& pair = (*pair_of)[static_cast<size_t>(i)];
    if (pair >= 0) continue;
    const Node& node = other.nodes[static_cast<size_t>(i)];
    double best = 0.0;
    for (const int candidate : mine) {
      const Node& known = into.nodes[static_cast<size_t>(candidate)];
      const double likeness = Likeness(known, node, ChildShare(children, candidate, i),
                                       OverlapNeeded(known, node, rank(other, i), options));
      if (likeness <= best) continue;
      best = likeness;
      pair = candidate;
    }
  }
}

namespace {

const TrackInfo* TrackOf(const MapContent& content, NodeId agent) {
  const auto found =
      std::lower_bound(content.tracks.begin(), content.tracks.end(), agent,
                       [](const TrackInfo& track, NodeId id) { return track.agent < id; });
  return found == content.tracks.end() || found->agent != agent ? nullptr : &*found;
}

bool IsLater(const TrackInfo* later, const TrackInfo* earlier) {
  if (later == nullptr || later->pose_count == 0) return false;
  if (earlier == nullptr || earlier->pose_count == 0) return false;
  return later->first_ns > earlier->last_ns;
}

}  // namespace

bool IsGeneratedName(const Node& agent) {
  if (agent.name.empty() || agent.name == agent.kind) return true;
  return std::isdigit(static_cast<unsigned char>(agent.name.back())) != 0;
}

void PairAgents(const MapContent& into, const MapContent& other, std::vector<int>* pair_of) {
  std::map<std::pair<std::string, std::string>, int> by_name;
  for (const int i : into.OfClass(NodeClass::kAgent)) {
    const Node& node = into.nodes[static_cast<size_t>(i)];
    by_name.try_emplace({node.kind, node.name}, i);
  }
  for (const int i : other.OfClass(NodeClass::kAgent)) {
    const Node& node = other.nodes[static_cast<size_t>(i)];
    if ((*pair_of)[static_cast<size_t>(i)] >= 0 || IsGeneratedName(node)) continue;
    const auto found = by_name.find({node.kind, node.name});
    if (found == by_name.end()) continue;
    const NodeId same = into.nodes[static_cast<size_t>(found->second)].id;
    if (!IsLater(TrackOf(other, node.id), TrackOf(into, same))) continue;
    (*pair_of)[static_cast<size_t>(i)] = found->second;
    // Two agents of one name in the other map stay two.
    by_name.erase(found);
  }
}

absl::StatusOr<std::vector<int>> MatchNodes(const MapContent& into, const MapContent& other,
                                            std::vector<int> known, const MatchOptions& options,
                                            const StopCheck& stop) {
  std::vector<int> pair_of = std::move(known);
  PairAgents(into, other, &pair_of);
  for (const auto match : {MatchObjects, MatchPlaces, MatchStructures, MatchRegions}) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    match(into, other, options, &pair_of);
  }
  return pair_of;
}

}  // namespace dsg::merge
