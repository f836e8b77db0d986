// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/collision/collision_world.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

constexpr int kBodyCountMax = 1000;
constexpr int kPoseCountMax = 1000;
constexpr int kPoseCountOfAllMax = 10'000;
constexpr int kFaceCountMax = 10'000;
constexpr int kIgnoredCountMax = 1000;
// Beyond any building; keeps what is computed from positions finite.
constexpr double kPositionMaxM = 1e6;
constexpr double kSizeMaxM = 1e4;
constexpr double kWayMaxM = 1e5;
constexpr double kClearanceMaxM = 100.0;
constexpr double kClearanceDefaultM = 2.0;

absl::StatusOr<double> CheckSize(double value, const std::string& field) {
  if (std::isfinite(value) && value > 0.0 && value <= kSizeMaxM) return value;
  return FieldError(field, absl::StrCat(value), "give metres above 0, at most 10000");
}

absl::StatusOr<double> CheckLength(double value, const std::string& field) {
  if (std::isfinite(value) && value >= 0.0 && value <= kSizeMaxM) return value;
  return FieldError(field, absl::StrCat(value), "give metres, 0 to 10000");
}

absl::StatusOr<std::shared_ptr<const TriangleTree>> ReadMesh(const v1::TriangleMesh& in,
                                                             const std::string& field) {
  if (in.vertices_size() == 0 || in.vertices_size() % 3 != 0) {
    return FieldError(field + ".vertices", absl::StrCat(in.vertices_size(), " numbers"),
                      "give x, y and z of each vertex");
  }
  if (in.faces_size() == 0 || in.faces_size() % 3 != 0) {
    return FieldError(field + ".faces", absl::StrCat(in.faces_size(), " numbers"),
                      "give three vertices a face");
  }
  if (in.faces_size() / 3 > kFaceCountMax || in.vertices_size() / 3 > 3 * kFaceCountMax) {
    return FieldError(
        field, absl::StrCat(in.faces_size() / 3, " faces, ", in.vertices_size() / 3, " vertices"),
        "give at most 10000 faces and their vertices; simplify the mesh");
  }
  std::vector<Eigen::Vector3f> vertices;
  for (int i = 0; i < in.vertices_size(); i += 3) {
    const Eigen::Vector3f vertex(in.vertices(i), in.vertices(i + 1), in.vertices(i + 2));
    if (!vertex.allFinite() || vertex.cwiseAbs().maxCoeff() > kSizeMaxM) {
      return FieldError(absl::StrCat(field, ".vertices"), absl::StrCat("not usable at ", i),
                        "give finite metres, at most 10000");
    }
    vertices.push_back(vertex);
  }
  std::vector<std::array<uint32_t, 3>> faces;
  for (int i = 0; i < in.faces_size(); i += 3) {
    faces.push_back({in.faces(i), in.faces(i + 1), in.faces(i + 2)});
    for (const uint32_t vertex : faces.back()) {
      if (vertex < vertices.size()) continue;
      return FieldError(absl::StrCat(field, ".faces"), absl::StrCat(vertex),
                        absl::StrCat("vertices count from 0 to ", vertices.size() - 1));
    }
  }
  return std::make_shared<const TriangleTree>(std::move(vertices), std::move(faces));
}

absl::Status ReadShape(const v1::CollisionBody& in, const std::string& field, Body* body) {
  switch (in.shape_case()) {
    case v1::CollisionBody::kSphere: {
      body->kind = Body::Kind::kSphere;
      DSG_ASSIGN_OR_RETURN(body->radius_m,
                           CheckSize(in.sphere().radius_m(), field + ".sphere.radius_m"));
      return absl::OkStatus();
    }
    case v1::CollisionBody::kCuboid: {
      body->kind = Body::Kind::kCuboid;
      const v1::Vector3& size = in.cuboid().size();
      DSG_ASSIGN_OR_RETURN(body->size.x(), CheckSize(size.x(), field + ".cuboid.size.x"));
      DSG_ASSIGN_OR_RETURN(body->size.y(), CheckSize(size.y(), field + ".cuboid.size.y"));
      DSG_ASSIGN_OR_RETURN(body->size.z(), CheckSize(size.z(), field + ".cuboid.size.z"));
      return absl::OkStatus();
    }
    case v1::CollisionBody::kCapsule: {
      body->kind = Body::Kind::kCapsule;
      DSG_ASSIGN_OR_RETURN(body->radius_m,
                           CheckSize(in.capsule().radius_m(), field + ".capsule.radius_m"));
      DSG_ASSIGN_OR_RETURN(body->length_m,
                           CheckLength(in.capsule().length_m(), field + ".capsule.length_m"));
      return absl::OkStatus();
    }
    case v1::CollisionBody::kMesh: {
      body->kind = Body::Kind::kMesh;
      DSG_ASSIGN_OR_RETURN(body->mesh, ReadMesh(in.mesh(), field + ".mesh"));
      return absl::OkStatus();
    }
    case v1::CollisionBody::SHAPE_NOT_SET:
      break;
  }
  return FieldError(field + ".shape", "", "give a sphere, a cuboid, a capsule or a mesh");
}

absl::StatusOr<Pose3d> ReadPose(const v1::Pose& in, const std::string& field) {
  Pose3d pose;
  DSG_ASSIGN_OR_RETURN(pose.position, PointFromProto(in.position(), field + ".position"));
  if (pose.position.cwiseAbs().maxCoeff() > kPositionMaxM) {
    return FieldError(field + ".position", absl::StrCat(pose.position.cwiseAbs().maxCoeff(), " m"),
                      "stay within 1000 km of the map's origin");
  }
  // Left out means not turned.
  if (!in.has_orientation()) return pose;
  const v1::Quaternion& q = in.orientation();
  pose.orientation = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z());
  if (!pose.orientation.coeffs().allFinite()) {
    return MakeError(Reason::kNumberNotFinite,
                     absl::StrCat(field, ".orientation is not finite; give a unit quaternion"),
                     {{"field", field + ".orientation"}});
  }
  if (!IsValidPose(pose)) {
    return FieldError(field + ".orientation",
                      absl::StrCat("a quaternion of length ", pose.orientation.norm()),
                      "give a unit quaternion");
  }
  pose.orientation.normalize();
  return pose;
}

absl::Status ReadPoses(const v1::CollisionBody& in, const std::string& field, Body* body) {
  if (in.poses_size() == 0 || in.poses_size() > kPoseCountMax) {
    return FieldError(field + ".poses", absl::StrCat(in.poses_size(), " poses"),
                      "give 1 to 1000; cut longer ways");
  }
  double way_m = 0.0;
  for (int i = 0; i < in.poses_size(); ++i) {
    DSG_ASSIGN_OR_RETURN(const Pose3d pose,
                         ReadPose(in.poses(i), absl::StrCat(field, ".poses[", i, "]")));
    if (i > 0) way_m += (pose.position - body->poses.back().position).norm();
    body->poses.push_back(pose);
  }
  if (way_m <= kWayMaxM) return absl::OkStatus();
  return FieldError(field + ".poses", absl::StrCat(way_m, " m"),
                    "give a way of at most 100 km; cut longer ones");
}

absl::StatusOr<std::vector<Body>> ReadBodies(const v1::CheckCollisionRequest& request) {
  if (request.bodies_size() == 0 || request.bodies_size() > kBodyCountMax) {
    return FieldError("bodies", absl::StrCat(request.bodies_size(), " bodies"), "give 1 to 1000");
  }
  int pose_count = 0;
  for (const v1::CollisionBody& body : request.bodies()) pose_count += body.poses_size();
  if (pose_count > kPoseCountOfAllMax) {
    return FieldError("bodies", absl::StrCat(pose_count, " poses"),
                      "give at most 10000 in all; split the call");
  }
  std::vector<Body> bodies;
  for (int i = 0; i < request.bodies_size(); ++i) {
    const std::string field = absl::StrCat("bodies[", i, "]");
    Body& body = bodies.emplace_back();
    DSG_RETURN_IF_ERROR(ReadShape(request.bodies(i), field, &body));
    DSG_RETURN_IF_ERROR(ReadPoses(request.bodies(i), field, &body));
  }
  return bodies;
}

absl::Status ReadDistances(const v1::CheckCollisionRequest& request, CollisionScope* scope) {
  scope->margin_m = request.margin_m();
  if (!std::isfinite(scope->margin_m) || scope->margin_m < 0.0 ||
      scope->margin_m >= kClearanceMaxM) {
    return FieldError("margin_m", absl::StrCat(scope->margin_m), "give metres, 0 to below 100");
  }
  scope->clearance_m_max = request.clearance_m_max();
  if (scope->clearance_m_max == 0.0) {
    scope->clearance_m_max = std::max(kClearanceDefaultM, 2.0 * scope->margin_m);
    return absl::OkStatus();
  }
  // Not written as "above", which NaN would pass.
  if (!(scope->clearance_m_max > scope->margin_m && scope->clearance_m_max <= kClearanceMaxM)) {
    return FieldError("clearance_m_max", absl::StrCat(scope->clearance_m_max),
                      "give metres above margin_m, at most 100, or 0 for 2 m");
  }
  return absl::OkStatus();
}

absl::StatusOr<CollisionScope> ReadScope(const v1::CheckCollisionRequest& request) {
  const v1::CollisionScope& in = request.scope();
  CollisionScope scope;
  scope.ignore_floor = in.ignore_floor();
  if (in.objects() || in.structures() || in.mesh() || in.agents() || in.predicted_agents()) {
    scope.objects = in.objects();
    scope.structures = in.structures();
    scope.mesh = in.mesh();
    scope.agents = in.agents();
    scope.predicted_agents = in.predicted_agents();
  }
  if (scope.predicted_agents && !request.has_at_ns()) {
    return FieldError("at_ns", "", "say when predicted agents are to be met");
  }
  if (in.ignored_size() > kIgnoredCountMax) {
    return FieldError("scope.ignored", absl::StrCat(in.ignored_size(), " nodes"),
                      "give at most 1000; what is below a node goes with it");
  }
  DSG_RETURN_IF_ERROR(ReadDistances(request, &scope));
  return scope;
}

}  // namespace

void FillCollision(const CollisionHit& hit, v1::CollisionResult* out) {
  out->set_hit(hit.hit);
  out->set_clearance_m(hit.clearance_m);
  out->set_observed(hit.observed);
  out->set_at_pose(hit.at_pose);
  if (hit.kind == ObstacleKind::kNone) return;
  out->set_what(ToString(hit.kind));
  if (!hit.node.empty()) out->set_node_id(ToString(hit.node));
  out->mutable_point()->set_x(hit.point_map.x());
  out->mutable_point()->set_y(hit.point_map.y());
  out->mutable_point()->set_z(hit.point_map.z());
}

absl::Status CheckCollision(Engine* engine, const CallContext& call,
                            const v1::CheckCollisionRequest& request,
                            v1::CheckCollisionResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const std::vector<Body> bodies, ReadBodies(request));
  DSG_ASSIGN_OR_RETURN(CollisionScope scope, ReadScope(request));
  std::optional<TimeNs> at_ns;
  if (request.has_at_ns()) at_ns = request.at_ns();
  DSG_ASSIGN_OR_RETURN(const auto graph, view.Graph(call.stop()));
  CollisionWorld world =
      CollisionWorld::Create(graph, view.shared_snapshot(), at_ns, &engine->collisions);
  for (const std::string& name : request.scope().ignored()) {
    DSG_ASSIGN_OR_RETURN(const NodeId node,
                         ResolveOne(view.snapshot(), name, "scope.ignored", call.stop()));
    DSG_RETURN_IF_ERROR(world.Ignore(node, call.stop(), &scope));
  }
  view.FillHeader(reply->mutable_header());
  reply->mutable_results()->Reserve(request.bodies_size());
  for (const Body& body : bodies) {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const CollisionHit hit, world.Check(body, scope, call.stop()));
    FillCollision(hit, reply->add_results());
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
