// SPDX-License-Identifier: Apache-2.0
// Divides the places of a storey into rooms.
// Refuses to read labels: the shape of free space decides.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ingest/grid/distance_field.h"
#include "ingest/rooms/room_options.h"
#include "ingest/trajectory/trajectory_change.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A place as rooms need it; links carry the clearance of the straight way.
struct RoomPlace {
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  double clearance_m = 0.0;
};
struct RoomLink {
  int from = 0;
  int to = 0;
  double clearance_m = 0.0;
};

/// One storey of the map.
struct RoomInput {
  const DistanceField* field = nullptr;
  std::vector<RoomPlace> places;
  std::vector<RoomLink> links;
  double floor_z_m = 0.0;
  /// nullopt = no ceiling was seen.
  std::optional<double> ceiling_z_m;
};

struct FoundRoom {
  /// Stable over a run (RoomTracker); -1 = not given yet.
  int64_t id = -1;
  /// Indices of places, ascending.
  std::vector<int> places;
  /// Outline of its free floor, grown to the walls.
  Polygon2d footprint_map;
  double z_min_m = 0.0;
  double z_max_m = 0.0;
  double area_m2 = 0.0;
};

struct RoomLabelling {
  RoomMethod method = RoomMethod::kCeiling;
  std::vector<FoundRoom> rooms;
  /// For each place its room in `rooms`; -1 = none.
  std::vector<int> room_of_place;
  /// Pairs of rooms with a place link between them, low index first, ascending.
  std::vector<std::pair<int, int>> adjacent;
};

struct RoomResult {
  RoomLabelling best;
  /// The other method's word, when it differs on more than RoomOptions::other_word_min of the
  /// places.
  std::optional<RoomLabelling> alternative;
};

/// Order: the same input gives the same rooms in the same order.
RoomResult FindRooms(const RoomInput& input, const RoomOptions& options);

/// Keeps the ids of rooms while the map grows: a room goes on as the one that it shares most
/// places (by position) with.
class RoomTracker {
 public:
  explicit RoomTracker(double same_place_m = RoomOptions().same_place_m)
      : same_place_m_(same_place_m) {}

  /// `places`: of the input that the rooms are of.
  void Track(const std::vector<RoomPlace>& places, std::vector<FoundRoom>* rooms);

  /// The map has moved under the last rooms.
  void Move(const PointMove& move);

 private:
  struct Old {
    int64_t id;
    std::vector<Eigen::Vector3d> places_map;
  };
  double same_place_m_;
  std::vector<Old> last_;
  int64_t next_id_ = 0;
};

}  // namespace dsg::ingest
