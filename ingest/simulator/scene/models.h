// SPDX-License-Identifier: Apache-2.0
// The tables behind FurnitureParts: which function draws which class, and what it draws with.
// Refuses callers outside of this folder.
#pragma once

#include <span>
#include <vector>

#include "ingest/simulator/scene/scene.h"
#include "ingest/simulator/scene/shapes.h"

namespace dsg::simulator {

/// A model in the making. Origin in the middle of the floor face, front along y, z up, metres.
class Model {
 public:
  Model(const Eigen::Vector3d& size, const Color& paint)
      : width(static_cast<float>(size.x())),
        depth(static_cast<float>(size.y())),
        height(static_cast<float>(size.z())),
        color(paint) {}

  /// What follows goes into a part of this look.
  void Use(Material material, const Color& paint);
  /// Box between two corners; edges cut by `cut`.
  void Box(const Eigen::Vector3f& min, const Eigen::Vector3f& max, float cut = 0.0f) {
    AddCutBox(min, max, cut, mesh());
  }
  /// Four legs from the floor to `top`, set in by `inset` from the sides.
  void Legs(float top, float thickness, float inset);
  void Cylinder(const Eigen::Vector3f& base, float radius, float rise, int side_count = 12) {
    AddCylinder(base, radius, rise, side_count, mesh());
  }
  TriangleMesh* mesh() { return &parts.back().mesh; }

  const float width;
  const float depth;
  const float height;
  /// Of the piece.
  const Color color;
  std::vector<ModelPart> parts;
};

/// The colour, lighter or darker.
Color Scaled(const Color& color, double factor);

inline constexpr Color kDark = {44, 46, 50, 255};
inline constexpr Color kSteel = {168, 172, 176, 255};
inline constexpr Color kWhite = {232, 232, 228, 255};

struct ModelMaker {
  const char* class_name;
  void (*draw)(Model* model);
};

std::span<const ModelMaker> SeatModels();
std::span<const ModelMaker> TableModels();
std::span<const ModelMaker> StorageModels();
std::span<const ModelMaker> BathModels();
std::span<const ModelMaker> ApplianceModels();
std::span<const ModelMaker> SmallModels();

}  // namespace dsg::simulator
