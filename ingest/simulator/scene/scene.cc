// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/scene.h"

#include <algorithm>
#include <map>

#include "ingest/simulator/scene/building.h"
#include "ingest/simulator/scene/shapes.h"
#include "ingest/simulator/scene/texture.h"

namespace dsg::simulator {
namespace {

/// Of the triangles of furniture.
constexpr float kFurnitureEdgeM = 1.0f;
constexpr int kInstanceMax = 255;

void AddFurniture(const Furniture& item, int index, int instance, Scene* scene) {
  const Pose3d map_T_item = FurniturePose(item);
  Eigen::Affine3f transform = Eigen::Affine3f::Identity();
  transform.linear() = map_T_item.orientation.toRotationMatrix().cast<float>();
  transform.translation() = map_T_item.position.cast<float>();
  uint32_t look = 0;
  for (ModelPart& model : FurnitureParts(item.class_name, item.size, item.color)) {
    Part part;
    part.mesh = std::move(model.mesh);
    Transform(transform, &part.mesh);
    Subdivide(kFurnitureEdgeM, &part.mesh);
    part.material = model.material;
    part.color = model.color;
    part.class_id = ClassId(item.class_name);
    part.instance = instance;
    part.texture_seed = Hash(static_cast<uint32_t>(index), look++);
    part.room = item.room;
    scene->parts.push_back(std::move(part));
  }
}

}  // namespace

int Scene::FaceCount() const {
  size_t count = 0;
  for (const Part& part : parts) count += part.mesh.faces.size();
  return static_cast<int>(count);
}

std::vector<int> FurnitureInstances(const World& world) {
  std::map<std::string, int> counts;
  std::vector<int> instances;
  for (const Furniture& item : world.furniture) {
    instances.push_back(counts[item.class_name]++ % kInstanceMax + 1);
  }
  return instances;
}

Scene BuildScene(const World& world, const std::vector<int>& movable) {
  Scene scene;
  AddBuilding(world.plan, &scene);
  const std::vector<int> instances = FurnitureInstances(world);
  for (int i = 0; i < static_cast<int>(world.furniture.size()); ++i) {
    if (std::find(movable.begin(), movable.end(), i) != movable.end()) continue;
    AddFurniture(world.furniture[i], i, instances[i], &scene);
  }
  return scene;
}

}  // namespace dsg::simulator
