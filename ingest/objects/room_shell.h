// SPDX-License-Identifier: Apache-2.0
// Which cells of a surface without labels are floor, ceiling and walls.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/objects/cell_graph.h"
#include "ingest/objects/segment_options.h"

namespace dsg::ingest {

enum class ShellPart : uint8_t { kNone, kFloor, kCeiling, kWall };

struct ShellWall {
  /// Level and unit, towards the room.
  Eigen::Vector3d normal_map = Eigen::Vector3d::UnitX();
  /// normal . x + offset_m = 0.
  double offset_m = 0.0;
  /// Extent along the wall: of up x normal . x.
  double begin_m = 0.0;
  double end_m = 0.0;
  double low_m = 0.0;
  double top_m = 0.0;
  double area_m2 = 0.0;

  Eigen::Vector3d Along() const { return Eigen::Vector3d::UnitZ().cross(normal_map); }
  /// Before the wall, metres; negative behind it.
  double DistanceTo(const Eigen::Vector3d& point_map) const {
    return normal_map.dot(point_map) + offset_m;
  }
  bool IsBeside(const Eigen::Vector3d& point_map, double slack_m) const {
    const double along_m = Along().dot(point_map);
    return along_m >= begin_m - slack_m && along_m <= end_m + slack_m;
  }
};

struct RoomShell {
  /// By cell.
  std::vector<ShellPart> parts;
  /// By cell: height above the floor below it, metres; above the lowest cell without a floor.
  std::vector<float> heights_m;
  /// By cell: depth below the ceiling above it, or below a ceiling of the usual height, metres;
  /// infinite where no ceiling is seen at all.
  std::vector<float> depths_m;
  /// Ascending.
  std::vector<double> floors_m;
  std::vector<ShellWall> walls;
};

/// `floors_m`: heights of the floors, where known; otherwise they are found.
RoomShell FindRoomShell(const CellGraph& graph, const std::vector<double>& floors_m,
                        const SegmentOptions& options);

}  // namespace dsg::ingest
