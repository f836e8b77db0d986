// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "ingest/simulator/scene/scene.h"
#include "ingest/simulator/scene/shapes.h"

namespace dsg::simulator {
namespace {

/// Sizes as the catalogue has them, by class; others get some box.
Eigen::Vector3d SizeOf(const std::string& class_name) {
  if (class_name == "couch") return {1.9, 0.85, 0.8};
  if (class_name == "cup") return {0.08, 0.08, 0.1};
  if (class_name == "book") return {0.22, 0.16, 0.03};
  if (class_name == "phone") return {0.08, 0.16, 0.01};
  if (class_name == "shelf") return {1.2, 0.36, 1.9};
  if (class_name == "bed") return {1.6, 2.04, 0.55};
  return {0.9, 0.5, 0.75};
}

class FurnitureModel : public testing::TestWithParam<std::string> {};

TEST_P(FurnitureModel, FillsItsBoxAndStaysInside) {
  const Eigen::Vector3d size = SizeOf(GetParam());
  const TriangleMesh mesh = FurnitureMesh(GetParam(), size);
  const Eigen::AlignedBox3f bounds = BoundsOf(mesh);
  for (int axis = 0; axis < 3; ++axis) {
    const float half = static_cast<float>(0.5 * size[axis]);
    EXPECT_NEAR(bounds.min()[axis], -half, 0.05f * half);
    EXPECT_NEAR(bounds.max()[axis], half, 0.05f * half);
    EXPECT_GE(bounds.min()[axis], -half);
    EXPECT_LE(bounds.max()[axis], half);
  }
  EXPECT_GE(mesh.faces.size(), 40u);
  EXPECT_LE(mesh.faces.size(), 1000u);
  for (const Eigen::Vector3f& vertex : mesh.vertices) EXPECT_TRUE(vertex.allFinite());
}

std::vector<std::string> ObjectClasses() {
  std::vector<std::string> names;
  for (const SemanticLabel& label : Labels()) {
    if (label.id >= 10 && label.id < 90) names.push_back(label.name);
  }
  names.push_back("something unheard of");
  return names;
}

INSTANTIATE_TEST_SUITE_P(Catalogue, FurnitureModel, testing::ValuesIn(ObjectClasses()));

// Height of the surface above the floor, seen from above, averaged over a part of the footprint.
double MeanTop(const TriangleMesh& mesh, double y_min, double y_max) {
  double sum = 0.0;
  int count = 0;
  for (double x = -0.6; x <= 0.6; x += 0.05) {
    for (double y = y_min; y <= y_max; y += 0.02) {
      float top = -1e9f;
      for (const auto& face : mesh.faces) {
        const Eigen::Vector3f a = mesh.vertices[face[0]];
        const Eigen::Vector3f b = mesh.vertices[face[1]] - a;
        const Eigen::Vector3f c = mesh.vertices[face[2]] - a;
        const float area = b.x() * c.y() - b.y() * c.x();
        if (area == 0.0f) continue;
        const float px = static_cast<float>(x) - a.x();
        const float py = static_cast<float>(y) - a.y();
        const float u = (px * c.y() - py * c.x()) / area;
        const float v = (b.x() * py - b.y() * px) / area;
        if (u < 0.0f || v < 0.0f || u + v > 1.0f) continue;
        top = std::max(top, a.z() + u * b.z() + v * c.z());
      }
      if (top < -1e8f) continue;
      sum += top;
      ++count;
    }
  }
  return count > 0 ? sum / count : 0.0;
}

TEST(FurnitureModels, CouchTellsItsFrontFromItsBack) {
  const TriangleMesh couch = FurnitureMesh("couch", {1.9, 0.85, 0.8});
  EXPECT_GT(MeanTop(couch, -0.4, -0.25), MeanTop(couch, 0.1, 0.4) + 0.2);
}

TEST(FurnitureModels, CadModelStandsOnItsOrigin) {
  const TriangleMesh model = CadModel("couch", {1.9, 0.85, 0.8});
  const Eigen::AlignedBox3f bounds = BoundsOf(model);
  EXPECT_NEAR(bounds.min().z(), 0.0f, 1e-6f);
  EXPECT_NEAR(bounds.max().z(), 0.8f, 1e-6f);
  EXPECT_EQ(model.faces.size(), FurnitureMesh("couch", {1.9, 0.85, 0.8}).faces.size());
}

TEST(FurnitureModels, PoseTurnsTheFrontToTheLeft) {
  Furniture item;
  item.center = {1.0, 2.0, 0.5};
  for (int turns = 0; turns < 4; ++turns) {
    item.quarter_turns = turns;
    const Pose3d pose = FurniturePose(item);
    const double angle = 0.5 * std::numbers::pi * (turns + 1);
    const Eigen::Vector3d front = pose.orientation * Eigen::Vector3d::UnitY();
    EXPECT_NEAR(front.x(), std::cos(angle), 1e-12);
    EXPECT_NEAR(front.y(), std::sin(angle), 1e-12);
    EXPECT_TRUE(IsValidPose(pose));
  }
}

}  // namespace
}  // namespace dsg::simulator
