// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/landmarks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "query/engine/planning/search_scratch.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Radii of one class share landmarks: those of the smallest radius of the class. A power of two, so
// that rounding never makes it larger than the radius.
constexpr double kRadiusClassM = 0.0625;
constexpr size_t kSetCountMax = 4;
constexpr int kCornerCount = 8;
// Of a float, relative.
constexpr double kRounding = 6e-8;

}  // namespace

class LandmarkBuilder {
 public:
  LandmarkBuilder(const PlaceGraph& graph, const Limits& limits, const StopCheck& stop)
      : graph_(graph),
        limits_(limits),
        stop_(stop),
        landmarks_(std::make_shared<Landmarks>()),
        way_m_(static_cast<size_t>(graph.size())) {}

  absl::StatusOr<std::shared_ptr<const Landmarks>> Build() {
    landmarks_->distances_.resize(static_cast<size_t>(graph_.size()));
    DSG_RETURN_IF_ERROR(FindComponents());
    for (int slot = 0; slot < kLandmarkCount; ++slot) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      const std::vector<PlaceIndex> chosen = slot < kCornerCount ? Corners(slot) : Farthest(slot);
      DSG_RETURN_IF_ERROR(Measure(slot, chosen));
    }
    return landmarks_;
  }

 private:
  absl::Status FindComponents() {
    StopCounter counter(stop_, kPlacesPerStop);
    std::vector<int32_t>& component = landmarks_->components_;
    component.assign(static_cast<size_t>(graph_.size()), -1);
    std::vector<PlaceIndex> pending;
    for (PlaceIndex first = 0; first < graph_.size(); ++first) {
      if (component[static_cast<size_t>(first)] >= 0 || !limits_.Admits(graph_, first)) continue;
      const int32_t number = landmarks_->component_count_++;
      Box3d& box = boxes_.emplace_back();
      component[static_cast<size_t>(first)] = number;
      pending.push_back(first);
      while (!pending.empty()) {
        DSG_RETURN_IF_ERROR(counter.Check());
        const PlaceIndex place = pending.back();
        pending.pop_back();
        box.extend(graph_.position_map(place));
        for (const auto* link = graph_.links_begin(place); link != graph_.links_end(place);
             ++link) {
          int32_t& other = component[static_cast<size_t>(link->to)];
          if (other >= 0 || !limits_.Admits(*link) || !limits_.Admits(graph_, link->to)) continue;
          other = number;
          pending.push_back(link->to);
        }
      }
    }
    return absl::OkStatus();
  }

  // The place of each component with the largest value; the lowest of equal ones.
  template <typename Value>
  std::vector<PlaceIndex> Best(const Value& value) const {
    const size_t count = static_cast<size_t>(landmarks_->component_count_);
    std::vector<PlaceIndex> best(count, -1);
    std::vector<double> best_value(count, -std::numeric_limits<double>::infinity());
    for (PlaceIndex place = 0; place < graph_.size(); ++place) {
      if (landmarks_->component(place) < 0) continue;
      const size_t component = static_cast<size_t>(landmarks_->component(place));
      const double here = value(place, component);
      if (best[component] >= 0 && here <= best_value[component]) continue;
      best[component] = place;
      best_value[component] = here;
    }
    return best;
  }

  // The corners of a box of equal sides: in a flat building too, both the lowest and the highest
  // places of each corner are wanted.
  std::vector<PlaceIndex> Corners(int corner) const {
    const Eigen::Vector3d sign((corner & 1) != 0 ? 1.0 : -1.0, (corner & 2) != 0 ? 1.0 : -1.0,
                               (corner & 4) != 0 ? 1.0 : -1.0);
    return Best([&](PlaceIndex place, size_t component) {
      const Box3d& box = boxes_[component];
      const Eigen::Vector3d side = box.sizes().cwiseMax(1e-9);
      return sign.dot((graph_.position_map(place) - box.min()).cwiseQuotient(side));
    });
  }

  // Far from all landmarks so far: the ends of dead ends and the middles of large floors.
  std::vector<PlaceIndex> Farthest(int slot) const {
    return Best([&](PlaceIndex place, size_t) {
      const Landmarks::Distances& known = landmarks_->of(place);
      return static_cast<double>(*std::min_element(known.begin(), known.begin() + slot));
    });
  }

  absl::Status Measure(int slot, const std::vector<PlaceIndex>& from) {
    std::fill(way_m_.begin(), way_m_.end(), std::numeric_limits<double>::infinity());
    const BorrowedScratch queue;
    queue->Begin(0);
    for (const PlaceIndex place : from) {
      way_m_[static_cast<size_t>(place)] = 0.0;
      queue->Push(0.0, place, false);
    }
    double farthest_m = 0.0;
    for (int64_t count = 0; !queue->empty(); ++count) {
      if (count % kPlacesPerStop == 0) DSG_RETURN_IF_ERROR(AskStop(stop_));
      const SearchScratch::Entry entry = queue->Pop();
      const PlaceIndex place = entry.place();
      if (entry.total_m > way_m_[static_cast<size_t>(place)]) continue;
      farthest_m = entry.total_m;
      landmarks_->distances_[static_cast<size_t>(place)][static_cast<size_t>(slot)] =
          static_cast<float>(entry.total_m);
      for (const auto* link = graph_.links_begin(place); link != graph_.links_end(place); ++link) {
        const double way_m = entry.total_m + link->length_m;
        if (way_m >= way_m_[static_cast<size_t>(link->to)] || !limits_.Admits(*link) ||
            !limits_.Admits(graph_, link->to)) {
          continue;
        }
        way_m_[static_cast<size_t>(link->to)] = way_m;
        queue->Push(way_m, link->to, false);
      }
    }
    landmarks_->slack_m_ = std::max(landmarks_->slack_m_, 4.0 * kRounding * farthest_m);
    return absl::OkStatus();
  }

  const PlaceGraph& graph_;
  const Limits& limits_;
  const StopCheck& stop_;
  std::shared_ptr<Landmarks> landmarks_;
  std::vector<Box3d> boxes_;
  std::vector<double> way_m_;
};

absl::StatusOr<std::shared_ptr<const Landmarks>> Landmarks::Build(const PlaceGraph& graph,
                                                                  const Limits& limits,
                                                                  const StopCheck& stop) {
  return LandmarkBuilder(graph, limits, stop).Build();
}

size_t Landmarks::memory_bytes() const {
  return distances_.capacity() * sizeof(Distances) + components_.capacity() * sizeof(int32_t);
}

absl::StatusOr<std::shared_ptr<const Landmarks>> LandmarkCache::Get(const PlaceGraph& graph,
                                                                    const Limits& limits,
                                                                    const StopCheck& stop) {
  // Beyond any clearance all classes are alike.
  const double radius_m = std::min(limits.radius_m, 1000.0);
  const Key key{static_cast<int64_t>(std::floor(radius_m / kRadiusClassM)),
                limits.at_ns == kPresent};
  return flights_.Run(
      key, stop, [&] { return Find(key); }, [&] { return Build(graph, key, stop); });
}

std::optional<std::shared_ptr<const Landmarks>> LandmarkCache::Find(const Key& key) {
  const std::lock_guard lock(mutex_);
  for (Entry& entry : entries_) {
    if (entry.key != key) continue;
    entry.used = ++use_count_;
    return entry.landmarks;
  }
  return std::nullopt;
}

absl::StatusOr<std::shared_ptr<const Landmarks>> LandmarkCache::Build(const PlaceGraph& graph,
                                                                      const Key& key,
                                                                      const StopCheck& stop) {
  Limits limits;
  limits.radius_m = static_cast<double>(key.radius_class) * kRadiusClassM;
  // All instants of the past share one set.
  limits.any_time = !key.present;
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Landmarks> landmarks,
                       Landmarks::Build(graph, limits, stop));
  const std::lock_guard lock(mutex_);
  if (entries_.size() >= kSetCountMax) {
    entries_.erase(
        std::min_element(entries_.begin(), entries_.end(),
                         [](const Entry& a, const Entry& b) { return a.used < b.used; }));
  }
  entries_.push_back({key, landmarks, ++use_count_});
  return landmarks;
}

size_t LandmarkCache::memory_bytes() const {
  const std::lock_guard lock(mutex_);
  size_t bytes = sizeof(LandmarkCache);
  for (const Entry& entry : entries_) bytes += entry.landmarks->memory_bytes();
  return bytes;
}

namespace {

// So few goals are each bounded for themselves; more cost more than they save.
constexpr size_t kSingleGoalsMax = 4;

}  // namespace

Guide::Guide(const PlaceGraph& graph, const std::vector<Anchor>& goals, const Landmarks* landmarks)
    : graph_(graph), landmarks_(landmarks) {
  std::vector<const Anchor*> sorted;
  for (const Anchor& goal : goals) sorted.push_back(&goal);
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Anchor* a, const Anchor* b) {
    return ComponentOf(a->place) < ComponentOf(b->place);
  });
  for (const Anchor* goal : sorted) {
    const int32_t component = ComponentOf(goal->place);
    const bool is_new =
        goals.size() <= kSingleGoalsMax || groups_.empty() || groups_.back().component != component;
    if (is_new) {
      Group& group = groups_.emplace_back();
      group.component = component;
      group.way_m = goal->way_m;
      if (landmarks_ != nullptr) group.low = group.high = landmarks_->of(goal->place);
    }
    Extend(*goal, &groups_.back());
  }
}

void Guide::Extend(const Anchor& goal, Group* group) const {
  group->box.extend(graph_.position_map(goal.place));
  group->way_m = std::min(group->way_m, goal.way_m);
  if (landmarks_ == nullptr) return;
  const Landmarks::Distances& known = landmarks_->of(goal.place);
  for (size_t i = 0; i < known.size(); ++i) {
    group->low[i] = std::min(group->low[i], known[i]);
    group->high[i] = std::max(group->high[i], known[i]);
  }
}

bool Guide::MayReach(PlaceIndex place) const {
  if (landmarks_ == nullptr) return true;
  const int32_t component = landmarks_->component(place);
  return std::any_of(groups_.begin(), groups_.end(),
                     [&](const Group& group) { return group.component == component; });
}

double Guide::StraightFrom(PlaceIndex place, const Group& group) const {
  return group.box.exteriorDistance(graph_.position_map(place));
}

double Guide::AtLeast(PlaceIndex place) const {
  double nearest_m = std::numeric_limits<double>::infinity();
  if (landmarks_ == nullptr) {
    for (const Group& group : groups_) {
      nearest_m = std::min(nearest_m, StraightFrom(place, group) + group.way_m);
    }
    return nearest_m;
  }
  const int32_t component = landmarks_->component(place);
  const Landmarks::Distances& known = landmarks_->of(place);
  for (const Group& group : groups_) {
    if (group.component != component) continue;
    float bound_m = 0.0F;
    for (size_t i = 0; i < known.size(); ++i) {
      bound_m = std::max({bound_m, group.low[i] - known[i], known[i] - group.high[i]});
    }
    const double around_m = static_cast<double>(bound_m) - landmarks_->slack_m();
    nearest_m = std::min(nearest_m, std::max(around_m, StraightFrom(place, group)) + group.way_m);
  }
  return nearest_m;
}

}  // namespace dsg::query
