// SPDX-License-Identifier: Apache-2.0
// A whole session moved in one change that a store takes.
#include "ingest/correction/correction.h"

#include <gtest/gtest.h>

#include <map>

#include "ingest/commit/delta_size.h"
#include "ingest/pipeline/layer_graph.h"
#include "schema/base/random.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

// The graph that a session told.
class ToldGraph : public GraphLookup {
 public:
  explicit ToldGraph(const ToldMap& told) {
    for (const Node& node : told.layers.nodes) nodes_[node.id] = node;
    edges_ = told.layers.edges;
    nodes_[told.robot.node.id] = told.robot.node;
    for (const ToldAgent& person : told.people) nodes_[person.node.id] = person.node;
  }
  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override {
    const auto found = nodes_.find(id);
    if (found == nodes_.end()) return std::optional<NodeFacts>();
    const Node& node = found->second;
    return std::optional(NodeFacts{node.layer, IsAgentKind(node.kind), node.valid,
                                   node.box_node.isEmpty() ? Box3d() : node.BoxMap(),
                                   node.map_T_node.position});
  }
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override {
    for (const Layer& layer : DefaultLayers()) {
      if (layer.id == id) return std::optional(layer);
    }
    if (id == kLevelLayer) return std::optional(LevelLayer());
    return std::optional<Layer>();
  }
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override {
    std::vector<NodeId> parents;
    for (const Edge& edge : edges_) {
      if (edge.relation == relations::kContains && edge.target == id)
        parents.push_back(edge.source);
    }
    return parents;
  }
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override {
    std::vector<NodeId> children;
    for (const Edge& edge : edges_) {
      if (edge.relation == relations::kContains && edge.source == id) {
        children.push_back(edge.target);
      }
    }
    return children;
  }
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId) const override {
    return std::optional<TimeNs>(1000);
  }
  absl::StatusOr<bool> HasAsset(const Sha256&) const override { return true; }

 private:
  std::map<NodeId, Node> nodes_;
  std::vector<Edge> edges_;
};

// Two storeys of two rooms, with objects and walls anywhere in them.
LayerParts RandomParts(Random* random) {
  LayerParts parts;
  for (int storey = 0; storey < 2; ++storey) {
    const double floor_m = 3.0 * storey;
    parts.storeys.push_back({floor_m, floor_m + 2.5, true, {2 * storey, 2 * storey + 1}});
    for (int i = 0; i < 2; ++i) {
      const int index = 2 * storey + i;
      Place place;
      place.id = index;
      place.position_map = {2.0 + 4.0 * i, 0.0, floor_m + 0.5};
      place.floor_z_m = floor_m;
      place.clearance_m = 0.8;
      place.free_box = Box3d(Eigen::Vector3d::Constant(-0.8), Eigen::Vector3d::Constant(0.8));
      parts.places.places.push_back(place);
      RoomPart room;
      room.room.id = index;
      room.room.places = {index};
      room.room.footprint_map = {
          {4.0 * i, -2.0}, {4.0 * i + 4.0, -2.0}, {4.0 * i + 4.0, 2.0}, {4.0 * i, 2.0}};
      room.room.z_min_m = floor_m;
      room.room.z_max_m = floor_m + 2.5;
      room.storey = storey;
      parts.rooms.push_back(room);
      parts.room_of_place.push_back(index);
    }
  }
  for (int i = 0; i < 12; ++i) {
    TrackedObject object;
    object.id = i;
    object.cluster.class_id = 7;
    object.cluster.map_T_box.position = {random->Uniform(0.0, 8.0), random->Uniform(-2.0, 2.0),
                                         random->Uniform(0.0, 5.0)};
    object.cluster.map_T_box.orientation =
        Eigen::AngleAxisd(random->Uniform(-3.0, 3.0), Eigen::Vector3d::UnitZ());
    object.cluster.size = {random->Uniform(0.1, 2.0), 0.8, 0.8};
    object.first_observed_ns = random->Integer(0, 500);
    object.last_observed_ns = random->Integer(500, 1000);
    parts.objects.push_back(object);
    parts.place_of_object.push_back(random->Integer(-1, 3));
    StructurePiece piece;
    piece.id = i;
    piece.type = "wall";
    piece.normal_map = Eigen::Vector3d::UnitX();
    piece.offset_m = -random->Uniform(0.0, 8.0);
    piece.box_map = Box3d(Eigen::Vector3d(-piece.offset_m, -2.0, 0.0),
                          Eigen::Vector3d(-piece.offset_m + 0.1, 2.0, 2.5));
    parts.structures.push_back(piece);
  }
  return parts;
}

Node MakeAgent(NodeId id, const char* kind) {
  Node node;
  node.id = id;
  node.layer = layers::kAgents;
  node.kind = kind;
  node.agent.emplace();
  return node;
}

ToldAgent RandomAgent(NodeId id, const char* kind, Random* random) {
  ToldAgent agent{MakeAgent(id, kind), {}};
  for (TimeNs t = 0; t <= 1000; t += 50) {
    TimedPose pose;
    pose.time_ns = t;
    pose.map_T_agent.position = {random->Uniform(0.0, 8.0), random->Uniform(-2.0, 2.0), 1.0};
    agent.poses.push_back(pose);
  }
  agent.node.map_T_node = agent.poses.back().map_T_agent;
  return agent;
}

MeshBlock RandomBlock(Random* random) {
  MeshBlock whole;
  for (uint32_t i = 0; i < 600; ++i) {
    whole.positions_map.emplace_back(static_cast<float>(random->Uniform(0.0, 2.0)),
                                     static_cast<float>(random->Uniform(0.0, 2.0)),
                                     static_cast<float>(random->Uniform(0.0, 2.0)));
    whole.first_seen_ns.push_back(random->Integer(0, 500));
    whole.last_seen_ns.push_back(random->Integer(500, 1000));
    if (i % 3 == 2) whole.faces.push_back({i - 2, i - 1, i});
  }
  return whole;
}

Pose3d RandomMove(Random* random) {
  return {{random->Normal(), random->Normal(), 0.1 * random->Normal()},
          Eigen::Quaterniond(Eigen::AngleAxisd(0.2 * random->Normal(), Eigen::Vector3d::UnitZ())) *
              Eigen::AngleAxisd(0.02 * random->Normal(), Eigen::Vector3d::UnitX())};
}

TEST(Correction, IsAChangeThatAStoreTakesWhateverMoved) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 0);
    const std::vector<CadModel> catalogue;
    const LayerGraphMaker maker({"s", 0}, {{7, "cup"}}, catalogue);
    const MeshBlock block = RandomBlock(&random);
    ToldMap told;
    told.layers = maker.Make(RandomParts(&random));
    told.mesh = {&block};
    told.robot = RandomAgent(NodeId('r', 0), kinds::kRobot, &random);
    told.people = {RandomAgent(NodeId('h', 0), kinds::kHuman, &random),
                   ToldAgent{MakeAgent(NodeId('h', 1), kinds::kHuman), {}}};
    const ToldGraph graph(told);
    RobotGraph::Solution solution;
    solution.change =
        TrajectoryChange({0, 500, 1000}, {Pose3d(), RandomMove(&random), RandomMove(&random)});
    solution.keyframe_times = {0, 500, 1000};
    solution.covariances.resize(3);

    Correction correction = MakeCorrection(told, solution);
    correction.delta.session_id = "s";
    correction.delta.sequence = 1;
    const absl::Status status = CheckDelta(correction.delta, graph);
    EXPECT_TRUE(status.ok()) << status;
    EXPECT_EQ(correction.delta.nodes.size(), told.layers.nodes.size() + 2);
    EXPECT_EQ(correction.delta.corrections.size(), 2u);
    EXPECT_TRUE(correction.delta.edges.empty());
    EXPECT_FALSE(correction.delta.mesh_blocks.empty());
    EXPECT_TRUE(correction.delta.stays.empty());
    for (const TrajectoryCorrection& track : correction.delta.corrections) {
      EXPECT_EQ(track.from_ns, 0);
      EXPECT_EQ(track.to_ns, 1001);
      EXPECT_EQ(track.poses.size(), 21u);
    }
  }
}

TEST(Correction, IsEmptyWhenNothingMoved) {
  ToldMap told;
  told.layers.nodes.push_back(MakeAgent(NodeId('r', 0), kinds::kRobot));
  const Correction correction = MakeCorrection(told, {});
  EXPECT_TRUE(correction.delta.empty());
  EXPECT_EQ(correction.layers.nodes.size(), 1u);
}

TEST(Correction, ALongOneIsCutWithItsNodesTogether) {
  Random random(7, 0);
  ToldMap told;
  told.robot = ToldAgent{MakeAgent(NodeId('r', 0), kinds::kRobot), {}};
  for (TimeNs t = 0; t < 40'000; ++t) {
    TimedPose pose;
    pose.time_ns = t;
    told.robot.poses.push_back(pose);
  }
  std::vector<MeshBlock> blocks;
  for (int i = 0; i < 200; ++i) {
    blocks.push_back(RandomBlock(&random));
    for (Eigen::Vector3f& point : blocks.back().positions_map) {
      point.x() += 2.0f * static_cast<float>(i);
    }
    blocks.back().index.x = i;
  }
  for (const MeshBlock& block : blocks) told.mesh.push_back(&block);
  RobotGraph::Solution solution;
  solution.change = TrajectoryChange({0, 1000}, {Pose3d(), RandomMove(&random)});
  solution.keyframe_times = {0, 1000};
  solution.covariances.resize(2);
  const Correction correction = MakeCorrection(told, solution);
  const std::vector<GraphDelta> parts = CutCorrection(correction.delta);
  ASSERT_GT(parts.size(), 3u);
  EXPECT_EQ(parts.front().nodes.size(), correction.delta.nodes.size());
  EXPECT_EQ(parts.front().mesh_removals.size(), correction.delta.mesh_removals.size());
  size_t block_count = 0;
  TimeNs next_ns = 0;
  for (const GraphDelta& part : parts) {
    EXPECT_LE(EstimateBytes(part), kDeltaBytesMax);
    block_count += part.mesh_blocks.size();
    for (const TrajectoryCorrection& piece : part.corrections) {
      EXPECT_EQ(piece.from_ns, next_ns);
      EXPECT_EQ(piece.poses.front().time_ns, next_ns);
      next_ns = piece.to_ns;
    }
  }
  EXPECT_EQ(next_ns, 40'000);
  EXPECT_EQ(block_count, correction.delta.mesh_blocks.size());
}

TEST(Correction, TakesALoopAsTheLogGaveIt) {
  LoopMeasurement measured;
  measured.from_ns = 3;
  measured.time_ns = 8;
  measured.from_T_to.position.x() = 2.0;
  measured.information(4, 4) = 7.0;
  measured.origin = "loops.jsonl:1";
  const LoopClosure loop = ToLoopClosure(measured);
  EXPECT_EQ(loop.from_ns, 3);
  EXPECT_EQ(loop.to_ns, 8);
  EXPECT_EQ(loop.from_T_to.position.x(), 2.0);
  EXPECT_EQ(loop.information(4, 4), 7.0);
  EXPECT_EQ(loop.origin, "loops.jsonl:1");
}

}  // namespace
}  // namespace dsg::ingest
