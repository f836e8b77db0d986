// SPDX-License-Identifier: Apache-2.0
// A small truth, a store that says the same, and stores that say something else.
#include <gtest/gtest.h>
#include <openssl/sha.h>

#include <cmath>

#include "ingest/evaluation/evaluate.h"
#include "ingest/evaluation/store_reader.h"
#include "schema/base/status.h"
#include "schema/model/delta_check.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/evaluation/boxes.h"

namespace dsg::evaluation {
namespace {

constexpr TimeNs kFrame = 50'000'000;
constexpr int kFrames = 200;

Pose3d At(double x, double y, double z, double yaw = 0.0) {
  return {{x, y, z}, Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
}

// Two rooms of 4 x 4 m, a door 1 m wide between them, seen whole.
void AddBuilding(truth::Truth* truth) {
  truth->rooms = {{"R0", "kitchen", {{0, 0}, {4, 0}, {4, 4}, {0, 4}}, 2.5},
                  {"R1", "office", {{4, 0}, {8, 0}, {8, 4}, {4, 4}}, 2.5}};
  truth->doors = {{0, 1, {4, 1}, {4, 2}, 2.1}};
  truth::FreeGrid& grid = truth->free_grid;
  grid = {{0, 0}, 0.1, 80, 40, {}};
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 80; ++x) {
      const bool is_middle = x == 39 || x == 40;
      const bool is_door = is_middle && y >= 10 && y < 20;
      const bool is_free = x > 0 && x < 79 && y > 0 && y < 39 && (!is_middle || is_door);
      grid.cells.push_back(static_cast<uint8_t>(truth::kCellObserved |
                                                (is_free ? truth::kCellFree : 0) |
                                                (is_door ? truth::kCellDoorBand : 0)));
    }
  }
  for (double x : {0.0, 4.0}) {
    test::AddBox(Box3d(Eigen::Vector3d(x, 0, 0), Eigen::Vector3d(x + 4, 4, 2.5)), test::kWall,
                 test::kFloor, &truth->mesh);
  }
  truth->face_observed.assign(truth->mesh.faces.size(), 1);
  truth->labels = {{1, "wall"}, {2, "floor"}};
}

void AddThings(truth::Truth* truth) {
  truth->objects = {
      {"cup", "cup", 5, 1, 0, At(1, 1, 0.8), {0.1, 0.1, 0.1}, "", 1, 1.0},
      {"plant", "plant", 6, 1, 1, At(7, 3, 0.5), {0.4, 0.4, 1.0}, "", 1, 1.0},
      {"couch", "couch", 7, 1, 1, At(6, 1, 0.4, 0.7), {2, 1, 0.8}, "couch.ply", 1, 1.0}};
  truth->humans = {{"anna", {}, 1.7}, {"ben", {}, 1.8}};
  truth->picks = {{0, 1, 0, 4 * kNsPerSecond, kTimeMax, At(1, 1, 0.8), true}};
}

void AddMotion(truth::Truth* truth) {
  truth->begin_ns = 0;
  truth->end_ns = (kFrames - 1) * kFrame;
  for (int i = 0; i < kFrames; ++i) {
    const double t = 0.05 * i;
    truth::RobotState state;
    state.time_ns = i * kFrame;
    state.map_T_body = At(4 + 3 * std::sin(t), 2 + std::cos(2 * t), 1.2 + 0.1 * std::sin(3 * t), t);
    truth->robot.push_back(state);
    if (i % 4 != 0) continue;
    for (int human = 0; human < 2; ++human) {
      const Eigen::Vector3d torso(1.0 + 0.02 * i, 1.0 + 2.0 * human, 0.95);
      truth->detections.push_back({2 * i + human, i * kFrame, human, 0.9, 3.0, false, torso,
                                   torso + Eigen::Vector3d(0.4, 0, 0)});
    }
  }
}

truth::Truth MakeTruth() {
  truth::Truth truth;
  truth.world = "by hand";
  AddBuilding(&truth);
  AddThings(&truth);
  AddMotion(&truth);
  return truth;
}

Node MakeNode(char letter, uint64_t index, const char* kind, const Pose3d& map_T_node) {
  Node node;
  node.id = NodeId(letter, index);
  node.kind = kind;
  node.layer = *LayerOfKind(kind);
  node.name = ToString(node.id);
  node.map_T_node = map_T_node;
  return node;
}

Edge MakeEdge(NodeId source, const char* relation, NodeId target) {
  Edge edge;
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
  return edge;
}

// Places every metre, and one in the door; edges to the neighbours of the same room.
void AddPlaces(const truth::Truth& truth, GraphDelta* delta) {
  for (uint64_t room = 0; room < 2; ++room) {
    Node node =
        MakeNode('R', room + 1, kinds::kRoom, At(2.0 + 4.0 * static_cast<double>(room), 2, 1.25));
    node.box_node = Box3d(Eigen::Vector3d(-2, -2, -1.25), Eigen::Vector3d(2, 2, 1.25));
    node.region = RegionInfo{truth.rooms[room].footprint_map, 0.0, 2.5, {}};
    delta->nodes.push_back(node);
  }
  delta->edges.push_back(MakeEdge(NodeId('R', 1), relations::kAdjacent, NodeId('R', 2)));
  const auto add = [delta](uint64_t index, double x, double y) {
    Node node = MakeNode('P', index, kinds::kPlace, At(x, y, 1.0));
    node.place = PlaceInfo{0.45, Box3d(), 3};
    delta->nodes.push_back(node);
    delta->edges.push_back(MakeEdge(NodeId('R', x < 4.0 ? 1 : 2), relations::kContains, node.id));
  };
  const auto join = [delta](uint64_t a, uint64_t b) {
    delta->edges.push_back(MakeEdge(NodeId('P', a), relations::kTraversable, NodeId('P', b)));
  };
  for (uint64_t i = 0; i < 8; ++i) {
    for (uint64_t j = 0; j < 4; ++j) {
      const uint64_t index = 1 + 4 * i + j;
      add(index, 0.5 + static_cast<double>(i), 0.5 + static_cast<double>(j));
      if (j > 0) join(index, index - 1);
      if (i > 0 && i != 4) join(index, index - 4);
      if (i > 0 && i != 4 && j > 0) join(index, index - 5);
      if (i > 0 && i != 4 && j < 3) join(index, index - 3);
    }
  }
  // The row at y = 1.5 leads through the door.
  join(1 + 4 * 3 + 1, 1 + 4 * 4 + 1);
}

void AddObjects(const truth::Truth& truth, GraphDelta* delta) {
  Asset model{{}, "model/ply", "a couch"};
  SHA256(reinterpret_cast<const unsigned char*>(model.content.data()), model.content.size(),
         model.sha256.data());
  for (size_t i = 0; i < truth.objects.size(); ++i) {
    const truth::Object& object = truth.objects[i];
    Node node = MakeNode('O', i + 1, kinds::kObject, object.map_T_object);
    node.class_name = object.class_name;
    node.class_id = object.class_id;
    node.box_node = Box3d(-0.5 * object.size, 0.5 * object.size);
    node.object = ObjectInfo();
    if (!object.cad_file.empty()) {
      node.object->model = model.sha256;
      node.object->map_T_model = object.map_T_object * Pose3d{{0, 0, -0.5 * object.size.z()},
                                                              Eigen::Quaterniond::Identity()};
    }
    delta->nodes.push_back(node);
  }
  delta->assets.push_back(model);
}

void AddPeople(const truth::Truth& truth, GraphDelta* delta) {
  for (uint64_t human = 0; human < 2; ++human) {
    Node node = MakeNode('H', human + 1, kinds::kHuman, Pose3d());
    node.agent = AgentInfo();
    delta->nodes.push_back(node);
    TrajectoryAppend append{node.id, {}};
    FactorAppend factors{node.id, {}};
    for (const truth::DetectionTruth& row : truth.detections) {
      if (row.human != static_cast<int>(human)) continue;
      append.poses.push_back({row.time_ns, 0, {row.torso_map, Eigen::Quaterniond::Identity()}});
      // A prediction between two detections must not be scored.
      append.poses.push_back({row.time_ns + kFrame, pose_flags::kPredicted, At(99, 99, 99)});
      factors.factors.push_back({"detection_prior",
                                 row.time_ns,
                                 row.time_ns,
                                 NodeId(),
                                 {row.detected_torso_map, Eigen::Quaterniond::Identity()}});
    }
    delta->appends.push_back(append);
    delta->factors.push_back(factors);
  }
  Edge held = MakeEdge(NodeId('O', 1), relations::kHeldBy, NodeId('H', 2));
  held.weight = 1.0;
  held.valid.from_ns = truth.picks[0].pick_ns + kNsPerSecond;
  delta->edges.push_back(held);
  // Plant and couch are not near each other.
  delta->edges.push_back(MakeEdge(NodeId('O', 2), relations::kNear, NodeId('O', 3)));
}

GraphDelta PerfectGraph(const truth::Truth& truth) {
  GraphDelta delta;
  // Counted another way than the truth does.
  delta.labels = {{11, "wall"}, {12, "floor"}};
  MeshBlock mesh = truth.mesh;
  for (uint32_t& label : mesh.labels) label += 10;
  delta.mesh_blocks = SplitIntoBlocks(mesh, 2.0);
  AddPlaces(truth, &delta);
  AddObjects(truth, &delta);
  AddPeople(truth, &delta);
  Node robot = MakeNode('A', 1, kinds::kRobot, Pose3d());
  robot.agent = AgentInfo();
  delta.nodes.push_back(robot);
  return delta;
}

TrajectoryAppend RobotPoses(const truth::Truth& truth, size_t begin, size_t end) {
  TrajectoryAppend append{NodeId('A', 1), {}};
  for (size_t i = begin; i < end; ++i) {
    append.poses.push_back({truth.robot[i].time_ns, 0, truth.robot[i].map_T_body});
  }
  return append;
}

class EvaluateStore : public testing::Test {
 protected:
  EvaluateStore() {
    store_ = *GraphStore::Open(folder_.path(), {.create = true});
    MapSpec spec;
    spec.name = "office";
    spec.codec = TrajectoryCodec::kLossless;
    EXPECT_TRUE(store_->CreateMap(spec).ok());
    writer_ = *store_->OpenWriter("office");
  }

  void Commit(GraphDelta delta) {
    delta.map = "office";
    delta.session_id = "test";
    delta.sequence = ++sequence_;
    const auto result = writer_->Commit(std::move(delta));
    ASSERT_TRUE(result.ok()) << result.status();
  }

  void CommitRobot(size_t begin, size_t end) {
    GraphDelta delta;
    delta.appends = {RobotPoses(truth_, begin, end)};
    Commit(delta);
  }

  Estimate Read(Revision revision = 0) {
    const auto map = *store_->OpenMap("office");
    const auto estimate = ReadEstimate(*map, revision, {});
    EXPECT_TRUE(estimate.ok()) << estimate.status();
    return *estimate;
  }

  Report Score(Revision revision = 0) {
    EvaluateOptions options;
    options.mesh.sample_count = 20'000;
    return Evaluate(Read(revision), truth_, options, {});
  }

  const truth::Truth truth_ = MakeTruth();
  test::TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<GraphWriter> writer_;
  int64_t sequence_ = 0;
};

TEST_F(EvaluateStore, ScoresThePerfectGraphPerfectly) {
  Commit(PerfectGraph(truth_));
  CommitRobot(0, 100);
  CommitRobot(100, kFrames);
  const Report report = Score();
  EXPECT_LT(report.trajectory.causal->rmse_m, 1e-6);
  EXPECT_LT(report.trajectory.causal_unaligned->rmse_m, 1e-6);
  EXPECT_LT(report.trajectory.smoothed->rmse_m, 1e-6);
  EXPECT_DOUBLE_EQ(*report.trajectory.coverage, 1.0);
  EXPECT_GE(report.trajectory.rpe.size(), 3u);
  EXPECT_LT(*report.mesh.rmse_m, 1e-4);
  EXPECT_LT(*report.mesh.rmse_no_icp_m, 1e-4);
  EXPECT_DOUBLE_EQ(*report.mesh.completeness, 1.0);
  EXPECT_EQ(*report.mesh.ghost_m2, 0.0);
  EXPECT_GT(*report.mesh.miou, 0.97);
  EXPECT_NEAR(*report.humans.raw_m, 0.4, 1e-6);
  EXPECT_NEAR(*report.humans.filtered_m, 0.4, 1e-6);
  EXPECT_LT(*report.humans.tracked_m, 1e-6);
  EXPECT_DOUBLE_EQ(*report.humans.idf1, 1.0);
  EXPECT_LT(*report.objects.unknown.mean_error_m, 1e-6);
  EXPECT_DOUBLE_EQ(*report.objects.unknown.f1, 1.0);
  EXPECT_LT(*report.objects.known.mean_error_m, 1e-6);
  EXPECT_LT(*report.objects.known.mean_yaw_deg, 1e-4);
  EXPECT_DOUBLE_EQ(*report.places.collision_free_ratio, 1.0);
  EXPECT_DOUBLE_EQ(*report.places.coverage, 1.0);
  EXPECT_LT(*report.places.stretch_median, 1.2);
  EXPECT_DOUBLE_EQ(*report.places.connectivity, 1.0);
  EXPECT_DOUBLE_EQ(*report.rooms.of_places.precision, 1.0);
  EXPECT_DOUBLE_EQ(*report.rooms.of_places.recall, 1.0);
  EXPECT_EQ(report.rooms.count, 2);
  EXPECT_DOUBLE_EQ(*report.rooms.adjacency_f1, 1.0);
  EXPECT_DOUBLE_EQ(*report.picks.precision, 1.0);
  EXPECT_DOUBLE_EQ(*report.picks.recall, 1.0);
  EXPECT_DOUBLE_EQ(*report.picks.brier, 0.0);
  EXPECT_EQ(report.picks.mapped_count, 1);
  EXPECT_EQ(report.picks.noticed_count, 0);
  EXPECT_EQ(report.picks.right_count, 1);
  EXPECT_DOUBLE_EQ(*report.relations.at(relations::kNear).precision, 0.0);
  EXPECT_TRUE(report.notes.empty()) << report.notes[0];
}

TEST_F(EvaluateStore, ScoresACorruptedGraphBadly) {
  GraphDelta delta = PerfectGraph(truth_);
  for (Node& node : delta.nodes) {
    if (node.kind == kinds::kObject) node.map_T_node.position.x() += 1.5;
  }
  for (Edge& edge : delta.edges) {
    // Every place into the first room, which is made large enough.
    if (edge.relation == relations::kContains) edge.source = NodeId('R', 1);
    if (edge.relation == relations::kTraversable) edge.target = NodeId('P', 32);
  }
  std::erase_if(delta.edges, [](const Edge& edge) {
    return edge.relation == relations::kTraversable && edge.source == edge.target;
  });
  delta.nodes[0].box_node = Box3d(Eigen::Vector3d(-9, -9, -9), Eigen::Vector3d(9, 9, 9));
  std::swap(delta.factors[0].factors, delta.factors[1].factors);
  for (MeshBlock& block : delta.mesh_blocks) {
    block.faces.resize(block.faces.size() / 2);
    // Vertices that no face uses any more belong to the block that they lie in.
    std::vector<bool> is_used(block.positions_map.size(), false);
    for (const auto& face : block.faces) {
      for (const uint32_t vertex : face) is_used[vertex] = true;
    }
    for (size_t i = 0; i < is_used.size(); ++i) {
      if (!is_used[i]) block.positions_map[i] = block.positions_map[0];
    }
    for (uint32_t& label : block.labels) label = 11;
  }
  Coalesce(&delta);
  Commit(delta);
  const Report report = Score();
  EXPECT_FALSE(report.trajectory.causal.has_value());
  EXPECT_LT(*report.mesh.completeness, 0.8);
  EXPECT_LT(*report.mesh.miou, 0.6);
  EXPECT_NEAR(*report.humans.tracked_m, 2.0, 1e-6);
  EXPECT_DOUBLE_EQ(*report.objects.unknown.found_ratio, 0.0);
  EXPECT_DOUBLE_EQ(*report.objects.known.found_ratio, 0.0);
  EXPECT_LT(*report.places.collision_free_ratio, 0.7);
  EXPECT_NEAR(*report.rooms.of_places.precision, 0.5, 1e-12);
  EXPECT_DOUBLE_EQ(*report.picks.precision, 0.0);
}

TEST_F(EvaluateStore, TellsWhatWasSaidFirstFromWhatWasSaidLater) {
  Commit(PerfectGraph(truth_));
  for (size_t begin = 0; begin < kFrames; begin += 50) {
    GraphDelta delta;
    delta.appends = {RobotPoses(truth_, begin, begin + 50)};
    for (size_t i = 0; i < 50; ++i) {
      delta.appends[0].poses[i].map_T_agent.position.z() += i % 2 == 0 ? 0.5 : -0.5;
    }
    Commit(delta);
    // Smoothed at once.
    GraphDelta smoothed;
    smoothed.corrections = {{NodeId('A', 1), truth_.robot[begin].time_ns,
                             truth_.robot[begin + 49].time_ns + 1,
                             RobotPoses(truth_, begin, begin + 50).poses}};
    Commit(smoothed);
  }
  const Report report = Score();
  EXPECT_NEAR(report.trajectory.causal->rmse_m, 0.5, 1e-3);
  EXPECT_LT(report.trajectory.smoothed->rmse_m, 1e-6);
  EXPECT_DOUBLE_EQ(*report.trajectory.coverage, 1.0);
}

TEST_F(EvaluateStore, SaysSoWhenTheStoreCannotTellCausalPoses) {
  GraphDelta delta = PerfectGraph(truth_);
  delta.appends.push_back(RobotPoses(truth_, 0, kFrames));
  Commit(delta);
  const Report report = Score();
  EXPECT_EQ(report.trajectory.causal->rmse_m, report.trajectory.smoothed->rmse_m);
  ASSERT_EQ(report.notes.size(), 1u);
  EXPECT_NE(report.notes[0].find("one revision"), std::string::npos);
}

TEST_F(EvaluateStore, ReadsAnOlderRevision) {
  Commit(PerfectGraph(truth_));
  CommitRobot(0, 100);
  CommitRobot(100, kFrames);
  EXPECT_EQ(Read(2).robot.size(), 100u);
  EXPECT_EQ(Read(2).robot_causal.size(), 100u);
  EXPECT_NEAR(*Score(2).trajectory.coverage, 0.5, 0.02);
  const auto map = *store_->OpenMap("office");
  EXPECT_EQ(ReasonOf(ReadEstimate(*map, 9, {}).status()), Reason::kRevisionInFuture);
}

TEST_F(EvaluateStore, LeavesAnEmptyMapEmpty) {
  const Report report = Score();
  EXPECT_FALSE(report.trajectory.coverage.has_value());
  EXPECT_FALSE(report.mesh.rmse_m.has_value());
  EXPECT_FALSE(report.objects.unknown.found_ratio.has_value());
  EXPECT_FALSE(report.rooms.count.has_value());
  EXPECT_EQ(report.rooms.count_truth, 2);
}

TEST_F(EvaluateStore, DoesNotScorePosesWhoseDetectionIsUnknown) {
  GraphDelta delta = PerfectGraph(truth_);
  delta.factors.clear();
  Commit(delta);
  const Report report = Score();
  EXPECT_FALSE(report.humans.tracked_m.has_value());
  EXPECT_FALSE(report.humans.idf1.has_value());
  EXPECT_EQ(report.notes.size(), 1u);
}

}  // namespace
}  // namespace dsg::evaluation
