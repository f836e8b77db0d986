// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/mesher/multi_frame_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/unit/ingest/odometry/mesher/made_landmarks.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr TimeNs kKeyframeNs = 300'000'000;

MultiFrameMesh EmptyMesh(const MesherOptions& options = {}) {
  auto mesh = MultiFrameMesh::Make(MeshCamera(), options);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

void AddTo(MultiFrameMesh* mesh, int keyframe, const std::vector<SeenLandmark>& landmarks,
           const Pose3d& odom_T_camera = LookingAlongX()) {
  const absl::Status status = mesh->Add(keyframe * kKeyframeNs, odom_T_camera, landmarks, {});
  EXPECT_TRUE(status.ok()) << status;
}

std::optional<Vector3d> PositionOf(const ObstacleMesh& mesh, int64_t id) {
  for (size_t i = 0; i < mesh.feature_ids.size(); ++i) {
    if (mesh.feature_ids[i] == id) return mesh.vertices_odom[i];
  }
  return std::nullopt;
}

// Three landmarks 3 m away.
std::vector<SeenLandmark> OneTriangle() {
  const Scene wall = Plane(Vector3d::UnitX(), 3.0);
  const auto at = [&](int64_t id, double column, double row) {
    return LandmarkAt(id, wall, MeshCamera(), LookingAlongX(), {column, row});
  };
  return {at(0, 300, 200), at(1, 400, 200), at(2, 350, 280)};
}

std::vector<SeenLandmark> OutOfSight(std::vector<SeenLandmark> landmarks) {
  for (SeenLandmark& landmark : landmarks) landmark.pixel.reset();
  return landmarks;
}

TEST(MultiFrameMesh, MovesVerticesWithTheirLandmarks) {
  MultiFrameMesh mesh = EmptyMesh();
  std::vector<SeenLandmark> landmarks = OneTriangle();
  AddTo(&mesh, 0, landmarks);
  ASSERT_EQ(mesh.Mesh().faces.size(), 1u);
  // Out of sight, and estimated better meanwhile.
  landmarks = OutOfSight(landmarks);
  landmarks[1].position_odom += Vector3d(0.1, 0.02, -0.03);
  AddTo(&mesh, 1, landmarks);
  const ObstacleMesh after = mesh.Mesh();
  ASSERT_EQ(after.faces.size(), 1u);
  for (const SeenLandmark& landmark : landmarks) {
    const std::optional<Vector3d> position = PositionOf(after, landmark.feature_id);
    ASSERT_TRUE(position.has_value());
    EXPECT_EQ((*position - landmark.position_odom).norm(), 0.0);
  }
  // Too long now.
  landmarks[1].position_odom.y() -= 2.0;
  AddTo(&mesh, 2, landmarks);
  EXPECT_EQ(mesh.triangle_count(), 0u);
  EXPECT_EQ(mesh.vertex_count(), 0u);
}

TEST(MultiFrameMesh, EndsTrianglesWithTheirLandmarks) {
  for (const double horizon_s : {0.0, 1.0}) {
    MesherOptions options;
    options.horizon_ns = std::llround(1e9 * horizon_s);
    MultiFrameMesh mesh = EmptyMesh(options);
    std::vector<SeenLandmark> landmarks = OutOfSight(OneTriangle());
    AddTo(&mesh, 0, OneTriangle());
    AddTo(&mesh, 10, landmarks);
    EXPECT_EQ(mesh.triangle_count(), 1u) << "the window still has all landmarks";
    landmarks.pop_back();
    AddTo(&mesh, 11, landmarks);
    EXPECT_EQ(mesh.triangle_count(), horizon_s > 0.0 ? 1u : 0u);
    AddTo(&mesh, 13, landmarks);
    EXPECT_EQ(mesh.triangle_count(), horizon_s > 0.0 ? 1u : 0u);
    AddTo(&mesh, 14, landmarks);
    EXPECT_EQ(mesh.triangle_count(), 0u);
    EXPECT_EQ(mesh.vertex_count(), 0u);
  }
}

TEST(MultiFrameMesh, ForgetsOutOfSightWhatOneKeyframeHasSeen) {
  for (const int sight_count : {1, 2}) {
    MultiFrameMesh mesh = EmptyMesh();
    std::vector<SeenLandmark> landmarks = OneTriangle();
    landmarks[1].sight_count = sight_count;
    AddTo(&mesh, 0, landmarks);
    EXPECT_EQ(mesh.triangle_count(), 1u);
    AddTo(&mesh, 1, landmarks);
    EXPECT_EQ(mesh.triangle_count(), 1u);
    AddTo(&mesh, 2, OutOfSight(landmarks));
    EXPECT_EQ(mesh.triangle_count(), sight_count > 1 ? 1u : 0u);
  }
}

TEST(MultiFrameMesh, EndsTrianglesThatALandmarkIsSeenThrough) {
  const std::vector<SeenLandmark> corners = OneTriangle();
  const auto count_with = [&](double x, const Vector2d& pixel, int through_percent) {
    MesherOptions options;
    options.through_ratio_min = 0.01 * through_percent;
    MultiFrameMesh mesh = EmptyMesh(options);
    AddTo(&mesh, 0, corners);
    std::vector<SeenLandmark> landmarks = OutOfSight(corners);
    landmarks.push_back(
        LandmarkAt(7, Plane(Vector3d::UnitX(), x), MeshCamera(), LookingAlongX(), pixel));
    AddTo(&mesh, 1, landmarks);
    return mesh.triangle_count();
  };
  EXPECT_EQ(count_with(5.0, {350, 220}, 120), 0u);
  EXPECT_EQ(count_with(5.0, {350, 220}, 200), 1u);
  // On it but for noise, before it, beside it.
  EXPECT_EQ(count_with(3.3, {350, 220}, 120), 1u);
  EXPECT_EQ(count_with(1.5, {350, 220}, 120), 1u);
  EXPECT_EQ(count_with(5.0, {310, 270}, 120), 1u);
}

TEST(MultiFrameMesh, RenewsWhatTheNewestKeyframeSeesWhole) {
  for (const int is_renewed : {0, 1}) {
    MesherOptions options;
    options.is_renewed = is_renewed;
    MultiFrameMesh mesh = EmptyMesh(options);
    std::vector<SeenLandmark> landmarks = OneTriangle();
    AddTo(&mesh, 0, landmarks);
    // Within the triangle, on the same wall.
    landmarks.push_back(
        LandmarkAt(7, Plane(Vector3d::UnitX(), 3.0), MeshCamera(), LookingAlongX(), {350, 230}));
    AddTo(&mesh, 1, landmarks);
    EXPECT_EQ(mesh.triangle_count(), is_renewed != 0 ? 3u : 4u);
    // One corner out of sight: what was seen before stays.
    landmarks[0].pixel.reset();
    AddTo(&mesh, 2, landmarks);
    EXPECT_EQ(mesh.triangle_count(), is_renewed != 0 ? 3u : 4u);
    EXPECT_EQ(mesh.frame().triangles.size(), 1u);
  }
}

// A camera that goes along a wall for long; the window has what the last keyframes have seen.
TEST(MultiFrameMesh, StaysAsLargeAsTheWindow) {
  for (const int is_renewed : {0, 1}) {
    MesherOptions options;
    options.is_renewed = is_renewed;
    MultiFrameMesh mesh = EmptyMesh(options);
    const Scene wall = Plane(Vector3d::UnitX(), 3.0);
    constexpr int kWindow = 12;
    constexpr int kEach = 40;
    std::vector<SeenLandmark> window;
    size_t largest_early = 0;
    size_t largest_late = 0;
    for (int keyframe = 0; keyframe < 120; ++keyframe) {
      const Pose3d pose = LookingAlongX({0.0, -0.2 * keyframe, 0.0});
      for (SeenLandmark& landmark : window) {
        const Vector3d point = pose.Inverse() * landmark.position_odom;
        const Vector2d pixel(MeshCamera().cx + MeshCamera().fx * point.x() / point.z(),
                             MeshCamera().cy + MeshCamera().fy * point.y() / point.z());
        landmark.pixel.reset();
        if (pixel.x() > 0.0 && pixel.x() < 751.0) landmark.pixel = pixel;
      }
      for (SeenLandmark& landmark :
           LandmarksOn(wall, MeshCamera(), pose, kEach, int64_t{kEach} * keyframe)) {
        window.push_back(landmark);
      }
      const int64_t oldest = int64_t{kEach} * (keyframe + 1 - kWindow);
      std::erase_if(window, [&](const auto& landmark) { return landmark.feature_id < oldest; });
      AddTo(&mesh, keyframe, window, pose);
      EXPECT_GT(mesh.triangle_count(), 20u);
      EXPECT_LE(mesh.vertex_count(), window.size());
      size_t& largest = keyframe < 60 ? largest_early : largest_late;
      largest = std::max(largest, mesh.triangle_count());
      for (const Vector3d& vertex : mesh.Mesh().vertices_odom) EXPECT_NEAR(vertex.x(), 3.0, 1e-9);
    }
    EXPECT_LT(largest_late, largest_early + largest_early / 5);
  }
}

TEST(MultiFrameMesh, HasFacesOfItsVerticesOnly) {
  MultiFrameMesh mesh = EmptyMesh();
  AddTo(&mesh, 0, LandmarksOn(Plane(Vector3d::UnitX(), 3.0), MeshCamera(), LookingAlongX(), 300));
  const ObstacleMesh all = mesh.Mesh();
  EXPECT_EQ(all.vertices_odom.size(), mesh.vertex_count());
  EXPECT_EQ(all.faces.size(), mesh.triangle_count());
  EXPECT_EQ(all.faces.size(), mesh.frame().triangles.size());
  EXPECT_TRUE(std::is_sorted(all.feature_ids.begin(), all.feature_ids.end()));
  std::vector<bool> is_used(all.vertices_odom.size(), false);
  for (const auto& face : all.faces) {
    for (const uint32_t index : face) is_used.at(index) = true;
  }
  EXPECT_EQ(std::count(is_used.begin(), is_used.end(), false), 0);
}

TEST(MultiFrameMesh, GivesTheSameMeshTwice) {
  const auto mesh_of = [] {
    MultiFrameMesh mesh = EmptyMesh();
    const Scene scene = Nearest(Board(2.0, 0.6, 0.4), Plane(Vector3d::UnitX(), 3.2));
    for (int keyframe = 0; keyframe < 5; ++keyframe) {
      const Pose3d pose = LookingAlongX({0.0, 0.1 * keyframe, 0.0});
      AddTo(&mesh, keyframe, LandmarksOn(scene, MeshCamera(), pose, 200, 150 * keyframe), pose);
    }
    return mesh.Mesh();
  };
  const ObstacleMesh a = mesh_of();
  const ObstacleMesh b = mesh_of();
  EXPECT_EQ(a.feature_ids, b.feature_ids);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_TRUE(a.vertices_odom == b.vertices_odom);
}

TEST(MultiFrameMesh, RefusesKeyframesOutOfOrderAndOptionsOutOfRange) {
  MultiFrameMesh mesh = EmptyMesh();
  AddTo(&mesh, 1, OneTriangle());
  const absl::Status late = mesh.Add(kKeyframeNs, LookingAlongX(), OneTriangle(), {});
  EXPECT_EQ(late.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(mesh.triangle_count(), 1u);
  MesherOptions options;
  options.depth_ratio_max = 0.9;
  const auto refused = MultiFrameMesh::Make(MeshCamera(), options);
  EXPECT_NE(refused.status().message().find("odometry-mesh-jump"), std::string::npos);
}

}  // namespace
}  // namespace dsg::ingest
