// SPDX-License-Identifier: Apache-2.0
// Lines of a map fall on the pixels that the camera model says, and end where a mesh hides them.
#include "ingest/overlay/camera_view.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/ingest/overlay/made_camera.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// At (1, 2, 1.5), looking along x of the map, its y down.
const Pose3d kMapTCamera{Vector3d(1, 2, 1.5), Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)};

// A wall across the view at x, y from `low` to `high`, of any height.
MeshBlock Wall(float x, float low, float high) {
  MeshBlock block;
  block.positions_map = {{x, low, -5.0f}, {x, high, -5.0f}, {x, high, 5.0f}, {x, low, 5.0f}};
  block.faces = {{0, 1, 2}, {2, 3, 0}};
  return block;
}

double LengthOf(const std::vector<ImageStroke>& strokes, bool is_hidden) {
  double length = 0.0;
  for (const ImageStroke& stroke : strokes) {
    if (stroke.is_hidden != is_hidden) continue;
    for (size_t i = 1; i < stroke.points_px.size(); ++i) {
      length += (stroke.points_px[i] - stroke.points_px[i - 1]).norm();
    }
  }
  return length;
}

TEST(CameraView, ProjectsLinesAsTheCameraDoes) {
  const CameraView view(MakeCamera(), kMapTCamera);
  // 4 m ahead, 1 m to the left and up: 50 pixels each.
  const auto strokes = view.StrokesOf({5, 3, 2.5}, {5, 1, 2.5});
  ASSERT_EQ(strokes.size(), 1u);
  EXPECT_FALSE(strokes[0].is_hidden);
  EXPECT_LT((strokes[0].points_px.front() - Vector2d(110, 70)).norm(), 1e-9);
  EXPECT_LT((strokes[0].points_px.back() - Vector2d(210, 70)).norm(), 1e-9);
}

TEST(CameraView, CutsLinesAtTheImageAndBehindTheCamera) {
  const CameraView view(MakeCamera(), kMapTCamera);
  EXPECT_TRUE(view.StrokesOf({-3, 1, 1.5}, {-3, 3, 1.5}).empty());
  EXPECT_TRUE(view.StrokesOf({5, 20, 1.5}, {5, 30, 1.5}).empty());
  // From behind, past the camera, into the image.
  for (const ImageStroke& stroke : view.StrokesOf({-3, 2.2, 1.2}, {9, 2.2, 1.2})) {
    for (const Vector2d& pixel : stroke.points_px) {
      EXPECT_TRUE(pixel.x() > -0.5 && pixel.x() < 319.5 && pixel.y() > -0.5 && pixel.y() < 239.5);
    }
  }
  const auto across = view.StrokesOf({5, -20, 1.5}, {5, 20, 1.5});
  ASSERT_EQ(across.size(), 1u);
  EXPECT_NEAR(LengthOf(across, false), 320.0, 6.0);
}

TEST(CameraView, BendsLinesAsTheLensDoes) {
  CameraCalibration camera = MakeCamera();
  camera.distortion = Distortion::kRadialTangential;
  camera.distortion_coefficients = {-0.2, 0.05, 0.001, -0.002};
  const CameraView view(camera, kMapTCamera);
  const Vector3d from(4, 3.5, 2.4);
  const Vector3d to(4, 0.5, 2.4);
  const auto strokes = view.StrokesOf(from, to);
  ASSERT_EQ(strokes.size(), 1u);
  const std::vector<Vector2d>& points = strokes[0].points_px;
  EXPECT_LT(
      (points[points.size() / 2] - Project(camera, kMapTCamera.Inverse() * (0.5 * (from + to))))
          .norm(),
      1e-6);
  // Straight lines would have their middle between their ends.
  EXPECT_GT(std::abs(points[points.size() / 2].y() - 0.5 * (points[0].y() + points.back().y())),
            2.0);
}

TEST(CameraView, HidesWhatIsBehindAMeshAndOnlyThat) {
  CameraView view(MakeCamera(), kMapTCamera);
  // To the left (y > 2) there is a wall 2 m ahead.
  view.AddMesh(Wall(3.0f, 2.0f, 9.0f));
  const auto behind = view.StrokesOf({5, 1, 1.5}, {5, 3, 1.5});
  EXPECT_NEAR(LengthOf(behind, true), 50.0, 4.0);
  EXPECT_NEAR(LengthOf(behind, false), 50.0, 4.0);
  for (const ImageStroke& stroke : behind) {
    for (const Vector2d& pixel : stroke.points_px) {
      EXPECT_TRUE(stroke.is_hidden ? pixel.x() < 163.0 : pixel.x() > 157.0);
    }
  }
  // On the wall, a little behind its face, and before it.
  EXPECT_EQ(LengthOf(view.StrokesOf({3.1, 2.2, 1.5}, {3.1, 3, 1.5}), true), 0.0);
  EXPECT_EQ(LengthOf(view.StrokesOf({2, 2.2, 1.5}, {2, 2.6, 1.5}), true), 0.0);
}

TEST(CameraView, TakesTheNearestOfSeveralFaces) {
  for (const bool is_far_first : {true, false}) {
    CameraView view(MakeCamera(), kMapTCamera);
    view.AddMesh(Wall(is_far_first ? 9.0f : 3.0f, -9.0f, 9.0f));
    view.AddMesh(Wall(is_far_first ? 3.0f : 9.0f, -9.0f, 9.0f));
    EXPECT_EQ(LengthOf(view.StrokesOf({5, 1, 1.5}, {5, 3, 1.5}), false), 0.0);
  }
}

}  // namespace
}  // namespace dsg::ingest
