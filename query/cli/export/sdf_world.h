// SPDX-License-Identifier: Apache-2.0
// A map as a world of a physics simulator: SDFormat 1.9, and a mesh of what stands still.
#pragma once

#include <cstddef>
#include <string>

#include "query/cli/export/map_content.h"

namespace dsg::cli {

struct SdfOptions {
  /// Objects whose longest edge is at most this move, metres; larger ones are fixed.
  double movable_size_m = 0.5;
  /// Of the boxes of objects and the capsules of robots; they are mostly air.
  double density_kg_m3 = 200.0;
  /// How the world names the mesh file: relative to its own folder.
  std::string mesh_uri;
  /// Agents stand where they are in the content; false = none.
  bool with_agents = false;
};

/// An SDFormat world and the file that it refers to.
struct SdfWorld {
  std::string xml;
  /// Binary STL, frame of the map; empty if the map has no mesh.
  std::string stl;
  size_t floor_count = 0;
  /// Boxes of walls and pillars; 0 if there is a mesh.
  size_t wall_count = 0;
  size_t face_count = 0;
  size_t object_count = 0;
  size_t movable_count = 0;
  size_t agent_count = 0;
};

/// Metres, kilograms, z up; the frame of the map. The model "building" is fixed: slabs below the
/// rooms, and the mesh without what is inside objects, or without a mesh the boxes of structures
/// but ceilings. A model per object with a box, named by id and class, and per agent: an upright
/// capsule around its box, kinematic and without gravity.
SdfWorld MakeSdf(const MapContent& content, const SdfOptions& options);

}  // namespace dsg::cli
