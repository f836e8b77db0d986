// SPDX-License-Identifier: Apache-2.0
// Walls, floors, ceilings and pillars, one for each flat piece.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ingest/rooms/room_options.h"
#include "ingest/trajectory/trajectory_change.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

/// Which class ids of a log are structures.
struct StructureClasses {
  /// Empty = the log has none. "wall", "glass" and "window" are walls; "floor", "ceiling", "pillar"
  /// (or "column"); ids of equal meaning in one list.
  std::vector<int32_t> wall;
  std::vector<int32_t> floor;
  std::vector<int32_t> ceiling;
  std::vector<int32_t> pillar;

  /// By name, letters' case ignored; names of several words count by their last one. Doors are no
  /// structures. Of several names of one id, most decide.
  static StructureClasses FromLabels(const std::vector<SemanticLabel>& labels);
  bool IsStructure(int32_t class_id) const;
};

struct StructurePiece {
  /// Stable over a run; -1 = not given yet.
  int64_t id = -1;
  /// "wall", "floor", "ceiling", "pillar".
  std::string type;
  int32_t class_id = -1;
  /// n.x + d = 0; points to where it was seen from. Zero for pillars.
  Eigen::Vector3d normal_map = Eigen::Vector3d::Zero();
  double offset_m = 0.0;
  Box3d box_map;
  double area_m2 = 0.0;
};

/// Flat pieces of the labelled mesh, by growing over neighbours of like normals; without ids.
/// Meshes without labels: floors, ceilings and walls by their normals and heights.
/// Order: the same mesh gives the same pieces in the same order.
/// Source: RSS 2020, section IV-B (structures); one node per planar segment is ours.
std::vector<StructurePiece> FindStructures(const std::vector<const MeshBlock*>& mesh,
                                           const StructureClasses& classes,
                                           const StructureOptions& options);

/// A height that horizontal pieces share, and how many square metres of them there are.
struct StructureHeight {
  double z_m = 0.0;
  double area_m2 = 0.0;
};

/// Heights of the ceilings or floors, those near each other in one; largest area first.
std::vector<StructureHeight> CeilingHeights(const std::vector<StructurePiece>& pieces,
                                            const StructureOptions& options);
std::vector<StructureHeight> FloorHeights(const std::vector<StructurePiece>& pieces,
                                          const StructureOptions& options);

/// Gives pieces the ids of the last ones that they continue.
class StructureTracker {
 public:
  explicit StructureTracker(const StructureOptions& options = {}) : options_(options) {}

  void Track(std::vector<StructurePiece>* pieces);

  /// The map has moved under the last pieces.
  void Move(const PointMove& move);

 private:
  StructureOptions options_;
  std::vector<StructurePiece> last_;
  int64_t next_id_ = 0;
};

}  // namespace dsg::ingest
