// SPDX-License-Identifier: Apache-2.0
#include "query/view/space_index.h"

#include <algorithm>
#include <cmath>

namespace dsg::query {
namespace {

// Cells of 1.6 cm; the grid repeats after 33 km, so that no map is too far from its origin.
constexpr double kCellsPerMetre = 64.0;
constexpr int kAxisBits = 21;

float RoundedDown(double value) {
  const auto rounded = static_cast<float>(value);
  return static_cast<double>(rounded) > value
             ? std::nextafter(rounded, -std::numeric_limits<float>::infinity())
             : rounded;
}

float RoundedUp(double value) {
  const auto rounded = static_cast<float>(value);
  return static_cast<double>(rounded) < value
             ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
             : rounded;
}

// Two zero bits after each of the low 21.
uint64_t Spread(uint64_t bits) {
  bits &= (uint64_t{1} << kAxisBits) - 1;
  bits = (bits | bits << 32) & 0x001f00000000ffff;
  bits = (bits | bits << 16) & 0x001f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

// Place along Morton's curve, on which what is near in space is mostly near.
uint64_t CurveCode(const Eigen::Vector3d& point) {
  uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::clamp(std::floor(point[axis] * kCellsPerMetre), -0x1p52, 0x1p52);
    code |= Spread(static_cast<uint64_t>(static_cast<int64_t>(cell) + (int64_t{1} << 52))) << axis;
  }
  return code;
}

// Children of an inner page that may hold keys of the range.
template <typename Visit>
void VisitChildren(const SpaceTree::Inner& inner, const SpaceRange& range, const Visit& visit) {
  for (int i = 0; i < inner.count; ++i) {
    if (i + 1 < inner.count && inner.lows[i + 1] <= range.first) continue;
    if (range.second < inner.lows[i]) return;
    visit(i);
  }
}

// Entries of a leaf whose keys are in the range, until `visit` returns false.
template <typename Visit>
void VisitEntries(const SpaceTree::Leaf& leaf, const SpaceRange& range, const Visit& visit) {
  for (int i = CowPages<SpaceTraits>::LowerBound(leaf, range.first); i < leaf.count; ++i) {
    const SpaceEntry& entry = leaf.entries[i];
    if (range.second < entry.key || !visit(entry)) return;
  }
}

// Something at a distance of at least so much: a page, an entry, or a node exactly so far.
struct Candidate {
  double distance_m = 0.0;
  NodeId id;
  const SpaceTree::Page* page = nullptr;
  const ViewNode* node = nullptr;
  size_t range = 0;
};

// What may still turn out nearer goes first, so that ties are settled by id among all nodes.
bool IsLater(const Candidate& a, const Candidate& b) {
  if (a.distance_m != b.distance_m) return a.distance_m > b.distance_m;
  const bool a_exact = a.node != nullptr;
  const bool b_exact = b.node != nullptr;
  if (a_exact != b_exact) return a_exact;
  return a.id > b.id;
}

class NearestSearch {
 public:
  NearestSearch(const std::vector<SpaceRange>& ranges, const Eigen::Vector3d& point_map,
                double distance_m_max, const std::function<const ViewNode*(NodeId)>& find)
      : ranges_(ranges), point_map_(point_map), distance_m_max_(distance_m_max), find_(find) {
    queue_.reserve(256);
  }

  void Run(const SpaceTree::Page& root,
           const std::function<bool(const ViewNode&, double distance_m)>& visit) {
    for (size_t i = 0; i < ranges_.size(); ++i) Push({0.0, NodeId(), &root, nullptr, i});
    while (!queue_.empty()) {
      std::pop_heap(queue_.begin(), queue_.end(), IsLater);
      const Candidate nearest = queue_.back();
      queue_.pop_back();
      if (nearest.node != nullptr) {
        if (!visit(*nearest.node, nearest.distance_m)) return;
      } else if (nearest.page != nullptr) {
        Open(*nearest.page, nearest.range);
      } else {
        const ViewNode* node = find_(nearest.id);
        Push({node->DistanceTo(point_map_), nearest.id, nullptr, node, 0});
      }
    }
  }

 private:
  void Push(const Candidate& candidate) {
    // Not "farther": an empty box is infinitely far.
    if (!(candidate.distance_m <= distance_m_max_) || std::isinf(candidate.distance_m)) return;
    queue_.push_back(candidate);
    std::push_heap(queue_.begin(), queue_.end(), IsLater);
  }

  void Open(const SpaceTree::Page& page, size_t range) {
    if (!page.is_leaf) {
      const auto& inner = SpaceTree::AsInner(page);
      VisitChildren(inner, ranges_[range], [&](int i) {
        Push({inner.summaries[i].DistanceBound(point_map_), NodeId(), inner.children[i].get(),
              nullptr, range});
      });
      return;
    }
    VisitEntries(SpaceTree::AsLeaf(page), ranges_[range], [&](const SpaceEntry& entry) {
      Push({entry.box.DistanceBound(point_map_), entry.key.id, nullptr, nullptr, 0});
      return true;
    });
  }

  const std::vector<SpaceRange>& ranges_;
  const Eigen::Vector3d point_map_;
  const double distance_m_max_;
  const std::function<const ViewNode*(NodeId)>& find_;
  std::vector<Candidate> queue_;
};

bool VisitTouching(const SpaceTree::Page& page, const SpaceRange& range, const Box3d& box_map,
                   const std::function<bool(NodeId)>& visit) {
  bool go_on = true;
  if (!page.is_leaf) {
    const auto& inner = SpaceTree::AsInner(page);
    VisitChildren(inner, range, [&](int i) {
      if (!go_on || !inner.summaries[i].MayTouch(box_map)) return;
      go_on = VisitTouching(*inner.children[i].get(), range, box_map, visit);
    });
    return go_on;
  }
  VisitEntries(SpaceTree::AsLeaf(page), range, [&](const SpaceEntry& entry) {
    go_on = !entry.box.MayTouch(box_map) || visit(entry.key.id);
    return go_on;
  });
  return go_on;
}

}  // namespace

CoarseBox::CoarseBox(const Box3d& box) {
  for (int i = 0; i < 3; ++i) {
    min[i] = RoundedDown(box.min()[i]);
    max[i] = RoundedUp(box.max()[i]);
  }
}

// Adds up as Eigen's squaredExteriorDistance does, so that rounding cannot make it larger than the
// distance to a box inside.
double CoarseBox::DistanceBound(const Eigen::Vector3d& point) const {
  double squared = 0.0;
  for (int i = 0; i < 3; ++i) {
    double off = 0.0;
    if (point[i] < static_cast<double>(min[i])) {
      off = static_cast<double>(min[i]) - point[i];
    } else if (point[i] > static_cast<double>(max[i])) {
      off = point[i] - static_cast<double>(max[i]);
    }
    squared += off * off;
  }
  return std::sqrt(squared);
}

bool CoarseBox::MayTouch(const Box3d& box) const {
  for (int i = 0; i < 3; ++i) {
    if (box.min()[i] > static_cast<double>(max[i])) return false;
    if (box.max()[i] < static_cast<double>(min[i])) return false;
  }
  return true;
}

SpaceEntry MakeSpaceEntry(const ViewNode& node, bool is_agent) {
  const Box3d box_map = node.BoxMap();
  SpaceEntry entry;
  entry.key = {node.layer, node.class_name, CurveCode(box_map.center()), node.id};
  if (!is_agent) entry.box = CoarseBox(box_map);
  return entry;
}

SpaceRange RangeOf(LayerId layer) {
  return {{layer, 0, 0, NodeId()}, {layer, UINT32_MAX, UINT64_MAX, NodeId(UINT64_MAX)}};
}

SpaceRange RangeOf(LayerId layer, Symbol class_name) {
  return {{layer, class_name, 0, NodeId()}, {layer, class_name, UINT64_MAX, NodeId(UINT64_MAX)}};
}

SpaceRange RangeOfAll() {
  return {{INT32_MIN, 0, 0, NodeId()}, {INT32_MAX, UINT32_MAX, UINT64_MAX, NodeId(UINT64_MAX)}};
}

void VisitNearest(const SpaceTree& tree, const std::vector<SpaceRange>& ranges,
                  const Eigen::Vector3d& point_map, double distance_m_max,
                  const std::function<const ViewNode*(NodeId)>& find,
                  const std::function<bool(const ViewNode&, double distance_m)>& visit) {
  if (tree.root() == nullptr) return;
  NearestSearch(ranges, point_map, distance_m_max, find).Run(*tree.root(), visit);
}

void VisitCandidates(const SpaceTree& tree, const std::vector<SpaceRange>& ranges,
                     const Box3d& box_map, const std::function<bool(NodeId)>& visit) {
  if (tree.root() == nullptr) return;
  for (const SpaceRange& range : ranges) {
    if (!VisitTouching(*tree.root(), range, box_map, visit)) return;
  }
}

}  // namespace dsg::query
