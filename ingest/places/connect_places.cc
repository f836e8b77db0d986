// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/connect_places.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <unordered_map>

#include "ingest/places/ways.h"
#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {
namespace {

class Parts {
 public:
  explicit Parts(const Roadmap& roadmap) {
    Grow(roadmap.spot_count());
    for (const auto& [a, b] : roadmap.links()) Join(a, b);
  }
  void Grow(int count) {
    while (static_cast<int>(sets_.size()) < count) sets_.Add();
  }
  int Root(int spot) { return sets_.Find(spot); }
  void Join(int a, int b) { sets_.Merge(a, b); }
  /// Spots of each part, the smallest part first, then the one of the lowest spot.
  std::vector<std::vector<int>> List() {
    std::vector<std::vector<int>> by_root(sets_.size());
    for (int i = 0; i < static_cast<int>(sets_.size()); ++i) {
      by_root[static_cast<size_t>(Root(i))].push_back(i);
    }
    std::vector<std::vector<int>> parts;
    for (std::vector<int>& part : by_root) {
      if (!part.empty()) parts.push_back(std::move(part));
    }
    std::stable_sort(parts.begin(), parts.end(),
                     [](const auto& a, const auto& b) { return a.size() < b.size(); });
    return parts;
  }

 private:
  DisjointSets sets_;
};

// Cheapest way from any spot of a part to a spot of another one.
class Search {
 public:
  Search(const Roadmap& roadmap, double narrow_weight, Parts* parts)
      : roadmap_(roadmap), narrow_weight_(narrow_weight), parts_(*parts) {}

  /// Cells from start to goal; empty when there is no way.
  std::vector<int64_t> Run(const std::vector<int>& part) {
    for (const int spot : part) Reach(roadmap_.cell(spot), -1, 0.0);
    const int root = parts_.Root(part.front());
    while (!open_.empty()) {
      const auto [cost, cell] = open_.top();
      open_.pop();
      if (cost > reached_.at(cell).cost) continue;
      const int spot = roadmap_.SpotAt(cell);
      if (spot >= 0 && parts_.Root(spot) != root) return WayTo(cell);
      Expand(cell, cost);
    }
    return {};
  }

 private:
  struct Reached {
    double cost = 0.0;
    int64_t from = -1;
  };

  void Reach(int64_t cell, int64_t from, double cost) {
    const auto [found, is_new] = reached_.emplace(cell, Reached{cost, from});
    if (!is_new && found->second.cost <= cost) return;
    found->second = {cost, from};
    open_.emplace(cost, cell);
  }

  void Expand(int64_t cell, double cost) {
    const OpenSpace& space = roadmap_.space();
    const Eigen::Vector3i at = space.frame().Cell(cell);
    for (const Eigen::Vector3i& offset : space.neighbours()) {
      if (!CanStep(space, at, offset)) continue;
      const int64_t next = space.frame().Index(at + offset);
      // The middle of a door is better than its edge.
      const double narrow =
          narrow_weight_ * space.robot_radius_m() / (space.ClearanceM(next) + 0.01);
      Reach(next, cell, cost + offset.cast<double>().norm() * (1.0 + narrow));
    }
  }

  std::vector<int64_t> WayTo(int64_t goal) const {
    std::vector<int64_t> way;
    for (int64_t cell = goal; cell >= 0; cell = reached_.at(cell).from) way.push_back(cell);
    std::reverse(way.begin(), way.end());
    return way;
  }

  const Roadmap& roadmap_;
  const double narrow_weight_;
  Parts& parts_;
  // Looked up only, never listed: its order does not matter.
  std::unordered_map<int64_t, Reached> reached_;
  using Entry = std::pair<double, int64_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
};

}  // namespace

void ConnectParts(const PlaceOptions& options, Roadmap* roadmap) {
  Parts parts(*roadmap);
  const std::vector<std::vector<int>> list = parts.List();
  for (size_t i = 0; i + 1 < list.size(); ++i) {
    const std::vector<int64_t> way = Search(*roadmap, options.narrow_weight, &parts).Run(list[i]);
    if (way.empty()) continue;
    const int known = roadmap->spot_count();
    AddWay(Straighten(roadmap->space(), way, options), options, roadmap);
    parts.Grow(roadmap->spot_count());
    parts.Join(roadmap->SpotAt(way.front()), roadmap->SpotAt(way.back()));
    for (int spot = known; spot < roadmap->spot_count(); ++spot) {
      parts.Join(spot, roadmap->SpotAt(way.front()));
    }
  }
}

}  // namespace dsg::ingest
