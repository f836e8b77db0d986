// SPDX-License-Identifier: Apache-2.0
// Which small objects may still be taken, where they may be put down, and where a body has to
// stand for it. Refuses to say when: people ask in turn, and what is handed out is gone.
#pragma once

#include <optional>
#include <vector>

#include "ingest/simulator/body/reach.h"
#include "ingest/simulator/world/planner.h"
#include "ingest/simulator/world/world.h"
#include "schema/base/random.h"

namespace dsg::simulator {

/// From here a body can touch the target.
struct ReachStand {
  Goal goal;
  /// Facing the target, map frame.
  double yaw = 0.0;
  ReachPlan reach;
  Eigen::Vector3d target_map = Eigen::Vector3d::Zero();
};

struct ObjectChoice {
  /// Index in World::furniture.
  int object = 0;
  ReachStand stand;
};

/// Where furniture stands before anybody touches it; centre of its box, front along y.
Pose3d InitialPose(const Furniture& item);

/// Threads: one caller at a time.
class ErrandBoard {
 public:
  /// `world` must outlive the board.
  explicit ErrandBoard(const World* world);

  bool HasObjects() const { return !objects_.empty(); }
  /// One of the nearest objects that the hand can take; it is nobody else's from now on.
  std::optional<ObjectChoice> TakeObject(const BodyModel& body, Side side, const Point& from,
                                         Random* random);
  /// Any object that the hand can take.
  std::optional<ObjectChoice> TakeAnyObject(const BodyModel& body, Side side, Random* random);
  void GiveBack(int object);
  /// A free spot on a piece of furniture no farther than `range_m`, preferring the nearer half.
  /// The spot stays reserved. The stand's target is the middle of the object there.
  std::optional<ReachStand> ReserveSpot(const BodyModel& body, Side side, int object,
                                        const Point& from, double range_m, Random* random);

 private:
  /// An object lies or will lie there.
  struct TakenSpot {
    int surface = 0;
    Point center = Point::Zero();
    double radius_m = 0.0;
  };

  std::optional<ReachStand> FindStand(const BodyModel& body, Side side,
                                      const Eigen::Vector3d& target_map, int room,
                                      Random* random) const;
  std::optional<int> PlaceNear(const Point& position, int room) const;
  std::optional<Point> FreeSpot(int surface, double radius_m, Random* random) const;
  std::optional<ObjectChoice> TakeFirst(const BodyModel& body, Side side,
                                        const std::vector<int>& order, Random* random);

  const World& world_;
  /// Not yet taken, ascending.
  std::vector<int> objects_;
  std::vector<int> surfaces_;
  std::vector<TakenSpot> taken_spots_;
  std::vector<std::vector<int>> room_places_;
};

}  // namespace dsg::simulator
