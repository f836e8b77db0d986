// SPDX-License-Identifier: Apache-2.0
// Nodes by layer, class and place in space: an R-tree packed along a space-filling curve, one
// stretch of it for each class of each layer. Its boxes are rounded outward to single precision, so
// they choose candidates only.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "query/view/cow_tree.h"
#include "query/view/graph_view.h"

namespace dsg::query {

/// A box in single precision that holds the box it was made of; empty by default.
struct CoarseBox {
  std::array<float, 3> min = {kInfinity, kInfinity, kInfinity};
  std::array<float, 3> max = {-kInfinity, -kInfinity, -kInfinity};

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  CoarseBox() = default;
  explicit CoarseBox(const Box3d& box);

  void Add(const CoarseBox& other) {
    for (size_t i = 0; i < 3; ++i) {
      min[i] = other.min[i] < min[i] ? other.min[i] : min[i];
      max[i] = other.max[i] > max[i] ? other.max[i] : max[i];
    }
  }
  /// At most the distance to anything inside; infinite when empty.
  double DistanceBound(const Eigen::Vector3d& point) const;
  bool MayTouch(const Box3d& box) const;
};

struct SpaceKey {
  LayerId layer = 0;
  Symbol class_name = 0;
  uint64_t code = 0;
  NodeId id;
  auto operator<=>(const SpaceKey&) const = default;
};

struct SpaceEntry {
  SpaceKey key;
  /// Empty for agents, which no search in space finds.
  CoarseBox box;
};

struct SpaceTraits {
  using Entry = SpaceEntry;
  using Key = SpaceKey;
  struct Summary : CoarseBox {
    using CoarseBox::Add;
    void Add(const SpaceEntry& entry) { CoarseBox::Add(entry.box); }
  };
  static constexpr int kLeafEntries = 16;
  static constexpr int kChildren = 16;
  static const Key& KeyOf(const SpaceEntry& entry) { return entry.key; }
};

using SpaceTree = CowTree<SpaceTraits>;

SpaceEntry MakeSpaceEntry(const ViewNode& node, bool is_agent);

/// Stretches of keys to search; both ends belong.
using SpaceRange = std::pair<SpaceKey, SpaceKey>;
SpaceRange RangeOf(LayerId layer);
SpaceRange RangeOf(LayerId layer, Symbol class_name);
SpaceRange RangeOfAll();

/// Calls `visit` with nodes by distance to their exact boxes, then id, until it returns false.
/// `find` gives the node of an id.
void VisitNearest(const SpaceTree& tree, const std::vector<SpaceRange>& ranges,
                  const Eigen::Vector3d& point_map, double distance_m_max,
                  const std::function<const ViewNode*(NodeId)>& find,
                  const std::function<bool(const ViewNode&, double distance_m)>& visit);

/// Ids of nodes whose boxes may touch, until `visit` returns false.
void VisitCandidates(const SpaceTree& tree, const std::vector<SpaceRange>& ranges,
                     const Box3d& box_map, const std::function<bool(NodeId)>& visit);

}  // namespace dsg::query
