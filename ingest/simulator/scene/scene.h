// SPDX-License-Identifier: Apache-2.0
// The world as triangles: what a camera can see and a mesh can be compared with.
// Refuses to hold anything that moves; people and carried objects come with each frame.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ingest/simulator/world/world.h"
#include "schema/model/geometry.h"
#include "schema/model/node.h"

namespace dsg::simulator {

/// What a surface looks like; the textures are procedural (texture.h).
enum class Material {
  kPlaster,
  kTiles,
  kCarpet,
  kWood,
  kFabric,
  kMetal,
  kPlastic,
  /// Printed: blocks of colour and lines of text.
  kPaper,
  /// Spines of books side by side.
  kBooks,
  kLeaves,
  kSkin,
  /// Seen through: depth and labels are those of what is behind.
  kGlass,
  /// A wall without anything to track.
  kBlank,
};

/// Triangles of one thing; counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> faces;

  void Append(const TriangleMesh& other);
};

/// One thing of one look and one identity. A thing of several looks has several parts of the same
/// class and instance.
struct Part {
  TriangleMesh mesh;
  Material material = Material::kPlaster;
  Color color = {128, 128, 128, 255};
  /// Of Labels().
  int class_id = 0;
  /// 1 to 255 within the class; 0 for structures, which are not counted.
  int instance = 0;
  /// Seed of its texture, so that two walls differ.
  uint32_t texture_seed = 0;
  /// Index of the room whose lamps light it; -1 = of even light.
  int room = -1;
  /// Shines by itself, on top of what the lamps give; 0 = not at all.
  float emission = 0.0f;
};

/// The lamps of a room. Light does not pass through walls.
struct RoomLight {
  /// Between the walls.
  Rect interior;
  float ceiling_m = 2.5f;
  /// Light from everywhere; less in dark rooms.
  float ambient = 0.5f;
  /// Of each lamp, at one metre straight below it.
  float strength = 1.0f;
  /// Middles of the lamps, map frame.
  std::vector<Eigen::Vector3f> lamps_map;
};

struct Scene {
  /// Map frame. Faces are counted through all parts in this order.
  std::vector<Part> parts;
  /// By room.
  std::vector<RoomLight> lights;

  int FaceCount() const;
};

/// A piece of a model that looks the same all over.
struct ModelPart {
  TriangleMesh mesh;
  Material material = Material::kPlastic;
  Color color = {128, 128, 128, 255};
};

/// Index within its class of each piece of furniture, 1 to 255: the label image's instances.
/// Counts from 1 again after 255 of one class.
std::vector<int> FurnitureInstances(const World& world);

/// The model of a piece in its own frame: centre of its box at the origin, front along y, scaled
/// to fill its size. Couches of one size share one model (the catalogue's CAD model). A class that
/// is not known gets a box with cut edges.
std::vector<ModelPart> FurnitureParts(const std::string& class_name, const Eigen::Vector3d& size,
                                      const Color& color);
/// The same as one mesh.
TriangleMesh FurnitureMesh(const std::string& class_name, const Eigen::Vector3d& size);
/// The same, z up with the origin in the middle of the floor face, as CAD catalogues have it.
TriangleMesh CadModel(const std::string& class_name, const Eigen::Vector3d& size);
Pose3d FurniturePose(const Furniture& item);

/// Walls with thickness, floors, ceilings, glass, pillars, door frames, and all furniture apart
/// from the pieces whose index is in `movable` (carried by people, drawn with each frame).
/// One wall in fourteen is blank; where there are two corridors or more, one is dark.
Scene BuildScene(const World& world, const std::vector<int>& movable);

/// Class << 8 | instance, the value of a label image.
inline uint16_t LabelValue(int class_id, int instance) {
  return static_cast<uint16_t>((class_id << 8) | instance);
}

}  // namespace dsg::simulator
