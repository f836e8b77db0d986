// SPDX-License-Identifier: Apache-2.0
// What hung on moved keyframes moves with them.
#include "ingest/correction/map_mover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "ingest/pipeline/map_things.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

constexpr double kPi = 3.14159265358979;
constexpr double kBlockM = 2.0;

Pose3d Turn(double yaw_rad, const Eigen::Vector3d& shift) {
  return {shift, Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()))};
}

// The same move at all times.
TrajectoryChange Rigid(const Pose3d& new_T_old) { return {{0, 1000}, {new_T_old, new_T_old}}; }

// A wall of 4 x 2 m in the plane y = `y`, cut into blocks, seen at `time_ns`.
std::vector<MeshBlock> Wall(double y, TimeNs time_ns, const Pose3d& map_T_wall = {}) {
  MeshBlock whole;
  constexpr uint32_t kColumns = 41;
  constexpr uint32_t kRows = 21;
  for (uint32_t row = 0; row < kRows; ++row) {
    for (uint32_t column = 0; column < kColumns; ++column) {
      const Eigen::Vector3d point =
          map_T_wall * Eigen::Vector3d(0.1 * column + 0.03, y, 0.1 * row + 0.03);
      whole.positions_map.push_back(point.cast<float>());
      whole.normals_map.push_back(
          (map_T_wall.orientation * Eigen::Vector3d::UnitY()).cast<float>());
      whole.labels.push_back(3);
      whole.first_seen_ns.push_back(time_ns);
      whole.last_seen_ns.push_back(time_ns);
      if (row == 0 || column == 0) continue;
      const uint32_t here = row * kColumns + column;
      whole.faces.push_back({here - kColumns - 1, here - kColumns, here});
      whole.faces.push_back({here - kColumns - 1, here, here - 1});
    }
  }
  return SplitIntoBlocks(whole, kBlockM);
}

size_t FaceCount(const std::vector<MeshBlock>& blocks) {
  size_t count = 0;
  for (const MeshBlock& block : blocks) count += block.faces.size();
  return count;
}

TEST(MoveMesh, AWallSeenTwiceBecomesOneWall) {
  // Seen again at 1000, when the robot was off by a turn and half a metre.
  const Pose3d drift = Turn(0.05, {0.1, 0.5, 0.08});
  std::vector<MeshBlock> blocks = Wall(1.0, 0);
  for (MeshBlock& block : Wall(1.0, 1000, drift)) {
    blocks.push_back(std::move(block));
    // Blocks of one index are one block of the store.
  }
  const TrajectoryChange change({0, 1000}, {Pose3d(), drift.Inverse()});
  const MovedMesh moved = MoveMesh(Pointers(blocks), change, kBlockM);
  double thickness_m = 0.0;
  for (const MeshBlock& block : moved.blocks) {
    for (const Eigen::Vector3f& point : block.positions_map) {
      thickness_m = std::max(thickness_m, std::abs(static_cast<double>(point.y()) - 1.0));
    }
    for (const Eigen::Vector3f& normal : block.normals_map) {
      EXPECT_LT((normal - Eigen::Vector3f::UnitY()).norm(), 1e-5f);
    }
  }
  EXPECT_LT(thickness_m, 1e-4);
  EXPECT_EQ(FaceCount(moved.blocks), FaceCount(blocks));
}

TEST(MoveMesh, FacesGoToTheBlocksWhereTheyAreAndEmptyOnesAreListed) {
  const std::vector<MeshBlock> blocks = Wall(1.0, 0);
  const MovedMesh moved = MoveMesh(Pointers(blocks), Rigid(Turn(0.0, {0.0, 10.0, 0.0})), kBlockM);
  std::set<BlockIndex> old_indices;
  for (const MeshBlock& block : blocks) old_indices.insert(block.index);
  EXPECT_EQ(std::set<BlockIndex>(moved.removed.begin(), moved.removed.end()), old_indices);
  ASSERT_EQ(moved.blocks.size(), blocks.size());
  for (const MeshBlock& block : moved.blocks) {
    EXPECT_EQ(block.index.y, 5);
    for (const auto& face : block.faces) {
      EXPECT_EQ(BlockOf(block.positions_map[face[0]], kBlockM), block.index);
      for (const uint32_t corner : face) ASSERT_LT(corner, block.positions_map.size());
    }
    EXPECT_EQ(block.labels.size(), block.positions_map.size());
    EXPECT_EQ(block.last_seen_ns.size(), block.positions_map.size());
  }
}

TEST(MoveMesh, NeighboursThatKnowOtherTimesDoNotComeApart) {
  std::vector<MeshBlock> blocks = Wall(1.0, 0);
  // One block was made later than the others.
  for (TimeNs& last_ns : blocks.front().last_seen_ns) last_ns = 1000;
  const TrajectoryChange change({0, 1000}, {Pose3d(), Turn(0.0, {0.3, 0.2, 0.0})});
  const MovedMesh moved = MoveMesh(Pointers(blocks), change, kBlockM);
  // An edge belongs to two faces, or lies on the rim of 4 x 2 m.
  std::map<std::pair<std::array<float, 3>, std::array<float, 3>>, int> edges;
  for (const MeshBlock& block : moved.blocks) {
    const auto at = [&block](uint32_t v) {
      const Eigen::Vector3f& p = block.positions_map[v];
      return std::array<float, 3>{p.x(), p.y(), p.z()};
    };
    for (const auto& face : block.faces) {
      for (size_t i = 0; i < 3; ++i) {
        auto edge = std::pair(at(face[i]), at(face[(i + 1) % 3]));
        if (edge.second < edge.first) std::swap(edge.first, edge.second);
        ++edges[edge];
      }
    }
  }
  int rim_count = 0;
  for (const auto& [edge, count] : edges) rim_count += count == 1 ? 1 : 0;
  EXPECT_EQ(rim_count, 2 * (40 + 20));
}

TEST(MoveMesh, WhatWasSeenTwiceGoesHalfway) {
  std::vector<MeshBlock> blocks = Wall(1.0, 0);
  for (MeshBlock& block : blocks) block.last_seen_ns.assign(block.last_seen_ns.size(), 1000);
  const TrajectoryChange change({0, 500, 1000},
                                {Pose3d(), Turn(0.0, {9.0, 9.0, 9.0}), Turn(0.0, {0.0, 0.4, 0.0})});
  for (const MeshBlock& block : MoveMesh(Pointers(blocks), change, kBlockM).blocks) {
    for (const Eigen::Vector3f& point : block.positions_map) EXPECT_NEAR(point.y(), 1.2f, 1e-5f);
  }
}

TEST(MoveMesh, StaysWithoutAChangeAndWithoutTimes) {
  std::vector<MeshBlock> blocks = Wall(1.0, 0);
  EXPECT_TRUE(MoveMesh(Pointers(blocks), TrajectoryChange(), kBlockM).blocks.empty());
  for (MeshBlock& block : blocks) block.first_seen_ns.clear();
  const MovedMesh moved = MoveMesh(Pointers(blocks), Rigid(Turn(0.0, {0.0, 10.0, 0.0})), kBlockM);
  EXPECT_TRUE(moved.removed.empty());
  EXPECT_EQ(moved.blocks.size(), blocks.size());
}

TEST(MoveMesh, IsDeterministic) {
  const std::vector<MeshBlock> blocks = Wall(1.0, 300);
  const TrajectoryChange change({0, 1000}, {Pose3d(), Turn(0.3, {0.3, 0.2, 0.0})});
  const MovedMesh a = MoveMesh(Pointers(blocks), change, kBlockM);
  const MovedMesh b = MoveMesh(Pointers(blocks), change, kBlockM);
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (size_t i = 0; i < a.blocks.size(); ++i) {
    EXPECT_EQ(a.blocks[i].index, b.blocks[i].index);
    EXPECT_EQ(a.blocks[i].positions_map, b.blocks[i].positions_map);
    EXPECT_EQ(a.blocks[i].faces, b.blocks[i].faces);
  }
}

Node MakeObjectNode(const Pose3d& pose, TimeNs first_ns, TimeNs last_ns) {
  Node node;
  node.id = NodeId('O', 1);
  node.layer = layers::kObjects;
  node.kind = kinds::kObject;
  node.map_T_node = pose;
  node.box_node = Box3d(Eigen::Vector3d(-0.5, -0.5, -0.5), Eigen::Vector3d(0.5, 0.5, 0.5));
  node.first_observed_ns = first_ns;
  node.last_observed_ns = last_ns;
  node.object.emplace();
  node.object->model = Sha256{};
  node.object->map_T_model = pose * Turn(0.0, {0.0, 0.0, -0.5});
  return node;
}

TEST(MoveGraph, AnObjectAndItsModelMoveByWhenItWasSeen) {
  const Pose3d move = Turn(0.2, {1.0, 2.0, 0.1});
  const TrajectoryChange change({0, 1000}, {Pose3d(), move});
  const Pose3d pose = Turn(1.0, {3.0, 4.0, 0.5});
  const LayerGraph moved = MoveGraph({{MakeObjectNode(pose, 1000, 1000)}, {}}, change, {}, {});
  const Node& node = moved.nodes.front();
  EXPECT_LT((node.map_T_node.position - move * pose.position).norm(), 1e-12);
  EXPECT_LT(AngleBetween(node.map_T_node.orientation, (move * pose).orientation), 1e-12);
  // The model stays where it was within the object.
  const Pose3d node_T_model = node.map_T_node.Inverse() * node.object->map_T_model;
  EXPECT_LT((node_T_model.position - Eigen::Vector3d(0.0, 0.0, -0.5)).norm(), 1e-12);
  EXPECT_EQ(node.box_node.sizes(), Eigen::Vector3d::Ones());

  const LayerGraph still = MoveGraph({{MakeObjectNode(pose, 0, 0)}, {}}, change, {}, {});
  EXPECT_EQ(still.nodes.front().map_T_node.position, pose.position);
}

TEST(MoveGraph, UprightThingsStayUprightAndOthersTilt) {
  const Pose3d tilt = {{0.0, 0.0, 0.3},
                       Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()))};
  const LayerGraph upright =
      MoveGraph({{MakeObjectNode(Turn(1.0, {3.0, 4.0, 0.5}), 0, 0)}, {}}, Rigid(tilt), {}, {});
  const Pose3d& stands = upright.nodes.front().map_T_node;
  EXPECT_NEAR((stands.orientation * Eigen::Vector3d::UnitZ()).z(), 1.0, 1e-12);
  EXPECT_LT((stands.position - tilt * Eigen::Vector3d(3.0, 4.0, 0.5)).norm(), 1e-9);
  Pose3d lying = Turn(0.0, {3.0, 4.0, 0.5});
  lying.orientation = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY());
  const LayerGraph leaning = MoveGraph({{MakeObjectNode(lying, 0, 0)}, {}}, Rigid(tilt), {}, {});
  EXPECT_LT(AngleBetween(leaning.nodes.front().map_T_node.orientation,
                         tilt.orientation * lying.orientation),
            1e-9);
}

Node MakeWall() {
  Node node;
  node.id = NodeId('S', 1);
  node.layer = layers::kStructures;
  node.kind = kinds::kStructure;
  node.map_T_node.position = {2.0, 1.0, 1.0};
  node.box_node = Box3d(Eigen::Vector3d(-2.0, -0.05, -1.0), Eigen::Vector3d(2.0, 0.05, 1.0));
  node.structure = StructureInfo{"wall", Eigen::Vector3d::UnitY(), -1.0, 0};
  return node;
}

TEST(MoveGraph, AWallMovesWithItsMeshAndItsPlaneHoldsIt) {
  const Pose3d move = Turn(0.3, {1.0, 2.0, 0.1});
  const std::vector<MeshBlock> blocks = Wall(1.0, 500);
  const MovedMesh mesh = MoveMesh(Pointers(blocks), Rigid(move), kBlockM);
  const LayerGraph moved = MoveGraph({{MakeWall()}, {}}, Rigid(move), mesh.shift, {});
  const StructureInfo& plane = *moved.nodes.front().structure;
  for (const MeshBlock& block : mesh.blocks) {
    for (const Eigen::Vector3f& point : block.positions_map) {
      EXPECT_NEAR(plane.plane_normal_map.dot(point.cast<double>()) + plane.plane_offset_m, 0.0,
                  1e-4);
    }
  }
  EXPECT_LT(
      (moved.nodes.front().map_T_node.position - move * Eigen::Vector3d(2.0, 1.0, 1.0)).norm(),
      1e-6);
}

TEST(MoveGraph, RoomsTurnAndDoNotBend) {
  const Pose3d move = Turn(0.3, {1.0, 2.0, 0.1});
  const std::vector<MeshBlock> blocks = Wall(1.0, 500);
  const MovedMesh mesh = MoveMesh(Pointers(blocks), Rigid(move), kBlockM);
  const Node room = MakeRoom(1, 0.0, 0.0, 4.0, 3.0);
  const LayerGraph moved = MoveGraph({{room}, {}}, Rigid(move), mesh.shift, {});
  const RegionInfo& region = *moved.nodes.front().region;
  for (size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& corner = room.region->footprint_map[i];
    const Eigen::Vector3d expected = move * Eigen::Vector3d(corner.x(), corner.y(), 0.0);
    EXPECT_LT((region.footprint_map[i] - expected.head<2>()).norm(), 1e-6);
  }
  EXPECT_NEAR(region.z_min_m, 0.1, 1e-6);
  EXPECT_NEAR(region.z_max_m, 3.1, 1e-6);
}

TEST(MoveGraph, APlaceFarFromAnyMeshMovesAsTheRobotDidThere) {
  const TrajectoryChange change({0, 1000}, {Pose3d(), Turn(0.0, {0.0, 1.0, 0.0})});
  std::vector<TimedPose> robot(2);
  robot[0].time_ns = 0;
  robot[1].time_ns = 1000;
  robot[1].map_T_agent.position = {10.0, 0.0, 0.0};
  const LayerGraph moved =
      MoveGraph({{MakePlace(1, 0.5, 0.0), MakePlace(2, 9.0, 0.0)}, {}}, change, {}, robot);
  EXPECT_EQ(moved.nodes[0].map_T_node.position, Eigen::Vector3d(0.5, 0.0, 0.0));
  EXPECT_EQ(moved.nodes[1].map_T_node.position, Eigen::Vector3d(9.0, 1.0, 0.0));
}

TEST(MovePoses, MoveByTheirOwnTimeAndSayThatTheyWereCorrected) {
  const TrajectoryChange change({0, 1000}, {Pose3d(), Turn(kPi / 2.0, {0.0, 0.0, 1.0})});
  std::vector<TimedPose> poses(2);
  poses[0].time_ns = 0;
  poses[1].time_ns = 1000;
  poses[1].flags = pose_flags::kNoOrientation;
  poses[1].map_T_agent.position = {1.0, 0.0, 0.0};
  Covariance6 covariance{};
  covariance[0] = 4.0f;   // x
  covariance[6] = 1.0f;   // y
  covariance[3] = 0.5f;   // x with roll
  covariance[15] = 9.0f;  // roll
  poses[1].covariance = std::make_shared<Covariance6>(covariance);
  const std::vector<TimedPose> moved = MovePoses(poses, change, {});
  EXPECT_EQ(moved[0].map_T_agent.position, poses[0].map_T_agent.position);
  EXPECT_LT((moved[1].map_T_agent.position - Eigen::Vector3d(0.0, 1.0, 1.0)).norm(), 1e-12);
  EXPECT_EQ(moved[1].flags, pose_flags::kNoOrientation | pose_flags::kCorrected);
  EXPECT_NEAR((*moved[1].covariance)[0], 1.0f, 1e-6f);
  EXPECT_NEAR((*moved[1].covariance)[6], 4.0f, 1e-6f);
  EXPECT_NEAR((*moved[1].covariance)[8], 0.5f, 1e-6f);  // y with roll
  EXPECT_NEAR((*moved[1].covariance)[15], 9.0f, 1e-6f);
}

TEST(MovePoses, TakeTheCovarianceOfTheNearestKeyframe) {
  std::vector<TimedPose> poses(3);
  poses[1].time_ns = 400;
  poses[2].time_ns = 2000;
  MovePosesOptions options;
  options.keyframe_times = {0, 1000};
  options.covariances = {Covariance6{1.0f}, Covariance6{2.0f}};
  const std::vector<TimedPose> moved = MovePoses(poses, Rigid(Turn(0.1, {0, 0, 0})), options);
  EXPECT_EQ((*moved[0].covariance)[0], 1.0f);
  EXPECT_EQ(moved[0].covariance, moved[1].covariance);
  EXPECT_EQ((*moved[2].covariance)[0], 2.0f);
}

TEST(MovePoses, PeopleStayOnTheirFeet) {
  const Pose3d tilt = {{}, Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()))};
  const std::vector<TimedPose> poses(1);
  const std::vector<TimedPose> moved = MovePoses(poses, Rigid(tilt), {.is_kept_upright = true});
  EXPECT_NEAR((moved[0].map_T_agent.orientation * Eigen::Vector3d::UnitZ()).z(), 1.0, 1e-12);
}

TEST(MapShift, IsTheMeanOfWhatIsAround) {
  MapShift shift;
  Random random(5, 0);
  const Pose3d move = Turn(0.2, {1.0, -1.0, 0.3});
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d point(random.Uniform(0.0, 4.0), random.Uniform(0.0, 4.0), 1.0);
    shift.Add(point, move * point, 0.2);
  }
  const Box3d box(Eigen::Vector3d(1.0, 1.0, 0.5), Eigen::Vector3d(2.0, 2.0, 1.5));
  const auto around = shift.Around(box);
  ASSERT_TRUE(around.has_value());
  EXPECT_LT((*around * box.center() - move * box.center()).norm(), 1e-9);
  EXPECT_FALSE(shift.Around(Box3d(Eigen::Vector3d(50.0, 0.0, 0.0))).has_value());
}

}  // namespace
}  // namespace dsg::ingest
