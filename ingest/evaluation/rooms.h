// SPDX-License-Identifier: Apache-2.0
// Whether places were gathered into the rooms that are there, and rooms joined where doors are.
// Refuses to ask for rooms that the robot hardly saw.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "ingest/evaluation/grid_map.h"
#include "schema/model/geometry.h"

namespace dsg::evaluation {

struct RoomPlace {
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  double clearance_m = 0.0;
  /// Index of the predicted room; -1 = none.
  int room = -1;
};

/// Indices of rooms.
using RoomPair = std::pair<int, int>;

struct TrueRooms {
  std::vector<Polygon2d> footprints_map;
  /// Joined by a door.
  std::vector<RoomPair> doors;
};

struct PredictedRooms {
  int count = 0;
  std::vector<RoomPlace> places;
  std::vector<RoomPair> adjacent;
};

struct RoomOptions {
  /// Share of a true room's free cells that must have been observed before it is asked for.
  double observed_min = 0.5;
};

/// Shares from 0 to 1.
struct PrecisionRecall {
  std::optional<double> precision;
  std::optional<double> recall;
};

struct RoomResult {
  /// For each true room, the predicted room P with the largest overlap in places:
  /// |P n G| / |P| and |P n G| / |G|; means over the true rooms. A true room none of whose places
  /// is in a predicted room has 0 of both. Source: Rosinol et al. 2020, section V-E.
  PrecisionRecall of_places;
  /// The same without the places in door bands.
  PrecisionRecall outside_doors;
  /// Floor cells instead of places: a predicted room is the union of its places' clearance discs,
  /// a true room its observed free cells. Precision: mean over predicted rooms of the largest
  /// overlap with a true one / own size; recall the other way round. Source: Hughes et al. 2022.
  PrecisionRecall volumetric;
  /// In places, each predicted room for one true room at most, largest total overlap; means over
  /// the predicted and over the true rooms. Split and merged rooms show here.
  PrecisionRecall one_to_one;
  std::optional<int64_t> count;
  int64_t count_truth = 0;
  /// Door edges of the truth against adjacency edges, rooms matched one to one.
  std::optional<double> adjacency_f1;
};

/// All but count_truth is empty when no room was predicted, adjacency_f1 when no edge was.
RoomResult EvaluateRooms(const PredictedRooms& predicted, const TrueRooms& truth,
                         const GridMap& map, const RoomOptions& options);

}  // namespace dsg::evaluation
