// SPDX-License-Identifier: Apache-2.0
// The simulator's own scene graph, scored against the truth that it writes beside a log: every
// convention on the way from world to figure must agree, or a perfect map is not perfect.
#include <gtest/gtest.h>

#include "ingest/evaluation/evaluate.h"
#include "ingest/evaluation/store_reader.h"
#include "ingest/simulator/sensors/sensors_log.h"
#include "ingest/simulator/world/world.h"
#include "ingest/simulator/world/world_graph.h"
#include "ingest/truth/truth.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::simulator {
namespace {

// Long enough to see all rooms; few frames, since only the truth counts here.
SensorsOptions Options() {
  SensorsOptions options;
  options.world = {WorldKind::kApartment, 21};
  options.people_count = 2;
  options.duration_s = 70.0;
  options.rate_hz = 1.0;
  options.keyframe_every = 1;
  return options;
}

class PerfectMap : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder();
    const auto summary = WriteSensors(Options(), {.out = folder_->path() + "/sim"}, nullptr);
    ASSERT_TRUE(summary.ok()) << summary.status();
    auto truth = truth::ReadTruth(folder_->path() + "/sim/truth");
    ASSERT_TRUE(truth.ok()) << truth.status();
    truth_ = new truth::Truth(*std::move(truth));
  }
  static void TearDownTestSuite() {
    delete truth_;
    delete folder_;
  }

  // What a faultless pipeline would commit of everything that does not move, and of the robot.
  static GraphDelta PerfectDelta() {
    const World world = *GenerateWorld(Options().world);
    GraphDelta delta = WorldGraph(world);
    delta.mesh_blocks = SplitIntoBlocks(truth_->mesh, 2.0);
    Node robot;
    robot.id = NodeId('r', 1);
    robot.kind = kinds::kRobot;
    robot.layer = layers::kAgents;
    robot.name = "body";
    robot.agent = AgentInfo();
    delta.nodes.push_back(robot);
    TrajectoryAppend track{robot.id, {}};
    for (const truth::RobotState& state : truth_->robot) {
      track.poses.push_back({state.time_ns, 0, state.map_T_body});
    }
    delta.appends.push_back(std::move(track));
    return delta;
  }

  static evaluation::Report Score(GraphDelta delta, const std::string& name) {
    const auto store = *GraphStore::Open(folder_->path() + "/" + name, {.create = true});
    MapSpec spec;
    spec.name = "home";
    spec.epoch_ns = truth_->begin_ns;
    EXPECT_TRUE(store->CreateMap(spec).ok());
    delta.map = "home";
    delta.session_id = "perfect";
    delta.sequence = 1;
    const auto committed = (*store->OpenWriter("home"))->Commit(std::move(delta));
    EXPECT_TRUE(committed.ok()) << committed.status();
    const auto map = *store->OpenMap("home");
    const auto estimate = evaluation::ReadEstimate(*map, 0, {});
    EXPECT_TRUE(estimate.ok()) << estimate.status();
    evaluation::EvaluateOptions options;
    options.mesh.sample_count = 200'000;
    const evaluation::Report report = evaluation::Evaluate(*estimate, *truth_, options, {});
    return report;
  }

  static test::TempFolder* folder_;
  static truth::Truth* truth_;
};

test::TempFolder* PerfectMap::folder_ = nullptr;
truth::Truth* PerfectMap::truth_ = nullptr;

TEST_F(PerfectMap, ScoresPerfectly) {
  const evaluation::Report report = Score(PerfectDelta(), "perfect");
  EXPECT_LT(report.trajectory.causal.value().rmse_m, 1e-3);
  EXPECT_GT(report.trajectory.coverage.value(), 0.99);
  EXPECT_LT(report.mesh.rmse_no_icp_m.value(), 0.01);
  EXPECT_GT(report.mesh.completeness.value(), 0.999);
  EXPECT_LT(report.mesh.ghost_m2.value(), 0.01);
  // Where a cup stands on a table the nearest sample may be of the other.
  EXPECT_GT(report.mesh.miou.value(), 0.9);
  EXPECT_LT(report.objects.unknown.mean_error_m.value(), 0.01);
  EXPECT_GT(report.objects.unknown.found_ratio.value(), 0.999);
  // The grid is 0.1 m coarse; the places keep clear of the exact world.
  EXPECT_GT(report.places.collision_free_ratio.value(), 0.98);
  EXPECT_GT(report.places.coverage.value(), 0.95);
  EXPECT_LT(report.places.stretch_median.value(), 1.2);
  EXPECT_GT(report.rooms.outside_doors.precision.value(), 0.999);
  EXPECT_GT(report.rooms.outside_doors.recall.value(), 0.999);
  // The disc of a place in a doorway reaches into both rooms.
  EXPECT_GT(report.rooms.volumetric.precision.value(), 0.9);
  EXPECT_EQ(report.rooms.count.value(), report.rooms.count_truth);
  EXPECT_GT(report.rooms.adjacency_f1.value(), 0.999);
}

TEST_F(PerfectMap, ScoresBadlyOnceItIsShiftedByHalfAMetre) {
  GraphDelta delta = PerfectDelta();
  for (Node& node : delta.nodes) {
    if (node.layer == layers::kObjects) node.map_T_node.position.x() += 0.5;
  }
  MeshBlock mesh = truth_->mesh;
  for (Eigen::Vector3f& point : mesh.positions_map) point.z() += 0.5f;
  delta.mesh_blocks = SplitIntoBlocks(mesh, 2.0);
  for (Node& node : delta.nodes) {
    // Boxes over the children are not what is tested here.
    if (!node.box_node.isEmpty() && node.layer != layers::kObjects) {
      node.box_node = Box3d(node.box_node.min() - Eigen::Vector3d::Constant(2.0),
                            node.box_node.max() + Eigen::Vector3d::Constant(2.0));
    }
  }
  const evaluation::Report report = Score(std::move(delta), "shifted");
  EXPECT_GT(report.objects.unknown.mean_error_m.value(), 0.4);
  EXPECT_GT(report.mesh.rmse_no_icp_m.value(), 0.2);
  EXPECT_LT(report.mesh.completeness.value(), 0.8);
  EXPECT_GT(report.mesh.ghost_m2.value(), 10.0);
}

}  // namespace
}  // namespace dsg::simulator
