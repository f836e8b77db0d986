// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/engine/office.h"

#include <cstdio>
#include <cstdlib>

namespace dsg::test {
namespace {

constexpr char kSession[] = "test";

// Stops the whole program: a test without its world proves nothing.
template <typename T>
T OrDie(absl::StatusOr<T> value) {
  if (!value.ok()) {
    std::fprintf(stderr, "cannot build the test's world: %s\n", value.status().ToString().c_str());
    std::abort();
  }
  return *std::move(value);
}

Box3d BoxOf(double x0, double y0, double z0, double x1, double y1, double z1) {
  return Box3d(Eigen::Vector3d(x0, y0, z0), Eigen::Vector3d(x1, y1, z1));
}

Edge Contains(NodeId parent, NodeId child) {
  Edge edge;
  edge.source = parent;
  edge.relation = relations::kContains;
  edge.target = child;
  return edge;
}

Edge Traversable(NodeId from, NodeId to) {
  Edge edge = Contains(from, to);
  edge.relation = relations::kTraversable;
  edge.weight = 0.8;
  return edge;
}

void AddTracks(GraphDelta* delta) {
  const NodeId walker('H', 12);
  const NodeId stander('H', 13);
  const NodeId robot('r', 1);
  TrajectoryAppend walk{walker, {}};
  for (int t = 0; t <= 18; ++t) walk.poses.push_back(PoseAt(t * kSecond, 1.0 + t, 5, 1));
  for (int t = 60; t <= 62; ++t) walk.poses.push_back(PoseAt(t * kSecond, 19, 5, 1));
  TrajectoryAppend stand{stander, {}};
  for (int t = 2; t <= 12; ++t) {
    stand.poses.push_back(PoseAt(t * kSecond, 3, 5, 1));
    stand.poses.back().flags = pose_flags::kNoOrientation;
  }
  delta->appends = {walk, stand, {robot, {PoseAt(5 * kSecond, 15, 5, 0)}}};
  const NodeId p1('p', 1), p2('p', 2), p3('p', 3), room1('R', 1), room2('R', 2);
  delta->stays = {{walker, p1, room1, 0, 4 * kSecond},
                  {walker, p2, room1, 4 * kSecond, 9 * kSecond},
                  {walker, p3, room2, 9 * kSecond, 19 * kSecond},
                  {walker, p3, room2, 60 * kSecond, kTimeMax},
                  {stander, p1, room1, 2 * kSecond, 12 * kSecond}};
}

}  // namespace

TimedPose PoseAt(TimeNs time_ns, double x, double y, double z) {
  TimedPose pose;
  pose.time_ns = time_ns;
  pose.map_T_agent.position = Eigen::Vector3d(x, y, z);
  return pose;
}

Node MakeNode(NodeId id, LayerId layer, const std::string& kind, const std::string& name,
              const Box3d& box_map) {
  Node node;
  node.id = id;
  node.layer = layer;
  node.kind = kind;
  node.name = name;
  if (!box_map.isEmpty()) {
    node.map_T_node.position = box_map.center();
    node.box_node = Box3d(box_map.min() - box_map.center(), box_map.max() - box_map.center());
  }
  return node;
}

GraphDelta OfficeDelta() {
  GraphDelta delta;
  delta.map = kMap;
  delta.session_id = kSession;
  delta.sequence = 1;
  delta.author = "test";
  delta.message = "an office";
  const auto add = [&](NodeId id, LayerId layer, const char* kind, const char* name,
                       const Box3d& box_map) {
    delta.nodes.push_back(MakeNode(id, layer, kind, name, box_map));
  };
  const NodeId building('B', 1), room1('R', 1), room2('R', 2);
  const NodeId p1('p', 1), p2('p', 2), p3('p', 3), cup('O', 1), chair('O', 2);
  add(building, layers::kBuildings, kinds::kBuilding, "HQ", BoxOf(0, 0, 0, 20, 10, 3));
  add(room1, layers::kRooms, kinds::kRoom, "kitchen", BoxOf(0, 0, 0, 10, 10, 3));
  add(room2, layers::kRooms, kinds::kRoom, "lab", BoxOf(10, 0, 0, 20, 10, 3));
  add(p1, layers::kPlaces, kinds::kPlace, "", BoxOf(1, 4, 0, 4, 6, 2));
  add(p2, layers::kPlaces, kinds::kPlace, "", BoxOf(5, 4, 0, 8, 6, 2));
  add(p3, layers::kPlaces, kinds::kPlace, "", BoxOf(12, 4, 0, 18, 6, 2));
  add(cup, layers::kObjects, kinds::kObject, "cup", BoxOf(2, 4.5, 0.9, 2.2, 4.7, 1.1));
  add(chair, layers::kObjects, kinds::kObject, "chair", BoxOf(14, 4.5, 0, 15, 5.5, 1));
  add(NodeId('H', 12), layers::kAgents, kinds::kHuman, "12", Box3d());
  add(NodeId('H', 13), layers::kAgents, kinds::kHuman, "13", Box3d());
  add(NodeId('r', 1), layers::kAgents, kinds::kRobot, "spot", Box3d());
  delta.edges = {Contains(building, room1), Contains(building, room2), Contains(room1, p1),
                 Contains(room1, p2),       Contains(room2, p3),       Contains(p1, cup),
                 Contains(p3, chair),       Traversable(p1, p2),       Traversable(p2, p3)};
  AddTracks(&delta);
  return delta;
}

void AddRandomMesh(int side, Random* random, GraphDelta* delta) {
  for (int i = 0; i < side * side; ++i) {
    MeshBlock block;
    block.index = {i % side, i / side, 0};
    for (uint32_t k = 0; k < 3000; ++k) {
      block.positions_map.emplace_back(2.0 * block.index.x + random->Uniform(0, 2),
                                       2.0 * block.index.y + random->Uniform(0, 2),
                                       random->Uniform(0, 2));
      if (k % 3 == 2) block.faces.push_back({k - 2, k - 1, k});
    }
    delta->mesh_blocks.push_back(std::move(block));
  }
}

void MakeOffice(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  const auto store = OrDie(GraphStore::Open(folder, options));
  MapSpec spec;
  spec.name = kMap;
  spec.codec = TrajectoryCodec::kLossless;
  if (!store->CreateMap(spec).ok()) std::abort();
  OrDie(OrDie(store->OpenWriter(kMap))->Commit(OfficeDelta()));
}

void CommitToOffice(const std::string& folder, GraphDelta delta) {
  const auto store = OrDie(GraphStore::Open(folder, {}));
  const auto writer = OrDie(store->OpenWriter(kMap));
  delta.map = kMap;
  delta.session_id = kSession;
  delta.sequence = OrDie(writer->GetSession(kSession)).last_sequence + 1;
  OrDie(writer->Commit(std::move(delta)));
}

std::unique_ptr<query::ServiceCore> OpenCore(const std::string& folder) {
  return query::MakeServiceCore(OrDie(GraphStore::Open(folder, {})));
}

}  // namespace dsg::test
