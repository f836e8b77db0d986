// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "ingest/evaluation/surface.h"
#include "tests/unit/ingest/evaluation/boxes.h"

namespace dsg::evaluation {
namespace {

using test::kFloor;
using test::kWall;

constexpr uint32_t kTable = 3;

const MeshOptions& Options() {
  static const MeshOptions options = [] {
    MeshOptions out;
    out.sample_count = 30'000;
    return out;
  }();
  return options;
}

// A room of 6 x 4 x 3 m with a table.
MeshBlock Room() {
  MeshBlock mesh;
  test::AddBox(Box3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(6, 4, 3)), kWall, kFloor, &mesh);
  test::AddBox(Box3d(Eigen::Vector3d(1, 1, 0.3), Eigen::Vector3d(2.5, 2, 0.8)), kTable, kTable,
               &mesh);
  return mesh;
}

MeshResult EvaluateRoom(const MeshBlock& estimate, std::vector<uint8_t> observed = {}) {
  const MeshBlock truth = Room();
  if (observed.empty()) observed.assign(truth.faces.size(), 1);
  return EvaluateMesh(estimate, truth, observed, {}, Options());
}

TEST(Surface, SamplesByAreaAndAreFound) {
  const MeshBlock room = Room();
  const auto samples = SampleSurface(room, 20'000, 1);
  EXPECT_EQ(samples.size(), 20'000u);
  const double area = AreaOf(room);
  const auto on_floor = std::count_if(samples.begin(), samples.end(), [&room](const auto& sample) {
    return room.labels[room.faces[sample.face][0]] == kFloor;
  });
  EXPECT_NEAR(static_cast<double>(on_floor) / 20'000.0, 24.0 / area, 0.001);
  const Surface surface(&room, 20'000, 1);
  EXPECT_NEAR(surface.Nearest({3, 3, 1.4}).distance_m, 1.0, 1e-6);
  EXPECT_NEAR(surface.Nearest({1.5, 1.5, 1.0}).distance_m, 0.2, 1e-6);
  EXPECT_NEAR(surface.Nearest({7, 5, 3}).distance_m, std::sqrt(2.0), 1e-6);
}

TEST(Surface, FindsTheNearestPointOfATriangle) {
  const Eigen::Vector3d a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  EXPECT_TRUE(ClosestOnTriangle({0.5, 0.5, 3}, a, b, c).isApprox(Eigen::Vector3d(0.5, 0.5, 0)));
  EXPECT_TRUE(ClosestOnTriangle({2, 2, 0}, a, b, c).isApprox(Eigen::Vector3d(1, 1, 0)));
  EXPECT_TRUE(ClosestOnTriangle({3, -1, 1}, a, b, c).isApprox(b));
  EXPECT_LT((ClosestOnTriangle({-1, -1, 0}, a, b, c) - a).norm(), 1e-12);
  EXPECT_LT((ClosestOnTriangle({1, 5, 0}, a, a, a) - a).norm(), 1e-12);
}

TEST(MeshMetric, IsPerfectForTheTruthItself) {
  const MeshResult result = EvaluateRoom(Room());
  EXPECT_LT(*result.rmse_m, 1e-5);
  EXPECT_LT(*result.rmse_no_icp_m, 1e-5);
  EXPECT_DOUBLE_EQ(*result.completeness, 1.0);
  EXPECT_EQ(*result.ghost_m2, 0.0);
  EXPECT_GT(*result.miou, 0.98);
  EXPECT_DOUBLE_EQ(result.icp_inlier_share, 1.0);
}

TEST(MeshMetric, ShowsAShiftThatIcpHides) {
  // As fine as a reconstruction, so that there is something to register.
  MeshBlock shifted;
  const MeshBlock room = Room();
  for (const SurfaceSample& sample : SampleSurface(room, 20'000, 9)) {
    shifted.positions_map.push_back(sample.point_map + Eigen::Vector3f(0.3f, 0.0f, 0.0f));
  }
  const MeshResult result = EvaluateRoom(shifted);
  EXPECT_LT(*result.rmse_m, 0.05);
  EXPECT_GT(*result.rmse_no_icp_m, 0.12);
  EXPECT_FALSE(result.ghost_m2.has_value());
  EXPECT_FALSE(result.miou.has_value());
}

TEST(MeshMetric, ShowsARotationInEveryNumberThatDoesNotAlign) {
  MeshBlock turned = Room();
  const Eigen::AngleAxisf turn(0.3f, Eigen::Vector3f::UnitZ());
  for (auto& point : turned.positions_map) point = turn * point;
  const MeshResult result = EvaluateRoom(turned);
  EXPECT_GT(*result.rmse_no_icp_m, 0.3);
  EXPECT_LT(*result.completeness, 0.8);
  EXPECT_LT(*result.miou, 0.7);
}

TEST(MeshMetric, MeasuresAGhostWall) {
  MeshBlock haunted = Room();
  test::AddQuad({Eigen::Vector3f(4, 1, 0.5f), {4, 2, 0.5f}, {4, 2, 2.5f}, {4, 1, 2.5f}}, kWall,
                &haunted);
  const MeshResult result = EvaluateRoom(haunted);
  EXPECT_NEAR(*result.ghost_m2, 2.0, 0.05);
  EXPECT_GT(*result.rmse_no_icp_m, 0.1);
  EXPECT_DOUBLE_EQ(*result.completeness, 1.0);
}

TEST(MeshMetric, TellsGhostsInTheBuildingFromThoseOutside) {
  MeshBlock haunted = Room();
  test::AddQuad({Eigen::Vector3f(9, 1, 0.5f), {9, 2, 0.5f}, {9, 2, 2.5f}, {9, 1, 2.5f}}, kWall,
                &haunted);
  const MeshResult result = EvaluateRoom(haunted);
  EXPECT_EQ(*result.ghost_m2, 0.0);
  EXPECT_NEAR(*result.stray_m2, 2.0, 0.05);
  EXPECT_GT(*result.rmse_no_icp_m, 0.5);
}

TEST(MeshMetric, ShowsWhatIsMissingThroughCompleteness) {
  MeshBlock half = Room();
  std::erase_if(half.faces, [&half](const auto& face) {
    return half.labels[face[0]] == kFloor || half.labels[face[0]] == kTable;
  });
  const MeshResult result = EvaluateRoom(half);
  // 24 m^2 of floor and 5.5 of table less the strip of floor near the walls.
  EXPECT_NEAR(*result.completeness, 1.0 - 29.5 / AreaOf(Room()), 0.04);
  EXPECT_LT(*result.miou, 0.4);
}

TEST(MeshMetric, AsksOnlyForWhatWasSeen) {
  MeshBlock half = Room();
  std::vector<uint8_t> observed;
  for (const auto& face : half.faces) observed.push_back(half.labels[face[0]] == kWall ? 1 : 0);
  std::erase_if(half.faces, [&half](const auto& face) { return half.labels[face[0]] != kWall; });
  EXPECT_DOUBLE_EQ(*EvaluateRoom(half, observed).completeness, 1.0);
  EXPECT_FALSE(
      EvaluateRoom(half, std::vector<uint8_t>(observed.size(), 0)).completeness.has_value());
}

TEST(MeshMetric, ShowsAWrongClass) {
  MeshBlock wrong = Room();
  for (uint32_t& label : wrong.labels) label = label == kTable ? kWall : label;
  const MeshResult result = EvaluateRoom(wrong);
  // The table is lost, and walls gain what was the table.
  EXPECT_LT(*result.miou, 0.67);
  EXPECT_GT(*result.miou, 0.55);
}

TEST(MeshMetric, LeavesEverythingEmptyWithoutAMesh) {
  const MeshResult result = EvaluateRoom(MeshBlock());
  EXPECT_FALSE(result.rmse_m.has_value());
  EXPECT_FALSE(result.completeness.has_value());
  EXPECT_FALSE(result.ghost_m2.has_value());
}

}  // namespace
}  // namespace dsg::evaluation
