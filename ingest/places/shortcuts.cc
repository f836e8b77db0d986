// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/shortcuts.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <utility>

#include "ingest/places/ways.h"

namespace dsg::ingest {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The nearest place of every cell, on foot.
class Regions {
 public:
  explicit Regions(const Roadmap& roadmap) : space_(roadmap.space()) {
    const auto count = static_cast<size_t>(space_.frame().CellCount());
    length_.assign(count, kInfinity);
    spot_.assign(count, -1);
    from_.assign(count, -1);
    for (int spot = 0; spot < roadmap.spot_count(); ++spot) {
      if (space_.IsOpen(roadmap.cell(spot))) Reach(roadmap.cell(spot), -1, spot, 0.0);
    }
    Spread();
  }

  /// Where two regions meet on the shortest way between their places.
  struct Meeting {
    double length_m = kInfinity;
    int64_t cell = -1;
    int64_t other_cell = -1;
  };

  std::map<std::pair<int, int>, Meeting> FindMeetings() const {
    std::map<std::pair<int, int>, Meeting> meetings;
    for (int64_t cell = 0; cell < space_.frame().CellCount(); ++cell) {
      if (spot_[cell] < 0) continue;
      ForEachStep(cell, [&](int64_t next, double step_m) {
        if (spot_[next] <= spot_[cell]) return;
        Meeting& best = meetings[{spot_[cell], spot_[next]}];
        const double length_m = length_[cell] + step_m + length_[next];
        if (length_m < best.length_m) best = {length_m, cell, next};
      });
    }
    return meetings;
  }

  std::vector<int64_t> WayThrough(const Meeting& meeting) const {
    std::vector<int64_t> way;
    for (int64_t cell = meeting.cell; cell >= 0; cell = from_[cell]) way.push_back(cell);
    std::reverse(way.begin(), way.end());
    for (int64_t cell = meeting.other_cell; cell >= 0; cell = from_[cell]) way.push_back(cell);
    return way;
  }

 private:
  template <typename Visit>
  void ForEachStep(int64_t cell, const Visit& visit) const {
    const GridFrame& frame = space_.frame();
    const Eigen::Vector3i at = frame.Cell(cell);
    for (const Eigen::Vector3i& offset : space_.neighbours()) {
      if (!CanStep(space_, at, offset)) continue;
      visit(frame.Index(at + offset), frame.cell_m * offset.cast<double>().norm());
    }
  }

  void Reach(int64_t cell, int64_t from, int spot, double length_m) {
    if (length_[cell] <= length_m) return;
    length_[cell] = length_m;
    from_[cell] = from;
    spot_[cell] = spot;
    open_.emplace(length_m, cell);
  }

  void Spread() {
    while (!open_.empty()) {
      const auto [length_m, cell] = open_.top();
      open_.pop();
      if (length_m > length_[cell]) continue;
      ForEachStep(cell, [&, so_far_m = length_m, at = cell](int64_t next, double step_m) {
        Reach(next, at, spot_[at], so_far_m + step_m);
      });
    }
  }

  const OpenSpace& space_;
  std::vector<double> length_;
  std::vector<int> spot_;
  std::vector<int64_t> from_;
  using Entry = std::pair<double, int64_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
};

// The links of a roadmap as ways to the next place.
class Network {
 public:
  explicit Network(const Roadmap& roadmap) : roadmap_(roadmap) {
    for (const auto& [a, b] : roadmap.links()) Add(a, b);
  }

  void Add(int a, int b) {
    next_.resize(std::max(next_.size(), static_cast<size_t>(roadmap_.spot_count())));
    const double length_m = (roadmap_.position_map(a) - roadmap_.position_map(b)).norm();
    next_[static_cast<size_t>(a)].emplace_back(b, length_m);
    next_[static_cast<size_t>(b)].emplace_back(a, length_m);
  }

  /// There is a way that is no longer.
  bool HasWay(int from, int to, double length_m) const {
    std::map<int, double> reached = {{from, 0.0}};
    std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>>
        open;
    open.emplace(0.0, from);
    while (!open.empty()) {
      const auto [so_far_m, spot] = open.top();
      open.pop();
      if (spot == to) return true;
      if (static_cast<size_t>(spot) >= next_.size()) continue;
      for (const auto& [next, step_m] : next_[static_cast<size_t>(spot)]) {
        const double sum_m = so_far_m + step_m;
        const auto [found, is_new] = reached.try_emplace(next, sum_m);
        if (sum_m > length_m || (!is_new && found->second <= sum_m)) continue;
        found->second = sum_m;
        open.emplace(sum_m, next);
      }
    }
    return false;
  }

 private:
  const Roadmap& roadmap_;
  std::vector<std::vector<std::pair<int, double>>> next_;
};

double LengthOf(const std::vector<int64_t>& bends, const OpenSpace& space) {
  double length_m = 0.0;
  for (size_t i = 0; i + 1 < bends.size(); ++i) {
    length_m += (space.CenterOf(bends[i]) - space.CenterOf(bends[i + 1])).norm();
  }
  return length_m;
}

}  // namespace

void AddShortcuts(const PlaceOptions& options, Roadmap* roadmap) {
  const OpenSpace& space = roadmap->space();
  const Regions regions(*roadmap);
  std::vector<std::pair<std::pair<int, int>, Regions::Meeting>> meetings;
  for (const auto& meeting : regions.FindMeetings()) meetings.push_back(meeting);
  std::stable_sort(meetings.begin(), meetings.end(), [](const auto& a, const auto& b) {
    return a.second.length_m < b.second.length_m;
  });
  Network network(*roadmap);
  for (const auto& [pair, meeting] : meetings) {
    if (roadmap->IsLinked(pair.first, pair.second)) continue;
    const std::vector<int64_t> bends = Straighten(space, regions.WayThrough(meeting), options);
    const double length_m = LengthOf(bends, space);
    if (network.HasWay(pair.first, pair.second, options.detour * length_m)) continue;
    for (const auto& [a, b] : AddWay(bends, options, roadmap)) network.Add(a, b);
  }
}

}  // namespace dsg::ingest
