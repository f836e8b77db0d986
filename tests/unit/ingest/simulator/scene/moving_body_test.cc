// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "ingest/simulator/scene/renderer.h"
#include "ingest/simulator/scene/shapes.h"
#include "tests/unit/ingest/simulator/scene/views.h"

namespace dsg::simulator {
namespace {

// A wall far away, and a screen 1 m before the camera that hides what is to the left (y > 0).
Scene ScreenScene(bool with_screen) {
  Scene scene;
  Part wall;
  wall.class_id = 1;
  AddBox({9.0f, -30.0f, -30.0f}, {9.5f, 30.0f, 30.0f}, &wall.mesh);
  scene.parts.push_back(wall);
  if (with_screen) {
    Part screen;
    screen.class_id = 1;
    AddBox({1.0f, 0.0f, -5.0f}, {1.01f, 5.0f, 5.0f}, &screen.mesh);
    scene.parts.push_back(screen);
  }
  return scene;
}

TriangleMesh Person(const Eigen::Vector3f& middle) {
  TriangleMesh mesh;
  AddCutBox(middle - Eigen::Vector3f(0.2f, 0.25f, 0.8f),
            middle + Eigen::Vector3f(0.2f, 0.25f, 0.8f), 0.05f, &mesh);
  return mesh;
}

RenderedView Render(const Scene& scene, const TriangleMesh& mesh) {
  MovingBody body;
  body.mesh = &mesh;
  body.class_id = 90;
  body.instance = 3;
  const std::array<MovingBody, 1> bodies = {body};
  auto renderer = Renderer::Create(scene);
  EXPECT_TRUE(renderer.ok());
  return *(*renderer)->Render(LookFrom({0, 0, 0}, 0.0), ReferenceCamera(), bodies,
                              {true, false, true, true, true, true});
}

TEST(MovingBodies, CoverPixelsWithTheirLabelAndNoFace) {
  const TriangleMesh person = Person({4, 0, 0});
  const RenderedView view = Render(ScreenScene(false), person);
  const size_t middle = 240 * 720 + 360;
  EXPECT_EQ(view.label[middle], LabelValue(90, 3));
  EXPECT_EQ(view.face[middle], -1);
  EXPECT_NEAR(view.depth_m[middle], 3.8f, 1e-4f);
  const BodyCoverage& coverage = view.bodies[0];
  // Its sides stand 3.85 m away, behind the cut edges.
  const double half = 0.25 / 3.85 * 415.692;
  EXPECT_NEAR(coverage.column_min, 360.0 - half, 1.0);
  EXPECT_NEAR(coverage.column_max, 360.0 + half, 1.0);
  int count = 0;
  for (const uint16_t label : view.label) count += label == LabelValue(90, 3) ? 1 : 0;
  EXPECT_EQ(count, coverage.visible_pixel_count);
}

TEST(MovingBodies, AloneAndInFullViewShowAllOfThemselves) {
  const BodyCoverage coverage = Render(ScreenScene(false), Person({4, 0, 0})).bodies[0];
  EXPECT_NEAR(coverage.alone_pixel_count, coverage.visible_pixel_count,
              0.005 * coverage.alone_pixel_count);
  EXPECT_GT(coverage.VisibleFraction(), 0.995);
}

TEST(MovingBodies, HalfHiddenShowHalfOfThemselves) {
  const BodyCoverage coverage = Render(ScreenScene(true), Person({4, 0, 0})).bodies[0];
  EXPECT_NEAR(coverage.VisibleFraction(), 0.5, 0.02);
  EXPECT_GE(coverage.column_min, 360);
}

// What a camera of twice the width sees of a body is what the narrower one counts as alone.
TEST(MovingBodies, AcrossTheBorderAreCountedBeyondIt) {
  const float edge = 360.0f / 415.692f;
  const TriangleMesh person = Person({4, -4.0f * edge, 0});
  const BodyCoverage coverage = Render(ScreenScene(false), person).bodies[0];
  EXPECT_EQ(coverage.column_max, 719);
  EXPECT_GT(coverage.VisibleFraction(), 0.3);
  EXPECT_LT(coverage.VisibleFraction(), 0.7);
  auto wide = ReferenceCamera();
  wide.width *= 2;
  wide.cx *= 2.0;
  MovingBody body;
  body.mesh = &person;
  const std::array<MovingBody, 1> bodies = {body};
  const auto renderer = Renderer::Create(ScreenScene(false));
  ASSERT_TRUE(renderer.ok());
  const RenderedView view = *(*renderer)->Render(LookFrom({0, 0, 0}, 0.0), wide, bodies,
                                                 {false, false, false, false, false, true});
  EXPECT_NEAR(view.bodies[0].visible_pixel_count, coverage.alone_pixel_count,
              0.005 * coverage.alone_pixel_count);
}

TEST(MovingBodies, BehindTheCameraOrFarOutsideAreNotSeen) {
  for (const Eigen::Vector3f& at : {Eigen::Vector3f(-4, 0, 0), Eigen::Vector3f(1, 30, 0)}) {
    const BodyCoverage coverage = Render(ScreenScene(false), Person(at)).bodies[0];
    EXPECT_EQ(coverage.visible_pixel_count, 0);
    EXPECT_EQ(coverage.alone_pixel_count, 0);
    EXPECT_EQ(coverage.VisibleFraction(), 0.0);
  }
}

TEST(MovingBodies, AroundTheCameraAreCutAtItsPlane) {
  TriangleMesh floor;
  AddBox({-5, -5, -1.1f}, {5, 5, -1.0f}, &floor);
  const RenderedView view = Render(ScreenScene(false), floor);
  // Below the horizon, from where the floor ends 5 m ahead.
  EXPECT_EQ(view.label[470 * 720 + 360], LabelValue(90, 3));
  EXPECT_EQ(view.label[200 * 720 + 360], LabelValue(1, 0));
  EXPECT_GT(view.bodies[0].alone_pixel_count, view.bodies[0].visible_pixel_count);
}

// The texture is the body's own: moved by one image row's worth of metres, so is the picture.
TEST(MovingBodies, CarryTheirTextureAlong) {
  const TriangleMesh rest = Person({0, 0, 0});
  std::array<RenderedView, 2> views;
  const float pixel_m = 3.8f / 415.692f;
  for (int i = 0; i < 2; ++i) {
    TriangleMesh moved = rest;
    for (Eigen::Vector3f& vertex : moved.vertices) {
      vertex += Eigen::Vector3f(4.0f, -20.0f * pixel_m * static_cast<float>(i), 0.0f);
    }
    MovingBody body;
    body.mesh = &moved;
    body.texture_points = &rest.vertices;
    body.texture_seed = 9;
    const std::array<MovingBody, 1> bodies = {body};
    auto renderer = Renderer::Create(ScreenScene(false));
    ASSERT_TRUE(renderer.ok());
    views[i] = *(*renderer)->Render(LookFrom({0, 0, 0}, 0.0), ReferenceCamera(), bodies,
                                    {true, false, false, false, false, false});
  }
  double variation = 0.0;
  for (int column = 345; column < 375; ++column) {
    const size_t at = 240 * 720 + column;
    EXPECT_NEAR(views[0].gray[at], views[1].gray[at + 20], 0.01f);
    variation += std::abs(views[0].gray[at] - views[0].gray[at + 1]);
  }
  EXPECT_GT(variation, 0.1);
}

}  // namespace
}  // namespace dsg::simulator
