// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "schema/base/disjoint_sets.h"
#include "schema/matching/assignment.h"
#include "schema/merge/match_nodes.h"
#include "schema/merge/point_grid.h"

namespace dsg::merge {
namespace {

constexpr size_t kAssignmentCellsMax = 250'000;

Eigen::Vector3d MiddleOf(const Node& node) {
  return node.box_node.isEmpty() ? node.map_T_node.position
                                 : Eigen::Vector3d(node.map_T_node * node.box_node.center());
}

double SizeOf(const Node& node) {
  return node.box_node.isEmpty() ? 0.0 : node.box_node.sizes().norm();
}

// Custom kinds without a class, such as the poses of an imported robot, tell nothing of themselves.
bool CouldMeet(const Node& a, const Node& b) {
  if (a.kind != kinds::kObject && ClassKey(a).empty()) return false;
  return a.kind == b.kind && a.layer == b.layer && a.valid.Overlaps(b.valid);
}

bool AreCompatible(const Node& a, const Node& b) {
  const std::string key_a = ClassKey(a);
  const std::string key_b = ClassKey(b);
  return key_a.empty() || key_b.empty() || key_a == key_b;
}

// Shared volume by that of the smaller; thin boxes are given a little depth.
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

// Shared volume by that of both together.
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

// Cuts the options into groups that share no object, so that assignments stay small.
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

// Nearest first, for crowds in which the best assignment would take too long.
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

// What is left and lies inside a thing of its class is a fragment of it.
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

// Pairs worth a thought, among what has no partner yet.
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

  // Of one class, near each other or one inside the other.
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

  // Two things cannot fill the same space: one of the maps is wrong about the class.
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

}  // namespace dsg::merge
