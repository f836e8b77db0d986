// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "ingest/simulator/scene/shapes.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/simulator/scene/views.h"

namespace dsg::simulator {
namespace {

constexpr ViewWants kEverything = {true, true, true, true, true, true};

Part MakePart(Material material, int class_id, int instance) {
  Part part;
  part.material = material;
  part.class_id = class_id;
  part.instance = instance;
  return part;
}

// A wall 3 m before a camera that looks along x.
Scene WallScene() {
  Scene scene;
  Part wall = MakePart(Material::kPlaster, 1, 0);
  AddBox({3.0f, -20.0f, -20.0f}, {3.5f, 20.0f, 20.0f}, &wall.mesh);
  scene.parts.push_back(wall);
  return scene;
}

RenderedView RenderOrDie(const Scene& scene, const Pose3d& pose, const ViewWants& wants) {
  auto renderer = Renderer::Create(scene);
  EXPECT_TRUE(renderer.ok()) << renderer.status();
  auto view = (*renderer)->Render(pose, ReferenceCamera(), {}, wants);
  EXPECT_TRUE(view.ok()) << view.status();
  return *std::move(view);
}

TEST(Renderer, MeasuresDepthAlongTheOpticalAxis) {
  const RenderedView view = RenderOrDie(WallScene(), LookFrom({0, 0, 0}, 0.0), kEverything);
  for (const float depth : view.depth_m) ASSERT_NEAR(depth, 3.0f, 1e-4f);
  // Turned by 0.3 rad about the vertical: each column has its own depth.
  const RenderedView turned = RenderOrDie(WallScene(), LookFrom({0, 0, 0}, 0.3), kEverything);
  const auto camera = ReferenceCamera();
  for (int column = 0; column < camera.width; column += 7) {
    const double x = (column - camera.cx) / camera.fx;
    // Directions to the right turn back towards the wall's normal.
    const double expected = 3.0 / (std::cos(0.3) + x * std::sin(0.3));
    ASSERT_NEAR(turned.depth_m[100 * 720 + column], expected, 1e-4);
  }
}

TEST(Renderer, NamesWhatItSees) {
  Scene scene = WallScene();
  Part box = MakePart(Material::kWood, 20, 7);
  AddBox({2.0f, -0.25f, -0.25f}, {2.2f, 0.25f, 0.25f}, &box.mesh);
  scene.parts.push_back(box);
  const RenderedView view = RenderOrDie(scene, LookFrom({0, 0, 0}, 0.0), kEverything);
  const size_t middle = 240 * 720 + 360;
  EXPECT_EQ(view.label[middle], LabelValue(20, 7));
  EXPECT_GE(view.face[middle], 12);
  EXPECT_LT(view.face[middle], 24);
  EXPECT_NEAR(view.incidence_cos[middle], 1.0f, 1e-5f);
  EXPECT_EQ(view.label[0], LabelValue(1, 0));
  EXPECT_LT(view.face[0], 12);
}

TEST(Renderer, SeesNothingWhereNothingIs) {
  const RenderedView view = RenderOrDie(WallScene(), LookFrom({0, 0, 0}, 3.1), kEverything);
  EXPECT_EQ(view.depth_m[0], 0.0f);
  EXPECT_EQ(view.label[0], 0);
  EXPECT_EQ(view.face[0], -1);
}

TEST(Renderer, LooksThroughGlass) {
  Scene scene = WallScene();
  const RenderedView before = RenderOrDie(scene, LookFrom({0, 0, 0}, 0.0), kEverything);
  Part pane = MakePart(Material::kGlass, 4, 0);
  pane.color = {255, 255, 255, 255};
  AddBox({1.0f, -5.0f, -5.0f}, {1.02f, 5.0f, 5.0f}, &pane.mesh);
  scene.parts.insert(scene.parts.begin(), pane);
  const RenderedView after = RenderOrDie(scene, LookFrom({0, 0, 0}, 0.0), kEverything);
  EXPECT_EQ(before.depth_m, after.depth_m);
  EXPECT_EQ(before.label, after.label);
  EXPECT_EQ(after.face[0], before.face[0] + 12);
  EXPECT_NE(before.gray, after.gray);
}

TEST(Renderer, SmoothsColoursAtEdgesButNotDepth) {
  Scene scene = WallScene();
  scene.parts[0].material = Material::kBlank;
  scene.parts[0].color = {200, 200, 200, 255};
  Part box = MakePart(Material::kBlank, 20, 1);
  box.color = {0, 0, 0, 255};
  AddBox({2.0f, -0.333f, -0.333f}, {2.2f, 0.333f, 0.333f}, &box.mesh);
  Transform(Eigen::Affine3f(Eigen::AngleAxisf(0.2f, Eigen::Vector3f::UnitX())), &box.mesh);
  scene.parts.push_back(box);
  const RenderedView view = RenderOrDie(scene, LookFrom({0, 0, 0}, 0.0), kEverything);
  ViewWants plain;
  plain.gray = false;
  plain.depth = true;
  const RenderedView depth_only = RenderOrDie(scene, LookFrom({0, 0, 0}, 0.0), plain);
  EXPECT_EQ(view.depth_m, depth_only.depth_m);
  int mixed = 0;
  for (size_t i = 0; i < view.gray.size(); ++i) {
    const bool is_near = view.depth_m[i] < 2.5f;
    ASSERT_NEAR(view.depth_m[i], is_near ? 2.0f : 3.0f, 1e-4f);
    mixed += view.gray[i] > 0.05f && view.gray[i] < 0.4f ? 1 : 0;
  }
  EXPECT_GT(mixed, 200);
}

TEST(Renderer, DrawsTheSameTwiceAndInThreads) {
  const auto world = GenerateWorld({WorldKind::kApartment, 5});
  ASSERT_TRUE(world.ok());
  const Scene scene = BuildScene(*world, {});
  const auto first = Renderer::Create(scene);
  const auto second = Renderer::Create(scene);
  ASSERT_TRUE(first.ok() && second.ok());
  TriangleMesh ball;
  AddTurned({{0.0f, 0.0f}, {0.3f, 0.2f}, {0.25f, 1.5f}, {0.0f, 1.7f}}, {0, 0, 0},
            Eigen::Vector2f::Ones(), 24, &ball);
  const Pose3d pose = TourViews(*world, 3)[1];
  Transform(
      Eigen::Affine3f(Eigen::Translation3f((pose * Eigen::Vector3d(0.2, 0.5, 1.5)).cast<float>())),
      &ball);
  MovingBody body;
  body.mesh = &ball;
  body.class_id = 90;
  body.instance = 1;
  const std::array<MovingBody, 1> bodies = {body};
  const auto render = [&](const Renderer& renderer) {
    return *renderer.Render(pose, ReferenceCamera(), bodies, kEverything);
  };
  const RenderedView reference = render(**first);
  EXPECT_GT(reference.bodies[0].visible_pixel_count, 100);
  std::vector<RenderedView> others(3);
  std::thread one([&] { others[0] = render(**first); });
  std::thread two([&] { others[1] = render(**first); });
  one.join();
  two.join();
  others[2] = render(**second);
  for (const RenderedView& other : others) {
    EXPECT_EQ(other.rgb, reference.rgb);
    EXPECT_EQ(other.gray, reference.gray);
    EXPECT_EQ(other.depth_m, reference.depth_m);
    EXPECT_EQ(other.label, reference.label);
    EXPECT_EQ(other.face, reference.face);
  }
}

// Points on the surface land where the depth image has them.
TEST(Renderer, ProjectsTheScenesOwnVerticesOntoItsDepth) {
  const auto world = GenerateWorld({WorldKind::kWing, 2});
  ASSERT_TRUE(world.ok());
  const Scene scene = BuildScene(*world, {});
  const auto renderer = Renderer::Create(scene);
  ASSERT_TRUE(renderer.ok());
  const auto camera = ReferenceCamera();
  const Pose3d pose = TourViews(*world, 5)[3];
  const RenderedView view = *(*renderer)->Render(pose, camera, {}, kEverything);
  std::vector<const Part*> owners;
  std::vector<std::array<uint32_t, 3>> faces;
  for (const Part& part : scene.parts) {
    for (const auto& face : part.mesh.faces) {
      owners.push_back(&part);
      faces.push_back(face);
    }
  }
  const Pose3d camera_T_map = pose.Inverse();
  int checked = 0;
  for (int row = 3; row < 480; row += 11) {
    for (int column = 3; column < 720; column += 11) {
      const int32_t face = view.face[row * 720 + column];
      ASSERT_GE(face, 0);
      const Part& part = *owners[face];
      EXPECT_EQ(view.label[row * 720 + column], LabelValue(part.class_id, part.instance));
      // The plane of the face, cut by the pixel's ray.
      std::array<Eigen::Vector3d, 3> corners;
      for (int i = 0; i < 3; ++i) {
        corners[i] = camera_T_map * part.mesh.vertices[faces[face][i]].cast<double>();
      }
      const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
      const Eigen::Vector3d ray((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy,
                                1.0);
      if (std::abs(normal.normalized().dot(ray.normalized())) < 0.05) continue;
      const double depth = normal.dot(corners[0]) / normal.dot(ray);
      EXPECT_NEAR(view.depth_m[row * 720 + column], depth, 2e-4 * depth);
      ++checked;
    }
  }
  EXPECT_GT(checked, 1500);
}

TEST(Renderer, LeavesNoHolesInABuilding) {
  for (const WorldKind kind : {WorldKind::kApartment, WorldKind::kWing, WorldKind::kOffice}) {
    const auto world = GenerateWorld({kind, 4});
    ASSERT_TRUE(world.ok());
    const auto renderer = Renderer::Create(BuildScene(*world, {}));
    ASSERT_TRUE(renderer.ok());
    auto camera = ReferenceCamera();
    ViewWants wants;
    wants.gray = false;
    wants.depth = true;
    int holes = 0;
    for (const Pose3d& pose : TourViews(*world, 12)) {
      const RenderedView view = *(*renderer)->Render(pose, camera, {}, wants);
      for (const float depth : view.depth_m) holes += depth == 0.0f ? 1 : 0;
    }
    EXPECT_EQ(holes, 0);
  }
}

TEST(Renderer, RefusesWhatItCannotRender) {
  EXPECT_EQ(ReasonOf(Renderer::Create(Scene()).status()), Reason::kFieldInvalid);
  Scene broken = WallScene();
  broken.parts[0].mesh.faces[0][1] = 1000;
  EXPECT_EQ(ReasonOf(Renderer::Create(broken).status()), Reason::kFieldInvalid);
  Scene homeless = WallScene();
  homeless.parts[0].room = 3;
  EXPECT_EQ(ReasonOf(Renderer::Create(homeless).status()), Reason::kFieldInvalid);

  const auto renderer = Renderer::Create(WallScene());
  ASSERT_TRUE(renderer.ok());
  const Pose3d pose = LookFrom({0, 0, 0}, 0.0);
  auto camera = ReferenceCamera();
  camera.distortion = ingest::Distortion::kRadialTangential;
  camera.distortion_coefficients = {0.1, 0.0, 0.0, 0.0};
  EXPECT_EQ(ReasonOf((*renderer)->Render(pose, camera, {}, {}).status()), Reason::kFieldInvalid);
  camera = ReferenceCamera();
  camera.width = -3;
  EXPECT_EQ(ReasonOf((*renderer)->Render(pose, camera, {}, {}).status()), Reason::kFieldInvalid);
  Pose3d nowhere = pose;
  nowhere.position.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ReasonOf((*renderer)->Render(nowhere, ReferenceCamera(), {}, {}).status()),
            Reason::kFieldInvalid);
  const std::array<MovingBody, 1> bodies = {};
  EXPECT_EQ(ReasonOf((*renderer)->Render(pose, ReferenceCamera(), bodies, {}).status()),
            Reason::kFieldInvalid);
}

TEST(Renderer, TakesImagesWhoseSidesDoNotFitItsPackets) {
  const auto renderer = Renderer::Create(WallScene());
  ASSERT_TRUE(renderer.ok());
  auto camera = ReferenceCamera();
  camera.width = 5;
  camera.height = 3;
  camera.cx = 2.0;
  camera.cy = 1.0;
  const auto view = (*renderer)->Render(LookFrom({0, 0, 0}, 0.0), camera, {}, kEverything);
  ASSERT_TRUE(view.ok());
  ASSERT_EQ(view->depth_m.size(), 15u);
  for (const float depth : view->depth_m) EXPECT_NEAR(depth, 3.0f, 1e-4f);
}

}  // namespace
}  // namespace dsg::simulator
