// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/engine/collision/scene.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

namespace dsg::test {
namespace {

constexpr char kMap[] = "scene";

template <typename T>
T OrDie(absl::StatusOr<T> value) {
  if (!value.ok()) {
    std::fprintf(stderr, "cannot build the test's scene: %s\n", value.status().ToString().c_str());
    std::abort();
  }
  return *std::move(value);
}

}  // namespace

Pose3d RandomPose(Random* random, double range_m) {
  Pose3d pose;
  for (int i = 0; i < 3; ++i) pose.position[i] = random->Uniform(-range_m, range_m);
  pose.orientation =
      Eigen::Quaterniond(random->Normal(), random->Normal(), random->Normal(), random->Normal())
          .normalized();
  return pose;
}

Box3d RandomBox(Random* random) {
  const Eigen::Vector3d half(random->Uniform(0.02, 0.6), random->Uniform(0.02, 0.6),
                             random->Uniform(0.02, 0.6));
  return Box3d(-half, half);
}

Node ObjectAt(uint64_t index, const Pose3d& map_T_object, const Box3d& box_node) {
  Node node;
  node.id = NodeId('O', index);
  node.layer = layers::kObjects;
  node.kind = kinds::kObject;
  node.map_T_node = map_T_object;
  node.box_node = box_node;
  node.object.emplace();
  return node;
}

Node StructureAt(uint64_t index, const std::string& type, const Box3d& box_map,
                 const Eigen::Vector3d& normal_map) {
  Node node;
  node.id = NodeId('S', index);
  node.layer = layers::kStructures;
  node.kind = kinds::kStructure;
  node.class_name = type;
  node.map_T_node.position = box_map.center();
  node.box_node = Box3d(box_map.min() - box_map.center(), box_map.max() - box_map.center());
  node.structure = StructureInfo{type, normal_map, -normal_map.dot(box_map.center()), 0};
  return node;
}

Node AgentNode(uint64_t index) {
  Node node;
  node.id = NodeId('H', index);
  node.layer = layers::kAgents;
  node.kind = kinds::kHuman;
  return node;
}

TimedPose StandingAt(TimeNs time_ns, double x, double y, double z) {
  TimedPose pose;
  pose.time_ns = time_ns;
  pose.map_T_agent.position = Eigen::Vector3d(x, y, z);
  return pose;
}

std::vector<MeshBlock> Blocks(const std::vector<query::Convex>& triangles,
                              const std::vector<uint32_t>& instances) {
  MeshBlock whole;
  for (size_t i = 0; i < triangles.size(); ++i) {
    const auto first = static_cast<uint32_t>(whole.positions_map.size());
    for (size_t k = 0; k < 3; ++k) {
      whole.positions_map.push_back(triangles[i].corners[k].cast<float>());
      if (!instances.empty()) whole.instance_ids.push_back(instances[i]);
    }
    whole.faces.push_back({first, first + 1, first + 2});
  }
  return SplitIntoBlocks(whole, 2.0);
}

std::vector<query::Convex> Rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                                     const Eigen::Vector3d& v) {
  return {query::MakeTriangle(corner, corner + u, corner + u + v),
          query::MakeTriangle(corner, corner + u + v, corner + v)};
}

Scene::Scene() {
  StoreOptions options;
  options.create = true;
  store_ = OrDie(GraphStore::Open(folder_.path(), options));
  MapSpec spec;
  spec.name = kMap;
  spec.codec = TrajectoryCodec::kLossless;
  if (!store_->CreateMap(spec).ok()) std::abort();
  writer_ = OrDie(store_->OpenWriter(kMap));
  map_ = OrDie(store_->OpenMap(kMap));
}

Revision Scene::Commit(GraphDelta delta) {
  delta.map = kMap;
  delta.session_id = "scene";
  delta.sequence = ++sequence_;
  return OrDie(writer_->Commit(std::move(delta))).revision;
}

std::shared_ptr<const Snapshot> Scene::At(Revision revision) { return OrDie(map_->At(revision)); }

std::shared_ptr<const query::GraphView> Scene::ViewAt(Revision revision) {
  auto& view = views_[revision];
  if (view == nullptr) {
    view = OrDie(query::GraphView::Load(*At(revision), symbols_, StopCheck()));
  }
  return view;
}

query::CollisionWorld Scene::World(Revision revision, std::optional<TimeNs> at_ns) {
  return query::CollisionWorld::Create(ViewAt(revision), At(revision), at_ns, &cache_);
}

query::CollisionHit Ask(query::CollisionWorld world, const query::Body& body,
                        const query::CollisionScope& scope) {
  const auto hit = world.Check(body, scope, StopCheck());
  EXPECT_TRUE(hit.ok()) << hit.status();
  return hit.ok() ? *hit : query::CollisionHit();
}

query::Body SphereAt(double radius_m, const Eigen::Vector3d& center_map) {
  return query::SweptSphere(radius_m, {center_map});
}

}  // namespace dsg::test
