// SPDX-License-Identifier: Apache-2.0
// Bodies are plausible people, their bones are rigid and their skin is closed.
#include "ingest/simulator/body/body_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

ShapeCoefficients RandomShape(Random* random, double limit) {
  ShapeCoefficients shape;
  for (double& value : shape) value = std::clamp(random->Normal(), -limit, limit);
  return shape;
}

Posture RandomPosture(Random* random) {
  Posture posture;
  posture.pelvis_offset = {0.0, 0.01, -0.05};
  for (Eigen::Quaterniond& rotation : posture.rotations) {
    const Eigen::Vector3d turn(random->Normal(), random->Normal(), random->Normal());
    rotation = Eigen::AngleAxisd(0.5 * turn.norm(), turn.normalized());
  }
  return posture;
}

TEST(BodyModel, BonesKeepTheirLengthInAnyPosture) {
  Random random(1, 0);
  for (int i = 0; i < 50; ++i) {
    const BodyModel body(RandomShape(&random, 3.0));
    const auto rest = body.Joints(Posture());
    const auto bent = body.Joints(RandomPosture(&random));
    for (int j = 1; j < ingest::kJointCount; ++j) {
      const int parent = JointParents()[j];
      EXPECT_NEAR((bent[j] - bent[parent]).norm(), (rest[j] - rest[parent]).norm(), 1e-9);
    }
  }
}

TEST(BodyModel, HeightsAreThoseOfPeople) {
  Random random(2, 0);
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const double height = BodyModel(RandomShape(&random, 3.0)).height_m();
    EXPECT_GE(height, 1.45);
    EXPECT_LE(height, 2.05);
    sum += height;
    squares += height * height;
  }
  const double mean = sum / kCount;
  EXPECT_NEAR(mean, 1.72, 0.01);
  EXPECT_NEAR(std::sqrt(squares / kCount - mean * mean), 0.09, 0.01);
}

TEST(BodyModel, SkinReachesFromTheFloorToTheHeight) {
  Random random(3, 0);
  for (int i = 0; i < 20; ++i) {
    const BodyModel body(RandomShape(&random, 3.0));
    TriangleMesh mesh;
    body.Skin(Posture(), &mesh);
    double low = 10.0;
    double high = -10.0;
    for (const Eigen::Vector3f& vertex : mesh.vertices) {
      low = std::min<double>(low, vertex.z());
      high = std::max<double>(high, vertex.z());
    }
    EXPECT_NEAR(low + body.pelvis_height_m(), 0.0, 0.01);
    EXPECT_NEAR(high + body.pelvis_height_m(), body.height_m(), 0.03);
  }
}

TEST(BodyModel, SkinIsClosedAndFacesOutwards) {
  const BodyModel body{ShapeCoefficients()};
  TriangleMesh mesh;
  body.Skin(Posture(), &mesh);
  EXPECT_NEAR(static_cast<double>(mesh.vertices.size()), 1600.0, 100.0);
  EXPECT_NEAR(static_cast<double>(mesh.faces.size()), 3200.0, 200.0);
  // Each directed edge once, and its opposite once: closed, and wound alike.
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  double volume = 0.0;
  for (const auto& face : mesh.faces) {
    for (int k = 0; k < 3; ++k) ++edges[{face[k], face[(k + 1) % 3]}];
    const Eigen::Vector3f& a = mesh.vertices[face[0]];
    volume += a.dot(mesh.vertices[face[1]].cross(mesh.vertices[face[2]])) / 6.0;
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  // A person has about 70 litres; inside out it would be negative.
  EXPECT_GT(volume, 0.05);
  EXPECT_LT(volume, 0.10);
}

TEST(BodyModel, EveryLimbFacesOutwards) {
  const BodyModel body{ShapeCoefficients()};
  TriangleMesh mesh;
  body.Skin(Posture(), &mesh);
  const std::vector<uint8_t>& joints = BodyModel::VertexJoints();
  ASSERT_EQ(joints.size(), mesh.vertices.size());
  // Limbs are told apart by the faces that join vertices.
  std::vector<uint32_t> limb(mesh.vertices.size());
  for (uint32_t i = 0; i < limb.size(); ++i) limb[i] = i;
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& face : mesh.faces) {
      const uint32_t low = std::min({limb[face[0]], limb[face[1]], limb[face[2]]});
      for (const uint32_t vertex : face) {
        changed = changed || limb[vertex] != low;
        limb[vertex] = low;
      }
    }
  }
  std::map<uint32_t, double> volumes;
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3f origin = mesh.vertices[limb[face[0]]];
    const Eigen::Vector3f a = mesh.vertices[face[0]] - origin;
    const Eigen::Vector3f b = mesh.vertices[face[1]] - origin;
    const Eigen::Vector3f c = mesh.vertices[face[2]] - origin;
    volumes[limb[face[0]]] += a.dot(b.cross(c)) / 6.0;
  }
  EXPECT_EQ(volumes.size(), 11u);
  for (const auto& [first, volume] : volumes) EXPECT_GT(volume, 0.0) << "limb at " << first;
}

TEST(BodyModel, SkinStaysNearItsJoints) {
  Random random(4, 0);
  const BodyModel body(RandomShape(&random, 2.0));
  for (int i = 0; i < 20; ++i) {
    const Posture posture = RandomPosture(&random);
    const auto joints = body.Joints(posture);
    TriangleMesh mesh;
    body.Skin(posture, &mesh);
    for (size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Eigen::Vector3d at = mesh.vertices[v].cast<double>();
      EXPECT_LT((at - joints[BodyModel::VertexJoints()[v]]).norm(), 0.5);
    }
  }
}

}  // namespace
}  // namespace dsg::simulator
