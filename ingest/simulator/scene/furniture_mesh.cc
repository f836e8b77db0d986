// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "ingest/simulator/scene/models.h"
#include "ingest/simulator/scene/scene.h"
#include "ingest/simulator/scene/shapes.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector3f;

const ModelMaker* FindMaker(const std::string& class_name) {
  for (const std::span<const ModelMaker> makers :
       {SeatModels(), TableModels(), StorageModels(), BathModels(), ApplianceModels(),
        SmallModels()}) {
    for (const ModelMaker& maker : makers) {
      if (class_name == maker.class_name) return &maker;
    }
  }
  return nullptr;
}

void DrawUnknown(Model* m) {
  m->Use(Material::kPlastic, m->color);
  const float cut = 0.06f * std::min({m->width, m->depth, m->height});
  m->Box({-0.5f * m->width, -0.5f * m->depth, 0.0f}, {0.5f * m->width, 0.5f * m->depth, m->height},
         cut);
}

// Stretches a model a little so that it touches all faces of its box, and moves its middle to the
// origin.
void FillBox(const Vector3f& size, std::vector<ModelPart>* parts) {
  Eigen::AlignedBox3f bounds;
  for (const ModelPart& part : *parts) bounds.extend(BoundsOf(part.mesh));
  const Vector3f scale = size.cwiseQuotient(bounds.sizes().cwiseMax(1e-6f));
  const Vector3f half = 0.5f * size;
  for (ModelPart& part : *parts) {
    for (Vector3f& vertex : part.mesh.vertices) {
      const Vector3f at = (vertex - bounds.center()).cwiseProduct(scale);
      vertex = at.cwiseMax(-half).cwiseMin(half);
    }
  }
}

}  // namespace

void TriangleMesh::Append(const TriangleMesh& other) {
  const uint32_t first = static_cast<uint32_t>(vertices.size());
  vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const std::array<uint32_t, 3>& face : other.faces) {
    faces.push_back({first + face[0], first + face[1], first + face[2]});
  }
}

Color Scaled(const Color& color, double factor) {
  Color scaled = color;
  for (int i = 0; i < 3; ++i) {
    scaled[i] = static_cast<uint8_t>(std::clamp(std::lround(color[i] * factor), 0l, 255l));
  }
  return scaled;
}

void Model::Use(Material material, const Color& paint) {
  const auto found = std::find_if(parts.begin(), parts.end(), [&](const ModelPart& part) {
    return part.material == material && part.color == paint;
  });
  if (found == parts.end()) {
    parts.push_back({{}, material, paint});
  } else {
    std::rotate(found, found + 1, parts.end());
  }
}

void Model::Legs(float top, float thickness, float inset) {
  const float x = 0.5f * width - inset;
  const float y = 0.5f * depth - inset;
  for (const float side : {-1.0f, 1.0f}) {
    for (const float end : {-1.0f, 1.0f}) {
      const Vector3f a(side * x, end * y, 0.0f);
      const Vector3f b(side * (x - thickness), end * (y - thickness), top);
      Box(a.cwiseMin(b), a.cwiseMax(b));
    }
  }
}

std::vector<ModelPart> FurnitureParts(const std::string& class_name, const Eigen::Vector3d& size,
                                      const Color& color) {
  Model model(size, color);
  const ModelMaker* maker = FindMaker(class_name);
  if (maker != nullptr) {
    maker->draw(&model);
  } else {
    DrawUnknown(&model);
  }
  FillBox(size.cast<float>(), &model.parts);
  return std::move(model.parts);
}

TriangleMesh FurnitureMesh(const std::string& class_name, const Eigen::Vector3d& size) {
  TriangleMesh mesh;
  for (const ModelPart& part : FurnitureParts(class_name, size, {128, 128, 128, 255})) {
    mesh.Append(part.mesh);
  }
  return mesh;
}

TriangleMesh CadModel(const std::string& class_name, const Eigen::Vector3d& size) {
  TriangleMesh mesh = FurnitureMesh(class_name, size);
  Transform(Eigen::Affine3f(Eigen::Translation3f(0.0f, 0.0f, static_cast<float>(0.5 * size.z()))),
            &mesh);
  return mesh;
}

Pose3d FurniturePose(const Furniture& item) {
  // Exact quarter turns: half-angle sines of 0, 45, 90 and 135 degrees.
  const double half = std::sqrt(0.5);
  constexpr double kZero = 0.0;
  const double cosines[4] = {1.0, half, kZero, -half};
  const double sines[4] = {kZero, half, 1.0, half};
  const int turns = item.quarter_turns % 4;
  return {item.center, Eigen::Quaterniond(cosines[turns], 0.0, 0.0, sines[turns])};
}

}  // namespace dsg::simulator
