// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/errand_board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "ingest/simulator/body/life.h"

namespace dsg::simulator {
namespace {

constexpr std::array<std::string_view, 6> kTakenClasses = {"cup",    "bowl",   "book",
                                                           "laptop", "bottle", "phone"};
constexpr std::array<std::string_view, 7> kSurfaceClasses = {
    "table", "desk", "counter", "coffee table", "nightstand", "tv stand", "cabinet"};
constexpr double kObjectSizeMaxM = 0.4;
constexpr double kSurfaceHeightMaxM = 1.35;
constexpr int kStandTries = 80;
constexpr double kStandNearM = 0.3;
constexpr double kStandFarM = 0.95;
/// A stand is joined to a place not farther than this.
constexpr double kPlaceRangeM = 2.5;
constexpr int kNearestCount = 5;
constexpr int kTakeTries = 12;
constexpr int kSpotTries = 16;
constexpr double kEdgeM = 0.02;
constexpr double kSpotGapM = 0.03;

template <size_t N>
bool IsOneOf(std::string_view name, const std::array<std::string_view, N>& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

double TopOf(const Furniture& item) { return item.center.z() + 0.5 * item.size.z(); }

// Of a disk that holds the object however it is turned.
double RadiusOf(const Furniture& item) { return 0.5 * item.size.head<2>().norm(); }

void Shuffle(std::vector<int>* values, Random* random) {
  for (size_t i = values->size(); i > 1; --i) {
    std::swap((*values)[i - 1], (*values)[random->Index(static_cast<int>(i))]);
  }
}

}  // namespace

Pose3d InitialPose(const Furniture& item) {
  const double half_turn = 0.25 * std::numbers::pi * item.quarter_turns;
  return {item.center, Eigen::Quaterniond(std::cos(half_turn), 0.0, 0.0, std::sin(half_turn))};
}

ErrandBoard::ErrandBoard(const World* world)
    : world_(*world), room_places_(world->plan.rooms.size()) {
  for (size_t i = 0; i < world_.furniture.size(); ++i) {
    const Furniture& item = world_.furniture[i];
    const int index = static_cast<int>(i);
    if (item.on >= 0) taken_spots_.push_back({item.on, item.center.head<2>(), RadiusOf(item)});
    if (item.on >= 0 && item.size.maxCoeff() < kObjectSizeMaxM &&
        IsOneOf(item.class_name, kTakenClasses)) {
      objects_.push_back(index);
    }
    if (item.on < 0 && TopOf(item) < kSurfaceHeightMaxM &&
        IsOneOf(item.class_name, kSurfaceClasses)) {
      surfaces_.push_back(index);
    }
  }
  for (size_t i = 0; i < world_.places.places.size(); ++i) {
    room_places_[world_.places.places[i].room].push_back(static_cast<int>(i));
  }
}

std::optional<int> ErrandBoard::PlaceNear(const Point& position, int room) const {
  std::vector<std::pair<double, int>> near;
  for (const int place : room_places_[room]) {
    const double distance = (world_.places.places[place].position - position).norm();
    if (distance < kPlaceRangeM) near.push_back({distance, place});
  }
  std::sort(near.begin(), near.end());
  for (const auto& [distance, place] : near) {
    const Point& at = world_.places.places[place].position;
    if (world_.free_space.SegmentKeepsClear(at, position, kWalkClearanceM)) return place;
  }
  return std::nullopt;
}

std::optional<ReachStand> ErrandBoard::FindStand(const BodyModel& body, Side side,
                                                 const Eigen::Vector3d& target_map, int room,
                                                 Random* random) const {
  std::optional<ReachStand> best;
  for (int i = 0; i < kStandTries; ++i) {
    const double angle = random->Uniform(-std::numbers::pi, std::numbers::pi);
    const double distance = random->Uniform(kStandNearM, kStandFarM);
    const Point at = target_map.head<2>() + distance * Point(std::cos(angle), std::sin(angle));
    if (!world_.plan.rooms[room].Interior().contains(at)) continue;
    const double yaw = std::remainder(angle + std::numbers::pi, 2.0 * std::numbers::pi);
    const Eigen::Vector3d target_torso = StandingTorso(body, at, yaw).Inverse() * target_map;
    const std::optional<ReachPlan> reach = FindReach(body, side, target_torso);
    if (!reach.has_value()) continue;
    if (best.has_value() && best->reach.Effort() <= reach->Effort()) continue;
    // With a margin, so that walks may end here.
    if (world_.free_space.Clearance(at) < kWalkClearanceM + 0.01) continue;
    const std::optional<int> place = PlaceNear(at, room);
    if (place.has_value()) best = ReachStand{{*place, at}, yaw, *reach, target_map};
  }
  return best;
}

std::optional<ObjectChoice> ErrandBoard::TakeFirst(const BodyModel& body, Side side,
                                                   const std::vector<int>& order, Random* random) {
  for (const int object : order) {
    const Furniture& item = world_.furniture[object];
    const std::optional<ReachStand> stand = FindStand(body, side, item.center, item.room, random);
    if (!stand.has_value()) continue;
    objects_.erase(std::find(objects_.begin(), objects_.end(), object));
    return ObjectChoice{object, *stand};
  }
  return std::nullopt;
}

std::optional<ObjectChoice> ErrandBoard::TakeObject(const BodyModel& body, Side side,
                                                    const Point& from, Random* random) {
  std::vector<std::pair<double, int>> by_distance;
  for (const int object : objects_) {
    by_distance.push_back({(world_.furniture[object].center.head<2>() - from).norm(), object});
  }
  std::sort(by_distance.begin(), by_distance.end());
  std::vector<int> order;
  for (const auto& [distance, object] : by_distance) {
    if (order.size() < kTakeTries) order.push_back(object);
  }
  std::vector<int> nearest(
      order.begin(), order.begin() + std::min<std::ptrdiff_t>(kNearestCount, std::ssize(order)));
  Shuffle(&nearest, random);
  std::copy(nearest.begin(), nearest.end(), order.begin());
  return TakeFirst(body, side, order, random);
}

std::optional<ObjectChoice> ErrandBoard::TakeAnyObject(const BodyModel& body, Side side,
                                                       Random* random) {
  std::vector<int> order = objects_;
  Shuffle(&order, random);
  if (order.size() > kTakeTries) order.resize(kTakeTries);
  return TakeFirst(body, side, order, random);
}

void ErrandBoard::GiveBack(int object) {
  objects_.insert(std::lower_bound(objects_.begin(), objects_.end(), object), object);
}

std::optional<Point> ErrandBoard::FreeSpot(int surface, double radius_m, Random* random) const {
  const Rect inner = Inflate(world_.furniture[surface].Footprint(), -radius_m - kEdgeM);
  const Point size = inner.sizes();
  if (size.minCoeff() <= 0.0) return std::nullopt;
  const Point spot =
      inner.min() + Point(random->Uniform() * size.x(), random->Uniform() * size.y());
  for (const TakenSpot& taken : taken_spots_) {
    if (taken.surface == surface &&
        (taken.center - spot).norm() < taken.radius_m + radius_m + kSpotGapM) {
      return std::nullopt;
    }
  }
  return spot;
}

std::optional<ReachStand> ErrandBoard::ReserveSpot(const BodyModel& body, Side side, int object,
                                                   const Point& from, double range_m,
                                                   Random* random) {
  std::vector<int> order;
  for (const int surface : surfaces_) {
    const double distance = (world_.furniture[surface].center.head<2>() - from).norm();
    if (distance <= range_m && surface != world_.furniture[object].on) order.push_back(surface);
  }
  Shuffle(&order, random);
  // The nearer half of the range first, so that people do not only carry things far away.
  std::stable_partition(order.begin(), order.end(), [&](int surface) {
    return (world_.furniture[surface].center.head<2>() - from).norm() <= 0.5 * range_m;
  });
  if (order.size() > kTakeTries) order.resize(kTakeTries);
  const double radius_m = RadiusOf(world_.furniture[object]);
  for (const int surface : order) {
    const Furniture& top = world_.furniture[surface];
    for (int i = 0; i < kSpotTries; ++i) {
      const std::optional<Point> spot = FreeSpot(surface, radius_m, random);
      if (!spot.has_value()) continue;
      const double z = TopOf(top) + 0.5 * world_.furniture[object].size.z();
      const std::optional<ReachStand> stand =
          FindStand(body, side, {spot->x(), spot->y(), z}, top.room, random);
      if (!stand.has_value()) continue;
      taken_spots_.push_back({surface, *spot, radius_m});
      return stand;
    }
  }
  return std::nullopt;
}

}  // namespace dsg::simulator
