// SPDX-License-Identifier: Apache-2.0
// How a sensor log is turned into the static layers of a map.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "ingest/depth/frame_maker.h"
#include "ingest/objects/object_options.h"
#include "ingest/objects/segment_options.h"
#include "ingest/objects/shapes/cad_model.h"
#include "ingest/objects/shapes/shape_fit.h"
#include "ingest/pipeline/layers_options.h"
#include "ingest/places/extract_places.h"
#include "ingest/rooms/find_rooms.h"
#include "ingest/volume/semantic_volume.h"

namespace dsg::ingest {

struct MappingOptions {
  /// False: poses only, as if the log had no images.
  bool is_on = true;
  /// A log that loop closures have corrected is fused once more from its begin at the end, along
  /// the path as it is then (IngestOptions::open_again).
  bool fuses_again = true;
  VolumeOptions volume;
  DepthOptions depth;
  PlaceOptions places;
  /// Walls, floors, ceilings and pillars.
  StructureOptions structures;
  RoomOptions rooms;
  ObjectOptions objects;
  /// Of logs without labels.
  SegmentOptions segments;
  LayersOptions layers;
  ShapeOptions shapes;
  /// Known shapes; empty = all shapes are unknown.
  std::vector<CadModel> catalogue;
  /// Log time between two commits of poses and mesh.
  TimeNs commit_period_ns = kNsPerSecond;
  /// Log time that a change of the mesh may wait for its commit (MeshTold): each version of a block
  /// stays in the history.
  TimeNs mesh_wait_max_ns = 32 * kNsPerSecond;
  /// Least log time between two updates of objects, places, structures and rooms. A large map is
  /// updated less often, by its size.
  TimeNs layers_period_ns = 5 * kNsPerSecond;
  /// Cells of the grid that places and rooms are found in; the voxel if that is larger.
  double grid_cell_m = 0.1;

  /// The numbers of all stages, for flags; without the few above, which most users set.
  std::vector<OptionGroup> Groups();

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming field, value and bounds.
  absl::Status Validate() const;

  /// All that deltas depend on, as text; threads are left out, and `fuses_again`, which concerns
  /// logs with loop closures only.
  std::string Digest(bool has_labels) const;
};

}  // namespace dsg::ingest
