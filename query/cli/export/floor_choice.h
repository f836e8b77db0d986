// SPDX-License-Identifier: Apache-2.0
// Which part of a map lies on one floor.
// Refuses to guess a floor that the map does not have.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "query/cli/export/map_content.h"
#include "query/cli/export/overlay.h"

namespace dsg::cli {

/// Heights in the map frame, metres; both ends belong to it.
struct HeightRange {
  double low_m = 0.0;
  double high_m = 0.0;
  bool Contains(double z_m) const { return low_m <= z_m && z_m <= high_m; }
};

/// `floor` is a node's id or name (a level, a room, a building): its own heights. Or a height in
/// metres: the heights of the rooms that hold it, or 1.5 m around it where there is no room.
/// Errors: NOT_FOUND/NODE_UNKNOWN naming what may be given.
absl::StatusOr<HeightRange> ChooseFloor(const MapContent& content, const std::string& floor);

/// Drops nodes whose middle is elsewhere, edges that lost an end, poses and faces elsewhere. Poses
/// up to 0.3 m below the floor stay: tracks lie on it, with their errors.
void KeepFloor(const HeightRange& floor, MapContent* content);

/// The same for what an answer adds; ways are cut where they leave the floor.
void KeepFloor(const HeightRange& floor, Overlay* overlay);

}  // namespace dsg::cli
