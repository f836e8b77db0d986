// SPDX-License-Identifier: Apache-2.0
// The verb collide: what a body touches, or how far away everything is.
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/export/outline.h"
#include "query/cli/json.h"
#include "query/cli/node_names.h"
#include "query/cli/render_space.h"
#include "query/cli/triangle_file.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kBodyRgb = 0x1f5fbf;
constexpr uint32_t kHitRgb = 0xd0104c;
constexpr uint32_t kFreeRgb = 0x2a8c4a;

void Fill(const Eigen::Vector3d& point, v1::Vector3* out) {
  out->set_x(point.x());
  out->set_y(point.y());
  out->set_z(point.z());
}

absl::Status FillMesh(const std::string& path, v1::TriangleMesh* mesh) {
  DSG_ASSIGN_OR_RETURN(const Triangles triangles, ReadTriangles(path));
  for (const Eigen::Vector3f& vertex : triangles.vertices) {
    for (const float value : vertex) mesh->add_vertices(value);
  }
  for (const auto& face : triangles.faces) {
    for (const uint32_t corner : face) mesh->add_faces(corner);
  }
  return absl::OkStatus();
}

absl::Status FillBody(const CollideVerb& verb, v1::CollisionBody* body) {
  if (verb.sphere_radius_m > 0.0) {
    body->mutable_sphere()->set_radius_m(verb.sphere_radius_m);
  } else if (!verb.box.empty()) {
    DSG_ASSIGN_OR_RETURN(const Eigen::Vector3d size, ParsePoint("--box", verb.box));
    Fill(size, body->mutable_cuboid()->mutable_size());
  } else if (!verb.capsule.empty()) {
    DSG_ASSIGN_OR_RETURN(const auto sizes, ParsePair("--capsule", verb.capsule, "RADIUS,LENGTH"));
    body->mutable_capsule()->set_radius_m(sizes[0]);
    body->mutable_capsule()->set_length_m(sizes[1]);
  } else {
    DSG_RETURN_IF_ERROR(FillMesh(verb.mesh_file, body->mutable_mesh()));
  }
  for (const std::string& text : verb.poses) {
    DSG_ASSIGN_OR_RETURN(const Pose3d pose, ParsePose("--pose", text));
    ToProto(pose, body->add_poses());
  }
  return absl::OkStatus();
}

void FillScope(const CollideVerb& verb, v1::CollisionScope* scope) {
  scope->set_objects(verb.objects);
  scope->set_structures(verb.structures);
  scope->set_mesh(verb.mesh_blocks);
  scope->set_agents(verb.agents);
  scope->set_predicted_agents(verb.predicted_agents);
  scope->set_ignore_floor(verb.ignore_floor);
  for (const std::string& node : verb.ignored) scope->add_ignored(node);
}

absl::StatusOr<v1::CheckCollisionRequest> RequestFor(Session* session, const CollideVerb& verb) {
  auto request = session->Begin<v1::CheckCollisionRequest>();
  DSG_RETURN_IF_ERROR(FillBody(verb, request.add_bodies()));
  FillScope(verb, request.mutable_scope());
  if (!verb.at.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", verb.at, session->map()));
    request.set_at_ns(at_ns);
  }
  request.set_margin_m(verb.margin_m);
  request.set_clearance_m_max(verb.clearance_max_m);
  return request;
}

Polygon2d CircleAround(const Eigen::Vector3d& middle_map, double radius_m) {
  constexpr int kCornerCount = 24;
  Polygon2d circle;
  for (int i = 0; i < kCornerCount; ++i) {
    const double angle = 2.0 * M_PI * i / kCornerCount;
    circle.push_back(middle_map.head<2>() +
                     radius_m * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return circle;
}

// The body at one of its poses, as large as it is. Nothing for meshes.
std::vector<Polygon2d> OutlinesOf(const v1::CollisionBody& body, const Pose3d& map_T_body) {
  if (body.has_sphere()) return {CircleAround(map_T_body.position, body.sphere().radius_m())};
  if (body.has_capsule()) {
    const Eigen::Vector3d half(0.0, 0.0, 0.5 * body.capsule().length_m());
    return {CircleAround(map_T_body * -half, body.capsule().radius_m()),
            CircleAround(map_T_body * half, body.capsule().radius_m())};
  }
  if (!body.has_cuboid()) return {};
  Node node;
  node.map_T_node = map_T_body;
  const Eigen::Vector3d half = 0.5 * PointOf(body.cuboid().size());
  node.box_node = Box3d(-half, half);
  return {FloorOutline(node)};
}

AnswerPicture Draw(const v1::CheckCollisionRequest& request,
                   const v1::CheckCollisionResponse& reply, const NodeNames& names, bool is_hit) {
  AnswerPicture picture{.title = is_hit ? "the body hits" : "the body is free",
                        .revision = reply.header().read_revision()};
  if (request.has_at_ns()) picture.at_ns = request.at_ns();
  Overlay& overlay = picture.overlay;
  OverlayLine way{.points_map = {}, .rgb = kBodyRgb};
  for (const v1::Pose& pose : request.bodies(0).poses()) {
    way.points_map.push_back(PointOf(pose.position()));
    overlay.marks.push_back(
        {.position_map = way.points_map.back(), .rgb = kBodyRgb, .radius_px = 6.0});
    for (Polygon2d& outline : OutlinesOf(request.bodies(0), FromProto(pose))) {
      overlay.outlines.push_back({std::move(outline), kBodyRgb, pose.position().z()});
    }
  }
  overlay.lines.push_back(std::move(way));
  for (const v1::CollisionResult& result : reply.results()) {
    if (result.what().empty()) continue;
    overlay.marks.push_back(
        {.position_map = PointOf(result.point()),
         .rgb = result.hit() ? kHitRgb : kFreeRgb,
         .shape = OverlayMark::Shape::kCross,
         .label = result.node_id().empty() ? result.what() : names.Text(result.node_id())});
  }
  overlay.legend = {{"body", kBodyRgb},
                    {is_hit ? "touched" : "nearest", is_hit ? kHitRgb : kFreeRgb}};
  return picture;
}

}  // namespace

absl::Status RunCollide(Session* session, const CollideVerb& verb, std::ostream& out,
                        bool* is_hit) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::CheckCollisionRequest request, RequestFor(session, verb));
  v1::CheckCollisionResponse reply;
  DSG_RETURN_IF_ERROR(session->api().CheckCollision(session->NewCall(), request, &reply));
  *is_hit = false;
  for (const v1::CollisionResult& result : reply.results()) *is_hit = *is_hit || result.hit();
  std::vector<std::string> ids;
  for (const v1::CollisionResult& result : reply.results()) ids.push_back(result.node_id());
  DSG_ASSIGN_OR_RETURN(const NodeNames names,
                       NamesOf(session, reply.header().read_revision(), ids));
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(reply, out));
  } else {
    out << RenderCollisions(reply, names);
  }
  return WritePicture(session, verb.picture, Draw(request, reply, names, *is_hit), out);
}

}  // namespace dsg::cli
