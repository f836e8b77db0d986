// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/storey_links.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <span>
#include <utility>

namespace dsg::ingest {
namespace {

using Points = std::vector<Eigen::Vector3d>;

/// A way leaves the line between two of its places by no more, metres: half of a narrow stair.
constexpr double kOffLineM = 0.2;
/// Between two places of a way, metres.
constexpr double kStepM = 2.0;
/// Two ways between the same floors whose middles are nearer are one, metres.
constexpr double kSameWayM = 1.0;
/// How far before a way the place is sought where it begins, metres of the path.
constexpr double kLeadM = 4.0;

double AlongFloor(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).head<2>().norm();
}

// How high the body is above the floor that it is on, mostly.
double BodyHeight(const Points& path_map, const std::vector<double>& floors_m) {
  std::vector<double> heights_m;
  for (const Eigen::Vector3d& point : path_map) {
    const auto above = std::upper_bound(floors_m.begin(), floors_m.end(), point.z());
    if (above != floors_m.begin()) heights_m.push_back(point.z() - *std::prev(above));
  }
  if (heights_m.empty()) return 0.0;
  const auto middle = heights_m.begin() + static_cast<std::ptrdiff_t>(heights_m.size() / 2);
  std::nth_element(heights_m.begin(), middle, heights_m.end());
  return *middle;
}

/// A part of the path from one floor to another, at the height of its feet.
struct Way {
  int from_floor = 0;
  int to_floor = 0;
  /// Of the first point on the way and the last; both are on their floors.
  size_t begin = 0;
  size_t end = 0;
};

class Walk {
 public:
  Walk(const Points& path_map, const std::vector<double>& floors_m, const PlaceOptions& options)
      : floors_m_(floors_m), options_(options), feet_map_(path_map) {
    const double body_m = BodyHeight(path_map, floors_m);
    for (Eigen::Vector3d& point : feet_map_) point.z() -= body_m;
  }

  const Points& feet_map() const { return feet_map_; }

  /// -1 = between floors.
  int FloorOf(size_t i) const {
    for (size_t floor = 0; floor < floors_m_.size(); ++floor) {
      if (std::abs(feet_map_[i].z() - floors_m_[floor]) <= options_.landing_m) {
        return static_cast<int>(floor);
      }
    }
    return -1;
  }

  std::vector<Way> Ways() const {
    std::vector<Way> ways;
    // Where the last floor was left; -1 = not known.
    int last_floor = -1;
    size_t left = 0;
    for (size_t i = 0; i < feet_map_.size(); ++i) {
      if (i > 0 && IsJump(i)) last_floor = -1;
      const int floor = FloorOf(i);
      if (floor < 0) continue;
      if (last_floor >= 0 && last_floor != floor) ways.push_back({last_floor, floor, left, i});
      last_floor = floor;
      left = i;
    }
    return ways;
  }

  PlaceKind KindOf(const Way& way) const {
    double run_m = 0.0;
    for (size_t i = way.begin; i < way.end; ++i) {
      run_m += AlongFloor(feet_map_[i], feet_map_[i + 1]);
    }
    const double rise_m = std::abs(feet_map_[way.end].z() - feet_map_[way.begin].z());
    if (run_m <= options_.lift_run_m) return PlaceKind::kLift;
    return rise_m <= options_.ramp_slope * run_m ? PlaceKind::kRamp : PlaceKind::kStairs;
  }

 private:
  // Straight up is no jump: poses in a lift are rare.
  bool IsJump(size_t i) const {
    return AlongFloor(feet_map_[i - 1], feet_map_[i]) > options_.path_reach_m;
  }

  const std::vector<double>& floors_m_;
  const PlaceOptions& options_;
  Points feet_map_;
};

double OffLine(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
               const Eigen::Vector3d& to) {
  const Eigen::Vector3d along = to - from;
  const double length_m2 = along.squaredNorm();
  const double share =
      length_m2 > 0.0 ? std::clamp((point - from).dot(along) / length_m2, 0.0, 1.0) : 0.0;
  return (point - from - share * along).norm();
}

// The first and last point, and those between that a chain of straight lines needs.
Points Simplified(std::span<const Eigen::Vector3d> way_map) {
  Points kept = {way_map.front()};
  size_t begin = 0;
  while (begin + 1 < way_map.size()) {
    size_t end = begin + 1;
    for (size_t next = end + 1; next < way_map.size(); ++next) {
      if ((way_map[next] - way_map[begin]).norm() > kStepM) break;
      bool is_straight = true;
      for (size_t i = begin + 1; i < next; ++i) {
        is_straight &= OffLine(way_map[i], way_map[begin], way_map[next]) <= kOffLineM;
      }
      if (!is_straight) break;
      end = next;
    }
    kept.push_back(way_map[end]);
    begin = end;
  }
  return kept;
}

/// Where a way meets a floor: a place there, and how far from the way's end along the path.
struct Landing {
  int place = -1;
  size_t at = 0;
};

class Linker {
 public:
  Linker(const Walk& walk, const std::vector<double>& floors_m, const PlaceOptions& options,
         PlaceGraph* graph)
      : walk_(walk),
        floors_m_(floors_m),
        options_(options),
        graph_(*graph),
        known_count_(graph->places.size()) {}

  void Add(const Way& way) {
    const Points& feet_map = walk_.feet_map();
    const Eigen::Vector3d& middle_map = feet_map[way.begin + (way.end - way.begin) / 2];
    if (IsKnown(way, middle_map)) return;
    const std::optional<Landing> first = LandingOf(way.from_floor, way.begin, -1);
    const std::optional<Landing> last = LandingOf(way.to_floor, way.end, 1);
    if (!first.has_value() || !last.has_value()) return;
    middles_.emplace_back(std::minmax(way.from_floor, way.to_floor), middle_map);
    const std::span<const Eigen::Vector3d> way_map(&feet_map[first->at], last->at - first->at + 1);
    const PlaceKind kind = walk_.KindOf(way);
    int before = first->place;
    for (const Eigen::Vector3d& point_map : Simplified(way_map)) {
      const int place = AddPlace(point_map, kind, way);
      AddLink(before, place);
      before = place;
    }
    AddLink(before, last->place);
  }

 private:
  bool IsKnown(const Way& way, const Eigen::Vector3d& middle_map) const {
    const std::pair<int, int> floors = std::minmax(way.from_floor, way.to_floor);
    return std::any_of(middles_.begin(), middles_.end(), [&](const auto& known) {
      return known.first == floors && (known.second - middle_map).norm() <= kSameWayM;
    });
  }

  // Where the path comes nearest to a place, a little before a way begins or after it ends.
  std::optional<Landing> LandingOf(int floor, size_t from, int direction) const {
    const Points& feet_map = walk_.feet_map();
    std::optional<Landing> best;
    double least_m = options_.reach_m;
    double gone_m = 0.0;
    for (size_t i = from; gone_m <= kLeadM && walk_.FloorOf(i) == floor;) {
      const int place = NearestPlace(floor, feet_map[i], &least_m);
      if (place >= 0) best = Landing{place, i};
      if (least_m <= options_.near_reach_m) break;
      if (direction < 0 ? i == 0 : i + 1 == feet_map.size()) break;
      const size_t next = direction < 0 ? i - 1 : i + 1;
      gone_m += AlongFloor(feet_map[i], feet_map[next]);
      i = next;
    }
    return best;
  }

  // -1 = none nearer than `*least_m`, which becomes its distance.
  int NearestPlace(int floor, const Eigen::Vector3d& point_map, double* least_m) const {
    int nearest = -1;
    for (size_t i = 0; i < known_count_; ++i) {
      const Place& place = graph_.places[i];
      if (place.floor_z_m != floors_m_[static_cast<size_t>(floor)]) continue;
      const double distance_m = AlongFloor(place.position_map, point_map);
      if (distance_m >= *least_m) continue;
      *least_m = distance_m;
      nearest = static_cast<int>(i);
    }
    return nearest;
  }

  int AddPlace(const Eigen::Vector3d& point_map, PlaceKind kind, const Way& way) {
    const double from_m = floors_m_[static_cast<size_t>(way.from_floor)];
    const double to_m = floors_m_[static_cast<size_t>(way.to_floor)];
    const bool is_low = point_map.z() < 0.5 * (from_m + to_m);
    Place place;
    place.position_map = point_map;
    place.clearance_m = options_.robot_radius_m;
    place.floor_z_m = is_low ? std::min(from_m, to_m) : std::max(from_m, to_m);
    place.kind = kind;
    graph_.places.push_back(place);
    return static_cast<int>(graph_.places.size()) - 1;
  }

  void AddLink(int a, int b) {
    graph_.links.push_back({std::min(a, b), std::max(a, b), options_.robot_radius_m});
  }

  const Walk& walk_;
  const std::vector<double>& floors_m_;
  const PlaceOptions& options_;
  PlaceGraph& graph_;
  /// Places of floors; those of ways come after.
  const size_t known_count_;
  /// Floors and middle of each way that was added.
  std::vector<std::pair<std::pair<int, int>, Eigen::Vector3d>> middles_;
};

}  // namespace

void LinkStoreys(const std::vector<Eigen::Vector3d>& path_map, const std::vector<double>& floors_m,
                 const PlaceOptions& options, PlaceGraph* graph) {
  if (floors_m.size() < 2 || path_map.empty()) return;
  const Walk walk(path_map, floors_m, options);
  Linker linker(walk, floors_m, options, graph);
  for (const Way& way : walk.Ways()) linker.Add(way);
  std::sort(graph->links.begin(), graph->links.end(), [](const PlaceLink& a, const PlaceLink& b) {
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  });
}

}  // namespace dsg::ingest
