// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/merge/perceived_half.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <sstream>

#include "ingest/simulator/world/catalogue.h"
#include "ingest/simulator/world/world_graph.h"
#include "schema/base/random.h"
#include "schema/model/rigid_motion.h"

namespace dsg::test {
namespace {

class Perceiver {
 public:
  Perceiver(const simulator::World& world, const PerceiveOptions& options)
      : world_(world),
        options_(options),
        random_(options.seed, 77),
        truth_(simulator::WorldGraph(world)),
        min_x_(world.Bounds().min().x() + options.from * world.Bounds().sizes().x()),
        max_x_(world.Bounds().min().x() + options.to * world.Bounds().sizes().x()) {}

  PerceivedHalf Run() {
    half_.map_T_world = options_.map_T_world;
    half_.delta.layers = truth_.layers;
    half_.delta.labels = truth_.labels;
    AddBuilding();
    for (const Node& node : truth_.nodes) {
      if (node.kind == kinds::kRoom) AddRoom(node);
      if (node.kind == kinds::kStructure) AddStructure(node);
      if (node.kind == kinds::kPlace) AddPlace(node);
    }
    for (const Node& node : truth_.nodes) {
      if (node.kind == kinds::kObject) AddObject(node);
    }
    AddRobot();
    CarryEdges();
    for (Node& node : half_.delta.nodes) TransformNode(options_.map_T_world, &node);
    FitBoxesToChildren(&half_.delta);
    return std::move(half_);
  }

 private:
  bool IsSeen(const Eigen::Vector3d& position) const {
    return position.x() >= min_x_ && position.x() <= max_x_;
  }

  Eigen::Vector3d Noise(double sigma) {
    const double x = random_.Normal();
    const double y = random_.Normal();
    const double z = random_.Normal();
    return sigma * Eigen::Vector3d(x, y, 0.5 * z);
  }

  Node& Add(Node node, uint64_t index) {
    const NodeId truth = node.id;
    node.id = NodeId(node.id.letter(), index);
    id_of_[truth] = node.id;
    node.name.clear();
    node.provenance = Provenance::kPerceived;
    node.first_observed_ns = options_.begin_ns + kNsPerSecond;
    node.last_observed_ns = options_.begin_ns + 100 * kNsPerSecond;
    node.observation_count = random_.Integer(3, 60);
    half_.delta.nodes.push_back(std::move(node));
    return half_.delta.nodes.back();
  }

  void AddBuilding() {
    Node building = truth_.nodes.front();
    Box3d box = building.BoxMap();
    box.min().x() = std::max(box.min().x(), min_x_);
    box.max().x() = std::min(box.max().x(), max_x_);
    SetBox(box, &building);
    Add(std::move(building), 0);
  }

  static void SetBox(const Box3d& box, Node* region) {
    region->map_T_node.position = box.center();
    region->map_T_node.position.z() = box.min().z();
    region->box_node =
        Box3d(box.min() - region->map_T_node.position, box.max() - region->map_T_node.position);
    region->region->footprint_map = {box.min().head<2>(),
                                     {box.max().x(), box.min().y()},
                                     box.max().head<2>(),
                                     {box.min().x(), box.max().y()}};
  }

  void AddRoom(Node room) {
    Box3d box = room.BoxMap();
    box.min().x() = std::max(box.min().x(), min_x_) + 0.08 * random_.Normal();
    box.max().x() = std::min(box.max().x(), max_x_) + 0.08 * random_.Normal();
    box.min().y() += 0.08 * random_.Normal();
    box.max().y() += 0.08 * random_.Normal();
    if (box.max().x() - box.min().x() < 1.0) return;
    SetBox(box, &room);
    const int truth = static_cast<int>(room.id.index());
    half_.room_of[Add(std::move(room), room_count_++).id] = truth;
  }

  void AddStructure(Node part) {
    Box3d box = part.BoxMap();
    box.min().x() = std::max(box.min().x(), min_x_);
    box.max().x() = std::min(box.max().x(), max_x_);
    if (box.isEmpty() || random_.Chance(options_.missed_share)) return;
    const double shift = 0.02 * random_.Normal();
    part.map_T_node.position = box.center() + shift * part.structure->plane_normal_map;
    part.structure->plane_offset_m -= shift;
    part.box_node = Box3d(-0.5 * box.sizes(), 0.5 * box.sizes());
    Add(std::move(part), structure_count_++);
  }

  void AddPlace(Node place) {
    if (!IsSeen(place.map_T_node.position) || random_.Chance(options_.missed_share)) return;
    Eigen::Vector3d shift = Noise(options_.place_noise_m);
    shift.z() = 0.0;
    shift = shift.cwiseMax(-0.3).cwiseMin(0.3);
    place.map_T_node.position += shift;
    place.place->clearance_m = std::max(0.2, place.place->clearance_m - 0.5 * shift.norm());
    place.place->free_box.translate(-shift);
    place.box_node = Box3d(Eigen::Vector3d::Zero().eval());
    Add(std::move(place), place_count_++);
  }

  void AddObject(const Node& truth) {
    if (!IsSeen(truth.map_T_node.position) || random_.Chance(options_.missed_share)) return;
    Node& seen = Add(truth, object_count_++);
    half_.thing_of[seen.id] = static_cast<int>(truth.id.index());
    Disturb(&seen);
    if (random_.Chance(options_.misclassified_share)) Mistake(&seen);
    if (!random_.Chance(options_.false_share)) return;
    Node ghost = truth;
    ghost.map_T_node.position += Eigen::Vector3d(random_.Uniform(-3, 3), random_.Uniform(-3, 3), 0);
    ghost.id = NodeId('O', 1'000'000 + object_count_);
    const NodeId place = half_.delta.nodes[FirstPlace()].id;
    const NodeId id = Add(std::move(ghost), object_count_++).id;
    AddContains(place, id);
  }

  size_t FirstPlace() const {
    for (size_t i = 0; i < half_.delta.nodes.size(); ++i) {
      if (half_.delta.nodes[i].kind == kinds::kPlace) return i;
    }
    return 0;
  }

  void Disturb(Node* node) {
    node->map_T_node.position += Noise(options_.position_noise_m);
    Eigen::Vector3d scale;
    for (int axis = 0; axis < 3; ++axis) scale[axis] = 1.0 + options_.size_noise * random_.Normal();
    scale = scale.cwiseMax(0.7).cwiseMin(1.3);
    const Eigen::Vector3d half = 0.5 * node->box_node.sizes().cwiseProduct(scale);
    node->box_node = Box3d(-half, half);
    node->object->size = 2.0 * half;
  }

  void Mistake(Node* node) {
    const auto& labels = simulator::Labels();
    for (int tries = 0; tries < 100; ++tries) {
      const auto& label =
          labels[static_cast<size_t>(random_.Index(static_cast<int>(labels.size())))];
      if (label.id < 10 || label.id >= 100) continue;
      node->class_id = label.id;
      node->class_name = label.name;
      return;
    }
  }

  void AddRobot() {
    Node robot;
    robot.id = NodeId('r', 0);
    robot.layer = layers::kAgents;
    robot.kind = kinds::kRobot;
    robot.name = "robot";
    half_.delta.nodes.push_back(robot);
    TrajectoryAppend track{robot.id, {}};
    for (int i = 0; i < 100; ++i) {
      TimedPose pose;
      pose.time_ns = options_.begin_ns + i * kNsPerSecond;
      const double share = i / 99.0;
      pose.map_T_agent.position = Eigen::Vector3d(min_x_ + share * (max_x_ - min_x_), 5.0, 0.5);
      TransformPose(options_.map_T_world, &pose);
      track.poses.push_back(std::move(pose));
    }
    half_.delta.appends.push_back(std::move(track));
    for (const Node& node : half_.delta.nodes) {
      if (node.kind != kinds::kPlace) continue;
      half_.delta.stays.push_back(
          {robot.id, node.id, NodeId(), options_.begin_ns, options_.begin_ns + 10 * kNsPerSecond});
      break;
    }
  }

  void AddContains(NodeId parent, NodeId child) {
    Edge edge;
    edge.source = parent;
    edge.relation = relations::kContains;
    edge.target = child;
    half_.delta.edges.push_back(std::move(edge));
  }

  void CarryEdges() {
    for (Edge edge : truth_.edges) {
      const auto source = id_of_.find(edge.source);
      const auto target = id_of_.find(edge.target);
      if (source == id_of_.end() || target == id_of_.end()) continue;
      edge.source = source->second;
      edge.target = target->second;
      half_.delta.edges.push_back(std::move(edge));
    }
  }

  const simulator::World& world_;
  const PerceiveOptions& options_;
  Random random_;
  GraphDelta truth_;
  double min_x_;
  double max_x_;
  PerceivedHalf half_;
  std::map<NodeId, NodeId> id_of_;
  uint64_t room_count_ = 0;
  uint64_t structure_count_ = 0;
  uint64_t place_count_ = 0;
  uint64_t object_count_ = 0;
};

}  // namespace

PerceivedHalf Perceive(const simulator::World& world, const PerceiveOptions& options) {
  return Perceiver(world, options).Run();
}

void StoreMap(GraphStore* store, const std::string& name, GraphDelta delta) {
  MapSpec spec;
  spec.name = name;
  ASSERT_TRUE(store->CreateMap(spec).ok());
  delta.map = name;
  delta.session_id = "test";
  delta.sequence = 1;
  auto writer = store->OpenWriter(name);
  ASSERT_TRUE(writer.ok()) << writer.status();
  for (GraphDelta& part : SplitDelta(std::move(delta), 5000)) {
    const auto result = (*writer)->Commit(std::move(part));
    ASSERT_TRUE(result.ok()) << result.status();
  }
}

std::shared_ptr<const Snapshot> Newest(GraphStore* store, const std::string& name) {
  const auto map = store->OpenMap(name);
  EXPECT_TRUE(map.ok()) << map.status();
  const auto snapshot = (*map)->Latest();
  EXPECT_TRUE(snapshot.ok()) << snapshot.status();
  return *snapshot;
}

simulator::World MakeWorld(simulator::WorldKind kind, uint64_t seed) {
  auto world = simulator::GenerateWorld({kind, seed});
  EXPECT_TRUE(world.ok()) << world.status();
  return *std::move(world);
}

std::vector<uint64_t> MergeSeeds(std::vector<uint64_t> usual) {
  const char* text = std::getenv("DSG_MERGE_SEEDS");
  if (text == nullptr) return usual;
  std::istringstream stream(text);
  std::vector<uint64_t> seeds;
  for (uint64_t seed = 0; stream >> seed;) seeds.push_back(seed);
  return seeds;
}

Pose3d SomeTransform(uint64_t seed) {
  Random random(seed, 99);
  const double yaw = random.Uniform(-std::numbers::pi, std::numbers::pi);
  const double x = random.Uniform(-60, 60);
  const double y = random.Uniform(-60, 60);
  const double z = random.Uniform(-1, 1);
  return {Eigen::Vector3d(x, y, z),
          Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
}

}  // namespace dsg::test
