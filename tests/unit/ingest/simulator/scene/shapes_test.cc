// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/shapes.h"

#include <gtest/gtest.h>

namespace dsg::simulator {
namespace {

// Positive only if faces are counter-clockwise seen from outside.
double Volume(const TriangleMesh& mesh) {
  double volume = 0.0;
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[face[2]].cast<double>();
    volume += a.dot(b.cross(c)) / 6.0;
  }
  return volume;
}

double Area(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3f& a = mesh.vertices[face[0]];
    area += 0.5 * (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a).norm();
  }
  return area;
}

TEST(Shapes, BoxEnclosesItsVolumeFacingOutwards) {
  TriangleMesh box;
  AddBox({-1, 2, 3}, {1, 3, 7}, &box);
  EXPECT_EQ(box.faces.size(), 12u);
  EXPECT_NEAR(Volume(box), 8.0, 1e-5);
}

TEST(Shapes, CutBoxLosesItsEdgesOnly) {
  TriangleMesh box;
  AddCutBox({0, 0, 0}, {1, 1, 1}, 0.1f, &box);
  EXPECT_EQ(box.faces.size(), 44u);
  // Twelve prisms of half the square of the cut less what they share in eight corners.
  EXPECT_NEAR(Volume(box), 1.0 - 12 * 0.8 * 0.005 - 8 * 0.001 * 5.0 / 6.0, 1e-5);
}

TEST(Shapes, TurnedBodiesFaceOutwards) {
  TriangleMesh cylinder;
  AddCylinder({5, 6, 7}, 1.0f, 2.0f, 64, &cylinder);
  EXPECT_NEAR(Volume(cylinder), 2.0 * 3.14159, 0.02);
}

TEST(Shapes, SubdividingKeepsTheSurfaceAndBoundsTheEdges) {
  TriangleMesh box;
  AddBox({0, 0, 0}, {5, 3, 0.2f}, &box);
  const double area = Area(box);
  Subdivide(0.7f, &box);
  EXPECT_NEAR(Area(box), area, 1e-3);
  EXPECT_NEAR(Volume(box), 3.0, 1e-3);
  for (const auto& face : box.faces) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_LE((box.vertices[face[i]] - box.vertices[face[(i + 1) % 3]]).norm(), 0.7001f);
    }
  }
}

}  // namespace
}  // namespace dsg::simulator
