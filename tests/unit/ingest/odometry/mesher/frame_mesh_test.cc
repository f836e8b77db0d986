// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/mesher/frame_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/unit/ingest/odometry/mesher/made_landmarks.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

MesherOptions WithoutRules() {
  MesherOptions options;
  options.farthest_m = options.edge_m_max = options.depth_ratio_max = 1000.0;
  options.aspect_min = options.facing_min = 0.0;
  return options;
}

FrameMesh MeshOf(const std::vector<SeenLandmark>& landmarks, const MesherOptions& options,
                 const std::vector<uint8_t>& mask = {}) {
  absl::StatusOr<FrameMesh> mesh =
      MakeFrameMesh(MeshCamera(), LookingAlongX(), landmarks, mask, options);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : FrameMesh();
}

double TurnOf(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

// Andrew's monotone chain.
double HullArea(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  double area = 0.0;
  for (int side = 0; side < 2; ++side) {
    std::vector<Vector2d> chain;
    for (const Vector2d& point : points) {
      while (chain.size() > 1 && TurnOf(chain[chain.size() - 2], chain.back(), point) <= 0.0) {
        chain.pop_back();
      }
      chain.push_back(point);
    }
    for (size_t i = 1; i < chain.size(); ++i) {
      area += 0.5 * (chain[i - 1].x() * chain[i].y() - chain[i - 1].y() * chain[i].x());
    }
    std::reverse(points.begin(), points.end());
  }
  return area;
}

TEST(FrameMesh, LiesOnAPlane) {
  const Vector3d normal = Vector3d(1.0, 0.3, -0.2).normalized();
  const auto landmarks = LandmarksOn(Plane(normal, 3.0), MeshCamera(), LookingAlongX(), 300);
  const FrameMesh mesh = MeshOf(landmarks, MesherOptions());
  EXPECT_GT(mesh.triangles.size(), 400u);
  const auto by_id = ById(landmarks);
  for (const MeshTriangle& triangle : mesh.triangles) {
    const Vector3d a = by_id.at(triangle[0]).position_odom;
    const Vector3d b = by_id.at(triangle[1]).position_odom;
    const Vector3d c = by_id.at(triangle[2]).position_odom;
    for (const Vector3d& point : {a, b, c, Vector3d((a + b + c) / 3.0)}) {
      EXPECT_NEAR(normal.dot(point), 3.0, 1e-9);
    }
    // The camera is at the origin, on the side that the plane's normal points away from.
    EXPECT_LT((b - a).cross(c - a).dot(normal), 0.0);
  }
}

TEST(FrameMesh, IsTheDelaunayTriangulationOfTheImage) {
  const auto landmarks =
      LandmarksOn(Plane(Vector3d::UnitX(), 3.0), MeshCamera(), LookingAlongX(), 200);
  const FrameMesh mesh = MeshOf(landmarks, WithoutRules());
  std::vector<Vector2d> pixels;
  for (const SeenLandmark& landmark : landmarks) pixels.push_back(*landmark.pixel);
  double area = 0.0;
  for (const MeshTriangle& triangle : mesh.triangles) {
    const Vector2d a = pixels[static_cast<size_t>(triangle[0])];
    const Vector2d b = pixels[static_cast<size_t>(triangle[1])];
    const Vector2d c = pixels[static_cast<size_t>(triangle[2])];
    const double twice = TurnOf(a, b, c);
    area += 0.5 * std::abs(twice);
    const Vector2d ab = b - a;
    const Vector2d ac = c - a;
    const Vector2d centre = a + Vector2d(ac.y() * ab.squaredNorm() - ab.y() * ac.squaredNorm(),
                                         ab.x() * ac.squaredNorm() - ac.x() * ab.squaredNorm()) /
                                    (2.0 * twice);
    const double radius = (a - centre).norm();
    for (const Vector2d& pixel : pixels) {
      EXPECT_GT((pixel - centre).norm(), radius * (1.0 - 1e-4)) << "within the circle of three";
    }
  }
  const double hull = HullArea(pixels);
  EXPECT_LE(area, hull * (1.0 + 1e-6));
  EXPECT_GE(area, 0.98 * hull);
}

TEST(FrameMesh, FollowsTheWallsOfACorner) {
  // Walls at x = 3 and y = 1.5 that meet before the camera, on its left.
  const Scene corner = Nearest(Plane(Vector3d::UnitX(), 3.0), Plane(Vector3d::UnitY(), 1.5));
  const auto landmarks = LandmarksOn(corner, MeshCamera(), LookingAlongX(), 300);
  const FrameMesh mesh = MeshOf(landmarks, MesherOptions());
  const auto by_id = ById(landmarks);
  std::set<int> walls;
  double square_sum = 0.0;
  for (const MeshTriangle& triangle : mesh.triangles) {
    Vector3d middle = Vector3d::Zero();
    for (const int64_t id : triangle) middle += by_id.at(id).position_odom / 3.0;
    const double to_front = std::abs(middle.x() - 3.0);
    const double to_side = std::abs(middle.y() - 1.5);
    walls.insert(to_front < to_side ? 0 : 1);
    // A triangle across the corner cuts it by a part of its edges.
    EXPECT_LT(std::min(to_front, to_side), 0.5 * MesherOptions().edge_m_max);
    square_sum += std::pow(std::min(to_front, to_side), 2);
  }
  EXPECT_EQ(walls.size(), 2u);
  EXPECT_LT(std::sqrt(square_sum / static_cast<double>(mesh.triangles.size())), 0.05);
}

TEST(FrameMesh, BridgesNoDepthJump) {
  const Scene scene = Nearest(Board(2.0, 0.6, 0.4), Plane(Vector3d::UnitX(), 3.2));
  const auto landmarks = LandmarksOn(scene, MeshCamera(), LookingAlongX(), 300);
  const auto by_id = ById(landmarks);
  const auto bridges_of = [&](const MesherOptions& options) {
    const FrameMesh mesh = MeshOf(landmarks, options);
    EXPECT_GT(mesh.triangles.size(), 300u);
    return std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& triangle) {
      std::set<bool> near;
      for (const int64_t id : triangle) near.insert(by_id.at(id).position_odom.x() < 2.5);
      return near.size() == 2;
    });
  };
  EXPECT_EQ(bridges_of(MesherOptions()), 0);
  EXPECT_GT(bridges_of(WithoutRules()), 20);
  MesherOptions only_jump = WithoutRules();
  only_jump.depth_ratio_max = 1.3;
  EXPECT_EQ(bridges_of(only_jump), 0);
}

TEST(FrameMesh, DropsTrianglesByEachRule) {
  const Scene wall = Plane(Vector3d::UnitX(), 3.0);
  const auto at = [&](int64_t id, double column, double row) {
    return LandmarkAt(id, wall, MeshCamera(), LookingAlongX(), {column, row});
  };
  // 3 m away a pixel is 6.6 mm.
  EXPECT_EQ(MeshOf({at(0, 300, 200), at(1, 400, 200), at(2, 350, 280)}, {}).counts.kept, 1);
  EXPECT_EQ(MeshOf({at(0, 300, 200), at(1, 500, 200), at(2, 350, 280)}, {}).counts.long_edge, 1);
  EXPECT_EQ(MeshOf({at(0, 300, 200), at(1, 400, 200), at(2, 350, 209)}, {}).counts.thin, 1);
  // A floor 0.15 m below the camera.
  const Scene floor = Plane(-Vector3d::UnitZ(), 0.15);
  const auto on_floor = [&](int64_t id, double column, double row) {
    return LandmarkAt(id, floor, MeshCamera(), LookingAlongX(), {column, row});
  };
  MesherOptions options;
  options.facing_min = 0.05;
  const std::vector<SeenLandmark> low = {on_floor(0, 300, 263), on_floor(1, 400, 263),
                                         on_floor(2, 350, 269)};
  EXPECT_EQ(MeshOf(low, options).counts.kept, 1);
  EXPECT_EQ(MeshOf(low, MesherOptions()).counts.edge_on, 1);
}

TEST(FrameMesh, LeavesOutWhatTheMaskShows) {
  const CameraCalibration camera = MeshCamera();
  const auto landmarks = LandmarksOn(Plane(Vector3d::UnitX(), 3.0), camera, LookingAlongX(), 300);
  std::vector<uint8_t> mask(static_cast<size_t>(camera.width * camera.height), 0);
  // A person between the landmarks.
  const auto is_masked = [](double column, double row) {
    return column >= 340 && column <= 400 && row >= 100 && row <= 400;
  };
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      if (is_masked(column, row)) mask[static_cast<size_t>(row * camera.width + column)] = 1;
    }
  }
  const FrameMesh mesh = MeshOf(landmarks, MesherOptions(), mask);
  const FrameMesh whole = MeshOf(landmarks, MesherOptions());
  EXPECT_EQ(mesh.counts.kept + mesh.counts.masked, whole.counts.kept);
  EXPECT_GT(mesh.counts.masked, 10);
  EXPECT_GT(mesh.counts.kept, 300);
  const auto by_id = ById(landmarks);
  for (const MeshTriangle& triangle : mesh.triangles) {
    // Points of the triangle, a pixel from its border.
    for (int i = 1; i < 10; ++i) {
      for (int j = 1; i + j < 10; ++j) {
        const Vector2d at =
            0.1 * (i * *by_id.at(triangle[0]).pixel + j * *by_id.at(triangle[1]).pixel +
                   (10 - i - j) * *by_id.at(triangle[2]).pixel);
        EXPECT_FALSE(at.x() > 341 && at.x() < 399 && at.y() > 101 && at.y() < 399)
            << at.transpose();
      }
    }
  }
  const auto wrong = MakeFrameMesh(camera, LookingAlongX(), landmarks, std::vector<uint8_t>(7), {});
  EXPECT_EQ(wrong.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(FrameMesh, TakesLandmarksThatAreSeenBeforeTheCamera) {
  const Scene wall = Plane(Vector3d::UnitX(), 3.0);
  std::vector<SeenLandmark> landmarks;
  for (int i = 0; i < 8; ++i) {
    landmarks.push_back(LandmarkAt(i, wall, MeshCamera(), LookingAlongX(),
                                   {300.0 + 30.0 * (i % 3), 200.0 + 25.0 * i}));
  }
  landmarks[1].pixel.reset();
  // Enough while it is seen.
  landmarks[2].sight_count = 1;
  landmarks[3].position_odom.x() = -3.0;
  landmarks[4].position_odom.x() = 11.0;
  landmarks[5].position_odom.x() = NAN;
  const FrameMesh mesh = MeshOf(landmarks, MesherOptions());
  std::vector<int64_t> ids;
  for (const SeenLandmark& corner : mesh.corners) ids.push_back(corner.feature_id);
  EXPECT_EQ(ids, (std::vector<int64_t>{0, 2, 6, 7}));
  EXPECT_TRUE(MeshOf({}, MesherOptions()).triangles.empty());
  EXPECT_TRUE(MeshOf({landmarks[0], landmarks[6]}, MesherOptions()).triangles.empty());
}

TEST(FrameMesh, BearsLandmarksAtOnePixelOnALineAndOutsideTheImage) {
  const Scene wall = Plane(Vector3d::UnitX(), 3.0);
  std::vector<SeenLandmark> landmarks;
  for (int i = 0; i < 30; ++i) {
    landmarks.push_back(
        LandmarkAt(i, wall, MeshCamera(), LookingAlongX(), {100.0 + 10.0 * (i / 3), 200.0}));
  }
  EXPECT_TRUE(MeshOf(landmarks, WithoutRules()).triangles.empty());
  landmarks.push_back(LandmarkAt(30, wall, MeshCamera(), LookingAlongX(), {150.0, 280.0}));
  landmarks.push_back(LandmarkAt(31, wall, MeshCamera(), LookingAlongX(), {150.0, 2800.0}));
  landmarks.push_back(LandmarkAt(32, wall, MeshCamera(), LookingAlongX(), {NAN, 280.0}));
  const FrameMesh mesh = MeshOf(landmarks, WithoutRules());
  EXPECT_EQ(mesh.triangles.size(), 9u);
  for (const MeshTriangle& triangle : mesh.triangles) {
    EXPECT_EQ(*std::max_element(triangle.begin(), triangle.end()), 30);
  }
}

TEST(FrameMesh, GivesTheSameMeshTwice) {
  const auto landmarks =
      LandmarksOn(Plane(Vector3d::UnitX(), 3.0), MeshCamera(), LookingAlongX(), 300);
  const FrameMesh a = MeshOf(landmarks, MesherOptions());
  const FrameMesh b = MeshOf(landmarks, MesherOptions());
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_TRUE(std::is_sorted(a.triangles.begin(), a.triangles.end()));
}

}  // namespace
}  // namespace dsg::ingest
