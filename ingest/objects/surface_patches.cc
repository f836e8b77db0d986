// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/surface_patches.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {
namespace {

// Directions that the extent of a patch is known in: half a turn.
constexpr int kDirections = 12;

struct PatchEdge {
  float weight = 0.0f;
  int a = 0;
  int b = 0;
};

float WeightOf(const CellGraph& graph, int a, int b, double convex_weight) {
  const Eigen::Vector3f& normal_a = graph.normals_map[static_cast<size_t>(a)];
  const Eigen::Vector3f& normal_b = graph.normals_map[static_cast<size_t>(b)];
  constexpr float kUnknown = 0.5f;
  if (normal_a.isZero() || normal_b.isZero()) return kUnknown;
  const auto bend = static_cast<float>(std::max(0.0, 1.0 - graph.CosineOf(a, b)));
  const Eigen::Vector3f step =
      graph.points_map[static_cast<size_t>(b)] - graph.points_map[static_cast<size_t>(a)];
  const bool is_convex = graph.is_oriented && (normal_b - normal_a).dot(step) > 0.0f;
  return is_convex ? static_cast<float>(convex_weight) * bend : bend;
}

std::vector<PatchEdge> EdgesOf(const CellGraph& graph, const std::vector<bool>& is_free,
                               double convex_weight) {
  std::vector<PatchEdge> edges;
  for (int i = 0; i < static_cast<int>(graph.size()); ++i) {
    if (!is_free[static_cast<size_t>(i)]) continue;
    for (const int other : graph.NeighboursOf(i)) {
      if (other <= i || !is_free[static_cast<size_t>(other)]) continue;
      edges.push_back({WeightOf(graph, i, other, convex_weight), i, other});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const PatchEdge& x, const PatchEdge& y) {
    return std::tuple(x.weight, x.a, x.b) < std::tuple(y.weight, y.a, y.b);
  });
  return edges;
}

std::vector<CellGroup> GroupsOf(const std::vector<bool>& is_free, DisjointSets* sets) {
  std::vector<int> group_of(is_free.size(), -1);
  std::vector<CellGroup> groups;
  for (size_t i = 0; i < is_free.size(); ++i) {
    if (!is_free[i]) continue;
    int& group = group_of[static_cast<size_t>(sets->Find(static_cast<int>(i)))];
    if (group < 0) {
      group = static_cast<int>(groups.size());
      groups.emplace_back();
    }
    groups[static_cast<size_t>(group)].push_back(static_cast<int>(i));
  }
  return groups;
}

/// How far something reaches in each direction.
struct Extent {
  std::array<double, kDirections> low;
  std::array<double, kDirections> high;
  double bottom_m = INFINITY;
  double top_m = -INFINITY;

  Extent() {
    low.fill(INFINITY);
    high.fill(-INFINITY);
  }
  void Add(const Eigen::Vector3d& point) {
    for (int i = 0; i < kDirections; ++i) {
      const double angle = M_PI * i / kDirections;
      const double along = std::cos(angle) * point.x() + std::sin(angle) * point.y();
      low[static_cast<size_t>(i)] = std::min(low[static_cast<size_t>(i)], along);
      high[static_cast<size_t>(i)] = std::max(high[static_cast<size_t>(i)], along);
    }
    bottom_m = std::min(bottom_m, point.z());
    top_m = std::max(top_m, point.z());
  }
  void Add(const Extent& other) {
    for (size_t i = 0; i < low.size(); ++i) {
      low[i] = std::min(low[i], other.low[i]);
      high[i] = std::max(high[i], other.high[i]);
    }
    bottom_m = std::min(bottom_m, other.bottom_m);
    top_m = std::max(top_m, other.top_m);
  }
  /// Sides of the upright rectangle with the least area, the shorter first.
  std::pair<double, double> Sides() const {
    std::pair<double, double> best(INFINITY, INFINITY);
    for (size_t i = 0; i < kDirections / 2; ++i) {
      const double a = high[i] - low[i];
      const double b = high[i + kDirections / 2] - low[i + kDirections / 2];
      if (a * b < best.first * best.second || std::isinf(best.first)) best = std::minmax(a, b);
    }
    return best;
  }
  bool IsNear(const Extent& other, double slack_m) const {
    for (const size_t i : {size_t{0}, size_t{kDirections / 2}}) {
      if (low[i] > other.high[i] + slack_m || high[i] < other.low[i] - slack_m) return false;
    }
    return true;
  }
  double Longest() const { return std::max(Sides().second, top_m - bottom_m); }
};

struct PatchInfo {
  double area_m2 = 0.0;
  Eigen::Vector3d center_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_map = Eigen::Vector3d::Zero();
  double height_m = 0.0;
  Extent extent;
};

/// A set of patches.
struct Thing {
  Extent extent;
  /// Height of its lowest table top, infinite if it has none.
  double table_z_m = INFINITY;
};

/// What two things share of their outlines.
struct Bond {
  double convex_m = 0.0;
  double concave_m = 0.0;
};

/// Of two patches.
struct Contact {
  int a = 0;
  int b = 0;
  double length_m = 0.0;
};

/// A patch near its contact with another one.
struct Side {
  std::vector<int> cells;
  Eigen::Vector3d center_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_map = Eigen::Vector3d::Zero();
};

class PatchJoiner {
 public:
  PatchJoiner(const CellGraph& graph, const std::vector<float>& heights_m,
              const std::vector<CellGroup>& patches, const SegmentOptions& options)
      : graph_(graph),
        patches_(patches),
        options_(options),
        bonds_(patches.size()),
        sets_(patches.size()) {
    for (const CellGroup& patch : patches) infos_.push_back(Describe(patch, heights_m));
    for (const PatchInfo& info : infos_) {
      things_.push_back({info.extent, IsTable(info) ? info.center_map.z() : INFINITY});
    }
    FindContacts();
  }

  std::vector<CellGroup> Join() && {
    JoinBonded();
    JoinCrumbs();
    JoinStacked();
    return Groups();
  }

 private:
  const PatchInfo& Info(int patch) const { return infos_[static_cast<size_t>(patch)]; }

  PatchInfo Describe(const CellGroup& patch, const std::vector<float>& heights_m) const {
    PatchInfo info;
    for (const int cell : patch) {
      const auto i = static_cast<size_t>(cell);
      const Eigen::Vector3d point = graph_.points_map[i].cast<double>();
      info.center_map += point;
      info.normal_map += graph_.NormalAs(info.normal_map, cell);
      info.height_m += static_cast<double>(heights_m[i]);
      info.extent.Add(point);
    }
    const auto count = static_cast<double>(patch.size());
    info.area_m2 = count * graph_.cell_m * graph_.cell_m;
    info.center_map /= count;
    info.height_m /= count;
    if (!info.normal_map.isZero()) info.normal_map.normalize();
    return info;
  }

  void FindContacts() {
    patch_of_.assign(graph_.size(), -1);
    for (size_t patch = 0; patch < patches_.size(); ++patch) {
      for (const int cell : patches_[patch]) {
        patch_of_[static_cast<size_t>(cell)] = static_cast<int>(patch);
      }
    }
    // (own patch, other patch, own cell), once for each cell of a border.
    std::vector<std::tuple<int, int, int>> borders;
    for (const CellGroup& patch : patches_) {
      for (const int cell : patch) {
        const int own = patch_of_[static_cast<size_t>(cell)];
        for (const int neighbour : graph_.NeighboursOf(cell)) {
          const int other = patch_of_[static_cast<size_t>(neighbour)];
          if (other >= 0 && other != own) borders.emplace_back(own, other, cell);
        }
      }
    }
    std::sort(borders.begin(), borders.end());
    borders.erase(std::unique(borders.begin(), borders.end()), borders.end());
    std::map<std::pair<int, int>, Side> sides;
    for (const auto& [own, other, cell] : borders) sides[{own, other}].cells.push_back(cell);
    for (auto& [key, side] : sides) LookAround(key.first, &side);
    for (const auto& [key, side] : sides) {
      if (key.first > key.second) continue;
      const Side& other = sides.at({key.second, key.first});
      Contact contact{key.first, key.second};
      contact.length_m =
          static_cast<double>(std::min(side.cells.size(), other.cells.size())) * graph_.cell_m;
      contacts_.push_back(contact);
      const Bond bond = BondOf(contact, side, other);
      bonds_[static_cast<size_t>(contact.a)][contact.b] = bond;
      bonds_[static_cast<size_t>(contact.b)][contact.a] = bond;
    }
  }

  // The mean of a patch within a few cells of a contact, without the bent edge itself where there
  // is more.
  void LookAround(int patch, Side* side) const {
    std::vector<int> around = side->cells;
    std::set<int> seen(around.begin(), around.end());
    const size_t edge_count = around.size();
    const auto rings = static_cast<size_t>(std::lround(options_.side_reach_m / graph_.cell_m));
    for (size_t next = 0, ring = 0; ring < rings; ++ring) {
      for (const size_t end = around.size(); next < end; ++next) {
        for (const int cell : graph_.NeighboursOf(around[next])) {
          if (patch_of_[static_cast<size_t>(cell)] != patch || !seen.insert(cell).second) continue;
          around.push_back(cell);
        }
      }
    }
    const size_t first = around.size() >= 2 * edge_count ? edge_count : 0;
    for (size_t i = first; i < around.size(); ++i) {
      side->center_map += graph_.points_map[static_cast<size_t>(around[i])].cast<double>();
      side->normal_map += graph_.NormalAs(side->normal_map, around[i]);
    }
    const auto count = static_cast<double>(around.size() - first);
    side->center_map /= count;
    side->normal_map /= count;
  }

  Bond BondOf(const Contact& contact, const Side& a, const Side& b) const {
    const Eigen::Vector3d step = (b.center_map - a.center_map).normalized();
    // How far each is seen above the plane of the other one, sine.
    const double bend = std::max(a.normal_map.dot(step), -b.normal_map.dot(step));
    const bool is_flat = graph_.Cosine(a.normal_map.normalized(), b.normal_map.normalized()) >=
                         std::cos(options_.flat_rad);
    if (is_flat || bend <= options_.shell.bend_sine) return {contact.length_m, 0.0};
    if (SharesSide(contact, a, b)) return {options_.inner_weight * contact.length_m, 0.0};
    return {0.0, contact.length_m};
  }

  // Whether a contact is a whole side of both patches, as that of a back and a seat, and not only
  // of the smaller one, as that of a box and the sofa that it stands beside.
  bool SharesSide(const Contact& contact, const Side& a, const Side& b) const {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    std::vector<int> cells = a.cells;
    cells.insert(cells.end(), b.cells.begin(), b.cells.end());
    for (const int cell : cells) mean += Point(cell);
    mean /= static_cast<double>(cells.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const int cell : cells) spread += (Point(cell) - mean) * (Point(cell) - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    if (solver.info() != Eigen::Success) return false;
    const Eigen::Vector3d along = solver.eigenvectors().col(2);
    const double width_m = std::max(WidthAlong(along, patches_[static_cast<size_t>(contact.a)]),
                                    WidthAlong(along, patches_[static_cast<size_t>(contact.b)]));
    return WidthAlong(along, cells) >= options_.side_share * width_m;
  }

  double WidthAlong(const Eigen::Vector3d& along, const std::vector<int>& cells) const {
    double low_m = INFINITY;
    double high_m = -INFINITY;
    for (const int cell : cells) {
      low_m = std::min(low_m, along.dot(Point(cell)));
      high_m = std::max(high_m, along.dot(Point(cell)));
    }
    return high_m - low_m + graph_.cell_m;
  }

  Eigen::Vector3d Point(int cell) const {
    return graph_.points_map[static_cast<size_t>(cell)].cast<double>();
  }

  // Joins the two things that share most of their outlines, again and again. What they share is
  // counted anew after each step, so that two large things do not become one at a single spot.
  void JoinBonded() {
    std::vector<double> areas;
    for (const PatchInfo& info : infos_) areas.push_back(info.area_m2);
    const auto strength_of = [&](int a, int b) {
      const Bond& bond = bonds_[static_cast<size_t>(a)].at(b);
      const double area_m2 = std::min(areas[static_cast<size_t>(a)], areas[static_cast<size_t>(b)]);
      return (bond.convex_m - options_.concave_weight * bond.concave_m) / std::sqrt(area_m2);
    };
    using Step = std::tuple<double, int, int>;
    std::set<Step, std::greater<>> open;
    const auto push = [&](int a, int b) {
      open.emplace(strength_of(a, b), std::min(a, b), std::max(a, b));
    };
    for (const Contact& contact : contacts_) push(contact.a, contact.b);
    while (!open.empty()) {
      const auto [strength, a, b] = *open.begin();
      if (strength < options_.join_contact) break;
      open.erase(open.begin());
      if (!TryMerge(a, b)) continue;
      const int root = sets_.Find(a);
      const int gone = root == a ? b : a;
      for (const int one : {root, gone}) {
        for (const auto& [other, bond] : bonds_[static_cast<size_t>(one)]) {
          open.erase({strength_of(one, other), std::min(one, other), std::max(one, other)});
        }
      }
      areas[static_cast<size_t>(root)] += areas[static_cast<size_t>(gone)];
      TakeBonds(gone, root);
      for (const auto& [other, bond] : bonds_[static_cast<size_t>(root)]) push(root, other);
    }
  }

  void TakeBonds(int gone, int root) {
    std::map<int, Bond>& own = bonds_[static_cast<size_t>(root)];
    for (const auto& [other, bond] : bonds_[static_cast<size_t>(gone)]) {
      std::map<int, Bond>& theirs = bonds_[static_cast<size_t>(other)];
      theirs.erase(gone);
      if (other == root) continue;
      own[other].convex_m += bond.convex_m;
      own[other].concave_m += bond.concave_m;
      theirs[root] = own[other];
    }
    own.erase(gone);
    bonds_[static_cast<size_t>(gone)].clear();
  }

  bool IsTable(const PatchInfo& patch) const {
    const double up = graph_.is_oriented ? patch.normal_map.z() : std::abs(patch.normal_map.z());
    return up > options_.shell.up_normal && patch.height_m > options_.seat_height_m &&
           patch.area_m2 >= options_.table_area_m2 &&
           patch.extent.Sides().first >= options_.table_width_m;
  }

  // A table has all of it below its top: what rises higher stands on it or beside it.
  bool AreApart(const Thing& a, const Thing& b) const {
    const double slack_m = 1.5 * graph_.cell_m;
    return b.extent.top_m > a.table_z_m + slack_m || a.extent.top_m > b.table_z_m + slack_m;
  }

  bool TryMerge(int a, int b) {
    a = sets_.Find(a);
    b = sets_.Find(b);
    if (a == b) return true;
    Thing both = things_[static_cast<size_t>(a)];
    const Thing& other = things_[static_cast<size_t>(b)];
    if (AreApart(both, other)) return false;
    both.extent.Add(other.extent);
    both.table_z_m = std::min(both.table_z_m, other.table_z_m);
    if (both.extent.Longest() > options_.size_max_m) return false;
    sets_.Merge(a, b);
    things_[static_cast<size_t>(sets_.Find(a))] = both;
    return true;
  }

  // What is too small for a thing of its own belongs to what it touches most.
  void JoinCrumbs() {
    std::vector<double> areas(patches_.size(), 0.0);
    for (size_t i = 0; i < patches_.size(); ++i) {
      areas[static_cast<size_t>(sets_.Find(static_cast<int>(i)))] += infos_[i].area_m2;
    }
    std::vector<const Contact*> by_length;
    for (const Contact& contact : contacts_) by_length.push_back(&contact);
    std::stable_sort(by_length.begin(), by_length.end(),
                     [](const Contact* x, const Contact* y) { return x->length_m > y->length_m; });
    for (const Contact* contact : by_length) {
      const int a = sets_.Find(contact->a);
      const int b = sets_.Find(contact->b);
      if (a == b) continue;
      const double area_a = areas[static_cast<size_t>(a)];
      const double area_b = areas[static_cast<size_t>(b)];
      if (std::min(area_a, area_b) >= options_.area_min_m2) continue;
      if (TryMerge(a, b)) areas[static_cast<size_t>(sets_.Find(a))] = area_a + area_b;
    }
  }

  // What is seen of legs below a larger thing is a part of it, and what is right above it and
  // small, as the back of a chair.
  void JoinStacked() {
    const std::vector<CellGroup> groups = Groups();
    std::map<int, int> patch_of;
    for (size_t i = 0; i < patches_.size(); ++i) {
      patch_of[patches_[i].front()] = static_cast<int>(i);
    }
    std::vector<int> roots;
    std::vector<std::set<std::pair<int, int>>> footprints;
    for (const CellGroup& group : groups) {
      roots.push_back(patch_of.at(group.front()));
      footprints.emplace_back();
      for (const int cell : group) footprints.back().insert(SquareBelow(cell));
    }
    for (size_t part = 0; part < groups.size(); ++part) {
      for (size_t whole = 0; whole < groups.size(); ++whole) {
        if (part == whole || groups[part].size() > groups[whole].size()) continue;
        if (!AreStacked(groups[part], roots[part], groups[whole], roots[whole])) continue;
        if (ShareOver(footprints[part], footprints[whole]) < options_.under_share) continue;
        if (HasOwnSeat(groups[part], footprints[whole].size())) continue;
        if (TryMerge(roots[part], roots[whole])) break;
      }
    }
  }

  // What stands below a table with a seat of its own is no leg, but a chair.
  bool HasOwnSeat(const CellGroup& part, size_t whole_squares) const {
    const double square_m2 = 4.0 * graph_.cell_m * graph_.cell_m;
    std::set<int> seen;
    for (const int cell : part) {
      const int patch = patch_of_[static_cast<size_t>(cell)];
      if (!seen.insert(patch).second) continue;
      const PatchInfo& info = Info(patch);
      const double up = graph_.is_oriented ? info.normal_map.z() : std::abs(info.normal_map.z());
      if (up > options_.shell.up_normal && info.area_m2 >= options_.area_min_m2 &&
          info.height_m >= options_.seat_low_m &&
          2.0 * info.area_m2 <= static_cast<double>(whole_squares) * square_m2) {
        return true;
      }
    }
    return false;
  }

  bool AreStacked(const CellGroup& part, int part_root, const CellGroup& whole, int whole_root) {
    const Extent& small = things_[static_cast<size_t>(sets_.Find(part_root))].extent;
    const Extent& large = things_[static_cast<size_t>(sets_.Find(whole_root))].extent;
    if (!small.IsNear(large, 2.0 * graph_.cell_m)) return false;
    const bool is_below = small.top_m <= large.top_m &&
                          small.top_m >= large.bottom_m - options_.under_gap_m &&
                          2 * part.size() <= whole.size();
    const double area_m2 = static_cast<double>(part.size()) * graph_.cell_m * graph_.cell_m;
    const bool is_above = small.bottom_m >= large.bottom_m &&
                          small.bottom_m <= large.top_m + options_.over_gap_m &&
                          area_m2 <= options_.over_area_m2;
    return is_below || is_above;
  }

  /// Share of the squares of `part` that are in `whole` or beside it.
  static double ShareOver(const std::set<std::pair<int, int>>& part,
                          const std::set<std::pair<int, int>>& whole) {
    const auto is_over = [&](const std::pair<int, int>& square) {
      return whole.contains(square) || whole.contains({square.first - 1, square.second}) ||
             whole.contains({square.first + 1, square.second}) ||
             whole.contains({square.first, square.second - 1}) ||
             whole.contains({square.first, square.second + 1});
    };
    return static_cast<double>(std::count_if(part.begin(), part.end(), is_over)) /
           static_cast<double>(part.size());
  }

  std::pair<int, int> SquareBelow(int cell) const {
    const Eigen::Vector3f& point = graph_.points_map[static_cast<size_t>(cell)];
    const auto side = static_cast<float>(2.0 * graph_.cell_m);
    return {static_cast<int>(std::floor(point.x() / side)),
            static_cast<int>(std::floor(point.y() / side))};
  }

  std::vector<CellGroup> Groups() {
    std::map<int, CellGroup> joined;
    for (size_t i = 0; i < patches_.size(); ++i) {
      CellGroup& group = joined[sets_.Find(static_cast<int>(i))];
      group.insert(group.end(), patches_[i].begin(), patches_[i].end());
    }
    std::vector<CellGroup> groups;
    for (auto& [root, group] : joined) {
      std::sort(group.begin(), group.end());
      groups.push_back(std::move(group));
    }
    std::sort(groups.begin(), groups.end());
    return groups;
  }

  const CellGraph& graph_;
  const std::vector<CellGroup>& patches_;
  const SegmentOptions& options_;
  std::vector<PatchInfo> infos_;
  /// Of the sets, by representative.
  std::vector<Thing> things_;
  std::vector<int> patch_of_;
  std::vector<Contact> contacts_;
  /// By thing and other thing.
  std::vector<std::map<int, Bond>> bonds_;
  DisjointSets sets_;
};

}  // namespace

std::vector<CellGroup> FindPatches(const CellGraph& graph, const std::vector<bool>& is_free,
                                   const SegmentOptions& options) {
  const std::vector<PatchEdge> edges = EdgesOf(graph, is_free, options.convex_weight);
  const int cells_min = static_cast<int>(options.patch_area_m2 / (graph.cell_m * graph.cell_m));
  DisjointSets sets(graph.size());
  std::vector<int> sizes(graph.size(), 1);
  // The largest weight within a patch, and what its size allows beyond it.
  std::vector<double> limits(graph.size(), options.patch_k);
  for (const PatchEdge& edge : edges) {
    const int a = sets.Find(edge.a);
    const int b = sets.Find(edge.b);
    if (a == b) continue;
    const double weight = static_cast<double>(edge.weight);
    if (weight > std::min(limits[static_cast<size_t>(a)], limits[static_cast<size_t>(b)])) continue;
    const int size = sizes[static_cast<size_t>(a)] + sizes[static_cast<size_t>(b)];
    sets.Merge(a, b);
    const auto root = static_cast<size_t>(sets.Find(a));
    sizes[root] = size;
    limits[root] = weight + options.patch_k / size;
  }
  for (const PatchEdge& edge : edges) {
    const int a = sets.Find(edge.a);
    const int b = sets.Find(edge.b);
    if (a == b) continue;
    const int size_a = sizes[static_cast<size_t>(a)];
    const int size_b = sizes[static_cast<size_t>(b)];
    if (std::min(size_a, size_b) >= cells_min) continue;
    sets.Merge(a, b);
    sizes[static_cast<size_t>(sets.Find(a))] = size_a + size_b;
  }
  return GroupsOf(is_free, &sets);
}

std::vector<CellGroup> JoinPatches(const CellGraph& graph, const std::vector<float>& heights_m,
                                   const std::vector<CellGroup>& patches,
                                   const SegmentOptions& options) {
  return PatchJoiner(graph, heights_m, patches, options).Join();
}

}  // namespace dsg::ingest
