// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/filtration.h"

#include <algorithm>
#include <map>
#include <optional>

#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {
namespace {

// Parts of the place graph, and how many of them are large enough.
class LargeParts {
 public:
  LargeParts(size_t count, double size_min) : sets_(count), size_(count, 1), size_min_(size_min) {
    large_count_ = size_min <= 1.0 ? static_cast<int>(count) : 0;
  }

  int Root(int place) { return sets_.Find(place); }

  void Join(int a, int b) {
    a = Root(a);
    b = Root(b);
    if (!sets_.Merge(a, b)) return;
    large_count_ -= IsLarge(a) + IsLarge(b);
    const int whole = Root(a);
    size_[whole] = size_[a] + size_[b];
    large_count_ += IsLarge(whole);
  }

  int IsLarge(int root) const { return size_[root] >= size_min_ ? 1 : 0; }
  int large_count() const { return large_count_; }

 private:
  DisjointSets sets_;
  std::vector<int> size_;
  double size_min_;
  int large_count_ = 0;
};

std::vector<RoomLink> WidestFirst(size_t place_count, const std::vector<RoomLink>& links) {
  std::vector<RoomLink> sorted;
  const auto is_place = [place_count](int place) {
    return place >= 0 && static_cast<size_t>(place) < place_count;
  };
  for (const RoomLink& link : links) {
    if (is_place(link.from) && is_place(link.to) && link.from != link.to) sorted.push_back(link);
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](const RoomLink& a, const RoomLink& b) {
    return a.clearance_m > b.clearance_m;
  });
  return sorted;
}

// Large parts once all ways down to a clearance are there.
struct Step {
  double clearance_m = 0.0;
  int large_count = 0;
};

// The clearance at which ways are cut: the low end of the longest range over which the count holds.
std::optional<double> CutAt(size_t place_count, const std::vector<RoomLink>& sorted,
                            const FiltrationOptions& options) {
  LargeParts parts(place_count, options.place_count_min);
  std::vector<Step> steps;
  for (const RoomLink& link : sorted) {
    parts.Join(link.from, link.to);
    steps.push_back({link.clearance_m, parts.large_count()});
  }
  std::optional<double> best;
  double longest_m = 0.0;
  int most = 0;
  for (size_t begin = 0, end = 0; begin < steps.size(); begin = end) {
    const int count = steps[begin].large_count;
    while (end < steps.size() && steps[end].large_count == count) ++end;
    const double high_m = std::min(steps[begin].clearance_m, options.clearance_m_max);
    const double low_m =
        std::max(end < steps.size() ? steps[end].clearance_m : 0.0, options.clearance_m_min);
    const double length_m = high_m - low_m;
    if (count < 2 || length_m <= 0.0 || length_m < longest_m) continue;
    if (length_m == longest_m && count <= most) continue;
    longest_m = length_m;
    most = count;
    best = low_m;
  }
  return best;
}

}  // namespace

std::vector<int> FiltrationRooms(size_t place_count, const std::vector<RoomLink>& links,
                                 const FiltrationOptions& options) {
  const std::vector<RoomLink> sorted = WidestFirst(place_count, links);
  const std::optional<double> cut_m = CutAt(place_count, sorted, options);
  LargeParts parts(place_count, options.place_count_min);
  for (const RoomLink& link : sorted) {
    if (cut_m.has_value() && link.clearance_m <= *cut_m) continue;
    parts.Join(link.from, link.to);
  }
  std::vector<int> rooms(place_count, -1);
  std::map<int, int> number_of_root;
  for (size_t place = 0; place < place_count; ++place) {
    const int root = parts.Root(static_cast<int>(place));
    if (parts.IsLarge(root) == 0) continue;
    const int next = static_cast<int>(number_of_root.size());
    rooms[place] = number_of_root.try_emplace(root, next).first->second;
  }
  // A flood along the widest ways first.
  for (bool has_changed = true; has_changed;) {
    has_changed = false;
    for (const RoomLink& link : sorted) {
      const bool is_from = rooms[link.from] >= 0;
      if (is_from == (rooms[link.to] >= 0)) continue;
      (is_from ? rooms[link.to] : rooms[link.from]) = rooms[is_from ? link.from : link.to];
      has_changed = true;
      break;
    }
  }
  return rooms;
}

}  // namespace dsg::ingest
