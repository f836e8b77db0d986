// SPDX-License-Identifier: Apache-2.0
// The same questions asked of FCL (Pan, Chitta and Manocha, ICRA 2012), which shares no line with
// our closed forms: both must say hit or miss alike, and the same distance.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <memory>
#include <string>

#include "query/engine/collision/obstacles.h"
#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;
using test::Ask;
using test::Scene;

// Where nothing is round both are exact to rounding of doubles.
constexpr double kFclExactM = 1e-9;
// FCL follows round sides of capsules by iteration, which ends up to 1 mm too early, and thus
// with a distance that is too large.
constexpr double kIteratedM = 3e-3;
constexpr double kFarM = 30.0;
constexpr TimeNs kAtNs = kNsPerSecond;

struct FclShape {
  std::shared_ptr<fcl::CollisionGeometryd> geometry;
  fcl::Transform3d map_T_shape = fcl::Transform3d::Identity();
};

fcl::Transform3d FclPose(const Pose3d& pose) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.translation() = pose.position;
  transform.linear() = pose.orientation.toRotationMatrix();
  return transform;
}

std::shared_ptr<fcl::CollisionGeometryd> FclMesh(const std::vector<Convex>& triangles) {
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  model->beginModel();
  for (const Convex& triangle : triangles) {
    model->addTriangle(triangle.corners[0], triangle.corners[1], triangle.corners[2]);
  }
  model->endModel();
  return model;
}

std::vector<Convex> TrianglesOf(const TriangleTree& tree) {
  std::vector<Convex> triangles;
  for (int i = 0; i < tree.face_count(); ++i) triangles.push_back(tree.Triangle(i));
  return triangles;
}

FclShape FclOf(const Body& body) {
  FclShape shape;
  shape.map_T_shape = FclPose(body.poses.front());
  switch (body.kind) {
    case Body::Kind::kSphere:
      shape.geometry = std::make_shared<fcl::Sphered>(body.radius_m);
      break;
    case Body::Kind::kCuboid:
      shape.geometry = std::make_shared<fcl::Boxd>(body.size);
      break;
    case Body::Kind::kCapsule:
      shape.geometry = std::make_shared<fcl::Capsuled>(body.radius_m, body.length_m);
      break;
    case Body::Kind::kMesh:
      shape.geometry = FclMesh(TrianglesOf(*body.mesh));
      break;
  }
  return shape;
}

// Below 0 where they touch, by some depth or other.
double FclDistance(const FclShape& a, const FclShape& b) {
  const fcl::DistanceRequestd request;
  fcl::DistanceResultd result;
  return fcl::distance(a.geometry.get(), a.map_T_shape, b.geometry.get(), b.map_T_shape, request,
                       result);
}

bool FclTouch(const FclShape& a, const FclShape& b) {
  const fcl::CollisionRequestd request;
  fcl::CollisionResultd result;
  return fcl::collide(a.geometry.get(), a.map_T_shape, b.geometry.get(), b.map_T_shape, request,
                      result) > 0;
}

// The three kinds of obstacles that there are, each in a map and at FCL's.
struct Kind {
  std::string name;
  bool is_round = false;
  GraphDelta delta;
  std::vector<FclShape> shapes;
};

Kind Boxes(Random* random) {
  Kind kind{"boxes", false, {}, {}};
  for (uint64_t i = 1; i <= 25; ++i) {
    const Pose3d pose = test::RandomPose(random, 3.0);
    const Box3d box = test::RandomBox(random);
    kind.delta.nodes.push_back(test::ObjectAt(i, pose, box));
    kind.shapes.push_back({std::make_shared<fcl::Boxd>(Vector3d(box.sizes())), FclPose(pose)});
  }
  return kind;
}

Kind Capsules(Random* random) {
  Kind kind{"capsules", true, {}, {}};
  for (uint64_t i = 1; i <= 20; ++i) {
    const Vector3d at = test::RandomPose(random, 3.0).position;
    kind.delta.nodes.push_back(test::AgentNode(i));
    kind.delta.appends.push_back(
        {NodeId('H', i), {test::StandingAt(kAtNs, at.x(), at.y(), at.z())}});
    kind.shapes.push_back(
        {std::make_shared<fcl::Capsuled>(kAgentRadiusM, kAgentHeightM - 2.0 * kAgentRadiusM),
         FclPose({at, Eigen::Quaterniond::Identity()})});
  }
  return kind;
}

std::vector<Convex> RandomTriangles(Random* random, int count, double range_m) {
  std::vector<Convex> triangles;
  for (int i = 0; i < count; ++i) {
    const Pose3d pose = test::RandomPose(random, range_m);
    const auto corner = [&](double x, double y) {
      return Vector3d((pose * Vector3d(x, y, 0)).cast<float>().cast<double>());
    };
    triangles.push_back(MakeTriangle(corner(0, 0), corner(0.4, 0.1), corner(0.1, 0.3)));
  }
  return triangles;
}

Kind Mesh(Random* random) {
  const std::vector<Convex> triangles = RandomTriangles(random, 200, 3.0);
  Kind kind{"mesh", false, {}, {}};
  kind.delta.mesh_blocks = test::Blocks(triangles, {});
  kind.shapes = {{FclMesh(triangles), fcl::Transform3d::Identity()}};
  return kind;
}

Body BodyOfKind(Random* random, int kind) {
  Body body;
  body.poses = {test::RandomPose(random, 2.5)};
  body.kind = static_cast<Body::Kind>(kind);
  body.radius_m = random->Uniform(0.01, 0.3);
  body.length_m = random->Uniform(0.1, 1.5);
  body.size = test::RandomBox(random).sizes();
  if (body.kind == Body::Kind::kSphere) body.length_m = 0.0;
  if (body.kind != Body::Kind::kMesh) return body;
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
  for (const Convex& triangle : RandomTriangles(random, 12, 0.4)) {
    const auto first = static_cast<uint32_t>(vertices.size());
    for (size_t i = 0; i < 3; ++i) vertices.push_back(triangle.corners[i].cast<float>());
    faces.push_back({first, first + 1, first + 2});
  }
  body.mesh = std::make_shared<const TriangleTree>(vertices, faces);
  return body;
}

// How the two compared over many questions.
struct Tally {
  int hit_count = 0;
  int count = 0;
  double worst_m = 0.0;
};

// FCL too has closed forms for spheres, and for capsules among themselves.
bool IsIterated(const Body& body, const Kind& kind) {
  if (body.kind == Body::Kind::kSphere) return false;
  return (body.kind == Body::Kind::kCapsule) != kind.is_round;
}

void Compare(const Body& body, const Kind& kind, const CollisionHit& ours, Tally* tally) {
  const FclShape shape = FclOf(body);
  double fcl_m = std::numeric_limits<double>::infinity();
  bool fcl_touches = false;
  for (const FclShape& other : kind.shapes) {
    fcl_m = std::min(fcl_m, std::max(0.0, FclDistance(shape, other)));
    fcl_touches |= FclTouch(shape, other);
  }
  ++tally->count;
  tally->hit_count += ours.hit ? 1 : 0;
  tally->worst_m = std::max(tally->worst_m, std::abs(fcl_m - ours.clearance_m));
  const bool iterates = IsIterated(body, kind);
  EXPECT_LE(ours.clearance_m, fcl_m + kFclExactM);
  EXPECT_GE(ours.clearance_m, fcl_m - (iterates ? kIteratedM : kFclExactM));
  // Whatever all but touches may be seen either way.
  if (ours.hit != fcl_touches) {
    EXPECT_LT(std::max(ours.clearance_m, fcl_m), iterates ? kIteratedM : kFclExactM);
  }
}

TEST(FclWitness, SaysTheSameOfEveryKindOfBodyAndObstacle) {
  Random random(test::TestSeed(21), 0);
  const std::vector<Kind> kinds = {Boxes(&random), Capsules(&random), Mesh(&random)};
  for (const Kind& kind : kinds) {
    Scene scene;
    const Revision revision = scene.Commit(kind.delta);
    for (int body_kind = 0; body_kind < 4; ++body_kind) {
      Tally tally;
      for (int i = 0; i < 250; ++i) {
        SCOPED_TRACE(kind.name + ", body kind " + std::to_string(body_kind) + ", question " +
                     std::to_string(i));
        const Body body = BodyOfKind(&random, body_kind);
        CollisionScope scope;
        scope.clearance_m_max = kFarM;
        Compare(body, kind, Ask(scene.World(revision, kAtNs), body, scope), &tally);
      }
      std::printf("%s, body kind %d: %d of %d touch, distances differ by at most %.1e m\n",
                  kind.name.c_str(), body_kind, tally.hit_count, tally.count, tally.worst_m);
      EXPECT_GT(tally.hit_count, 5);
      EXPECT_GT(tally.count - tally.hit_count, 5);
    }
  }
}

}  // namespace
}  // namespace dsg::query
