// SPDX-License-Identifier: Apache-2.0
// Bodies in pictures: where they are, in their colours, with faces that look at the eye.
#include "query/cli/export/body_view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "query/cli/export/exploded_view.h"
#include "query/cli/export/top_view.h"
#include "tests/unit/query/cli/example_content.h"

namespace dsg::cli {
namespace {

using picture::Picture;

constexpr uint32_t kGreen = 0x00ff00;

// A square metre at z = 1 that looks up, its middle at x, y.
Body Plate(TimeNs time_ns, float x, float y) {
  Body body;
  body.time_ns = time_ns;
  body.map_T_agent.position = Eigen::Vector3d(static_cast<double>(x), static_cast<double>(y), 1.0);
  body.points_map = {{x - 0.5f, y - 0.5f, 1},
                     {x + 0.5f, y - 0.5f, 1},
                     {x + 0.5f, y + 0.5f, 1},
                     {x - 0.5f, y + 0.5f, 1}};
  body.faces = std::make_shared<const BodyFaces>(BodyFaces{{0, 1, 2}, {0, 2, 3}});
  return body;
}

// A skeleton on a line upwards.
Body Pole(TimeNs time_ns, float x) {
  Body body;
  body.time_ns = time_ns;
  body.map_T_agent.position = Eigen::Vector3d(static_cast<double>(x), 0.0, 1.0);
  for (int joint = 0; joint < 24; ++joint) {
    body.joints_map.emplace_back(x, 0.0f, 0.08f * static_cast<float>(joint));
  }
  return body;
}

// Pixels that are greener than anything else in the picture.
int GreenCount(const Picture& picture) {
  int count = 0;
  for (size_t i = 0; i < picture.rgb.size(); i += 3) {
    count +=
        picture.rgb[i + 1] > picture.rgb[i] + 80 && picture.rgb[i + 1] > picture.rgb[i + 2] + 80;
  }
  return count;
}

// Columns between the first and the last pixel that is dark, in the rows of the drawing.
int DrawnColumns(const Picture& picture) {
  int first = picture.width;
  int last = -1;
  for (int y = 50; y < picture.height - 60; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const size_t i = 3 * static_cast<size_t>(y * picture.width + x);
      if (picture.rgb[i] + picture.rgb[i + 1] + picture.rgb[i + 2] > 480) continue;
      first = std::min(first, x);
      last = std::max(last, x);
    }
  }
  return last - first;
}

TEST(Body, HasOnlyTheFacesThatLookAtTheEye) {
  const Body plate = Plate(0, 0.0f, 0.0f);
  const std::vector<LitFace> lit = LitFaces(plate, kGreen, Eigen::Vector3d::UnitZ());
  ASSERT_EQ(lit.size(), 2U);
  EXPECT_NEAR(lit[0].paint.green, 1.0f, 1e-6f);
  EXPECT_TRUE(LitFaces(plate, kGreen, -Eigen::Vector3d::UnitZ()).empty());
  const Eigen::Vector3d aslant = Eigen::Vector3d(0.0, 1.0, 0.2).normalized();
  EXPECT_LT(LitFaces(plate, kGreen, aslant).at(0).paint.green, 0.7f);
  Body flat = plate;
  for (Eigen::Vector3f& point : flat.points_map) point = Eigen::Vector3f::Zero();
  EXPECT_TRUE(LitFaces(flat, kGreen, Eigen::Vector3d::UnitZ()).empty());
  Body bare = plate;
  bare.faces = nullptr;
  EXPECT_TRUE(LitFaces(bare, kGreen, Eigen::Vector3d::UnitZ()).empty());
  EXPECT_EQ(MeshOf(plate, kGreen).faces, *plate.faces);
  EXPECT_EQ(MeshOf(bare, kGreen).colors, std::vector<uint32_t>(4, kGreen));
}

TEST(Body, IsDrawnInMapsInsteadOfADot) {
  MapContent content = test::ExampleContent();
  content.mesh.clear();
  const int none = GreenCount(DrawTopView(content, {.width_px = 908, .title = ""}));
  content.bodies = {{.agent = NodeId('H', 1), .rgb = kGreen, .bodies = {Plate(0, 6.0f, 1.0f)}}};
  EXPECT_TRUE(HasBody(content, NodeId('H', 1)));
  EXPECT_FALSE(HasBody(content, NodeId('H', 2)));
  const Picture top = DrawTopView(content, {.width_px = 908, .title = ""});
  // The map of 8 m fills all but a margin of 30 pixels and 48 of the y axis: a metre is 100 pixels.
  EXPECT_NEAR(GreenCount(top) - none, 100 * 100, 600);
  const Picture exploded = DrawExplodedView(content, {.width_px = 800, .title = ""});
  content.bodies.clear();
  EXPECT_GT(GreenCount(exploded),
            GreenCount(DrawExplodedView(content, {.width_px = 800, .title = ""})) + 200);
}

TEST(BodyView, ShowsTheWayOfSkeletonsAndFits) {
  std::vector<Body> bodies;
  for (int i = 0; i <= 40; ++i) {
    bodies.push_back(Pole(i * kNsPerSecond / 4, 0.1f * static_cast<float>(i)));
  }
  const Picture picture = DrawBodies(bodies, {.width_px = 600, .title = "H1"});
  EXPECT_EQ(picture.width, 600);
  EXPECT_LE(picture.height, 1200);
  // The way of 4 m and the room about it of 0.6 m at each end fill the width.
  EXPECT_NEAR(DrawnColumns(picture), (600.0 - 60.0) * 4.0 / 5.2, 20.0);
  const Picture one = DrawBodies({Pole(5, 3.0f)}, {.width_px = 300, .title = "one"});
  EXPECT_EQ(one.width, 300);
  EXPECT_LE(one.height, kTopViewWidthMax);
  EXPECT_GT(DrawnColumns(one), 0);
}

TEST(BodyView, DrawsBodiesWithFacesOnly) {
  std::vector<Body> bodies = {Plate(0, 0.0f, 0.0f), Plate(kNsPerSecond, 3.0f, 0.0f)};
  const Picture with = DrawBodies(bodies, {.width_px = 400, .title = ""});
  for (Body& body : bodies) body.faces = nullptr;
  const Picture without = DrawBodies(bodies, {.width_px = 400, .title = ""});
  ASSERT_EQ(with.rgb.size(), without.rgb.size());
  int changed = 0;
  for (size_t i = 0; i < with.rgb.size(); i += 3) changed += with.rgb[i] != without.rgb[i];
  EXPECT_GT(changed, 1000);
}

}  // namespace
}  // namespace dsg::cli
