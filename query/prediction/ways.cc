// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/ways.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "schema/base/status.h"

namespace dsg::query {
namespace {

/// Places between two questions to the stop check.
constexpr int64_t kWayPlacesPerStop = 1024;
constexpr std::ptrdiff_t kPrefetchCount = 4;

/// Hands out places by way, then number: from buckets of a few centimetres of ways, each sorted
/// when its turn comes.
class WayQueue {
 public:
  struct Entry {
    double way_m = 0.0;
    int place = 0;

    bool operator<(const Entry& other) const {
      return way_m != other.way_m ? way_m < other.way_m : place < other.place;
    }
  };

  /// No way that is pushed is longer than `way_m_max`, or shorter than the last that was popped.
  explicit WayQueue(double way_m_max)
      : buckets_(static_cast<size_t>(std::min(way_m_max / kBucketM, kBucketCountMax - 1.0)) + 1) {}

  void Push(double way_m, int place) {
    const double last = static_cast<double>(buckets_.size() - 1);
    std::vector<Entry>& bucket = buckets_[static_cast<size_t>(std::min(way_m / kBucketM, last))];
    const Entry entry{way_m, place};
    if (&bucket != &buckets_[open_]) {
      bucket.push_back(entry);
    } else {
      bucket.insert(std::upper_bound(bucket.begin() + next_, bucket.end(), entry), entry);
    }
  }

  /// Null when there is none left; else valid until the next call of either.
  const Entry* Pop() {
    while (next_ == std::ssize(buckets_[open_])) {
      if (open_ + 1 == buckets_.size()) return nullptr;
      std::vector<Entry>().swap(buckets_[open_++]);
      std::sort(buckets_[open_].begin(), buckets_[open_].end());
      next_ = 0;
    }
    return &buckets_[open_][static_cast<size_t>(next_++)];
  }

  /// The one that will be popped after so many others, if that is known; else null.
  const Entry* Ahead(std::ptrdiff_t count) const {
    const std::vector<Entry>& bucket = buckets_[open_];
    if (next_ + count >= std::ssize(bucket)) return nullptr;
    return &bucket[static_cast<size_t>(next_ + count)];
  }

 private:
  static constexpr double kBucketM = 0.05;
  static constexpr double kBucketCountMax = 4096.0;

  std::vector<std::vector<Entry>> buckets_;
  // Sorted from `next_` on, before which all were popped; the buckets before it are empty.
  size_t open_ = 0;
  std::ptrdiff_t next_ = 0;
};

/// Counts down the wanted places that are settled.
class Wanted {
 public:
  Wanted(const std::vector<int>& places, size_t place_count) : is_wanted_(place_count, 0) {
    for (const int place : places) {
      left_count_ += 1 - is_wanted_[place];
      is_wanted_[place] = 1;
    }
  }

  /// Whether that was the last one.
  bool Settle(int place) {
    left_count_ -= is_wanted_[place];
    is_wanted_[place] = 0;
    return left_count_ == 0;
  }

 private:
  std::vector<uint8_t> is_wanted_;
  int left_count_ = 0;
};

}  // namespace

absl::StatusOr<Ways> Ways::Find(const std::vector<Attachment>& from, const GoalField& field,
                                double way_m_max, const StopCheck& stop) {
  return Search(from, field, way_m_max, nullptr, stop);
}

absl::StatusOr<Ways> Ways::FindThese(const std::vector<Attachment>& from, const GoalField& field,
                                     double way_m_max, const std::vector<int>& wanted,
                                     const StopCheck& stop) {
  return Search(from, field, way_m_max, &wanted, stop);
}

absl::StatusOr<Ways> Ways::Search(const std::vector<Attachment>& from, const GoalField& field,
                                  double way_m_max, const std::vector<int>* wanted,
                                  const StopCheck& stop) {
  const size_t place_count = field.graph().places_map.size();
  Ways ways;
  ways.way_m_.assign(place_count, std::numeric_limits<double>::infinity());
  ways.before_.resize(place_count);
  WayQueue queue(way_m_max);
  for (size_t i = 0; i < from.size(); ++i) {
    const int place = from[i].place;
    if (from[i].way_m >= ways.way_m_[place] || from[i].way_m > way_m_max) continue;
    ways.way_m_[place] = from[i].way_m;
    ways.before_[place] = -1 - static_cast<int>(i);
    queue.Push(from[i].way_m, place);
  }
  Wanted left(wanted == nullptr ? std::vector<int>() : *wanted, place_count);
  StopCounter counter(stop, kWayPlacesPerStop);
  while (const WayQueue::Entry* const popped = queue.Pop()) {
    const WayQueue::Entry entry = *popped;
    if (const WayQueue::Entry* const ahead = queue.Ahead(kPrefetchCount)) {
      // Places of one way are all over the graph, so that no cache would have their links.
      __builtin_prefetch(field.Neighbours(ahead->place).data());
    }
    if (entry.way_m > ways.way_m_[entry.place]) continue;
    DSG_RETURN_IF_ERROR(counter.Check());
    if (wanted != nullptr && left.Settle(entry.place)) break;
    for (const GoalField::Neighbour& neighbour : field.Neighbours(entry.place)) {
      const double longer_m = entry.way_m + neighbour.way_m;
      if (longer_m >= ways.way_m_[neighbour.place] || longer_m > way_m_max) continue;
      ways.way_m_[neighbour.place] = longer_m;
      ways.before_[neighbour.place] = entry.place;
      queue.Push(longer_m, neighbour.place);
    }
  }
  return ways;
}

bool Ways::Reaches(int place) const { return std::isfinite(way_m_[place]); }

int Ways::Origin(int place) const {
  int at = place;
  while (before_[at] >= 0) at = before_[at];
  return -1 - before_[at];
}

std::vector<int> Ways::PlacesTo(int place) const {
  std::vector<int> places;
  for (int at = place; at >= 0; at = before_[at]) places.push_back(at);
  std::reverse(places.begin(), places.end());
  return places;
}

std::vector<int> Ways::PlacesWithin(int place, double way_m) const {
  int last = place;
  while (before_[last] >= 0 && way_m_[before_[last]] > way_m) last = before_[last];
  return PlacesTo(last);
}

}  // namespace dsg::query
