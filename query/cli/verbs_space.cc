// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verbs_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/space.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/answer_text.h"
#include "query/cli/export/outline.h"
#include "query/cli/json.h"
#include "query/cli/lookups.h"
#include "query/cli/table.h"
#include "query/cli/triangle_file.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

using Ids = google::protobuf::RepeatedPtrField<std::string>;

std::string NamedInOrder(const Ids& ids, const NodeNames& names) {
  return absl::StrJoin(
      ids, " > ", [&](std::string* out, const std::string& id) { out->append(names.Text(id)); });
}

// Both ends of a long list; the JSON has all of it.
std::string ShortList(const Ids& ids) {
  constexpr int kAll = 12;
  constexpr int kEnd = 5;
  if (ids.size() <= kAll) return absl::StrJoin(ids, " ");
  return absl::StrCat(absl::StrJoin(ids.begin(), ids.begin() + kEnd, " "), " ... ",
                      absl::StrJoin(ids.end() - kEnd, ids.end(), " "));
}

std::string EndText(const v1::PlanPathResponse& reply, bool at_end, const NodeNames& names) {
  std::string text = names.Text(at_end ? reply.to_node_id() : reply.from_node_id());
  if (reply.polyline().empty()) return text;
  const v1::Vector3& position = reply.polyline(at_end ? reply.polyline_size() - 1 : 0);
  return absl::StrCat(text, text.empty() ? "" : ", ", PositionText(position));
}

}  // namespace

std::string RenderPath(const v1::PlanPathResponse& reply, const NodeNames& names) {
  return RenderFields(
      {{"from", EndText(reply, false, names)},
       {"to", EndText(reply, true, names)},
       {"length", Fixed(reply.length_m(), 2) + " m"},
       {"clearance", absl::StrCat("at least ", Fixed(reply.clearance_m_min(), 2), " m")},
       {"rooms", NamedInOrder(reply.room_ids(), names)},
       {"places", absl::StrCat(reply.place_ids_size(), ": ", ShortList(reply.place_ids()))},
       {"touches", reply.has_collision() ? CollisionText(reply.collision(), names) : ""},
       {"found", absl::StrCat(reply.mode() == v1::FLAT ? "over all places" : "rooms first", ", ",
                              Counted(reply.expanded_count(), "place"), " looked at (revision ",
                              reply.header().read_revision(), ")")}});
}

std::string CollisionText(const v1::CollisionResult& result, const NodeNames& names) {
  std::string thing = result.what();
  for (char& c : thing) c = c == '_' ? ' ' : c;
  if (!result.node_id().empty()) absl::StrAppend(&thing, " ", names.Text(result.node_id()));
  const char* unobserved = result.observed() ? "" : "; part of the body is in unobserved space";
  if (result.hit()) {
    return absl::StrCat("hit ", thing, " at ", PositionText(result.point()), unobserved);
  }
  if (result.what().empty()) {
    return absl::StrCat("free, nothing within ", Fixed(result.clearance_m(), 2), " m", unobserved);
  }
  return absl::StrCat("free, ", Fixed(result.clearance_m(), 2), " m from ", thing, " at ",
                      PositionText(result.point()), unobserved);
}

namespace {

// One line per body.
std::string RenderCollisions(const v1::CheckCollisionResponse& reply, const NodeNames& names) {
  std::string text;
  for (const v1::CollisionResult& result : reply.results()) {
    absl::StrAppend(&text, Printable(CollisionText(result, names)));
    // A single pose has no path.
    if (result.at_pose() > 0.0) {
      absl::StrAppend(&text, ", on the way at pose ", Fixed(result.at_pose(), 3));
    }
    absl::StrAppend(&text, " (revision ", reply.header().read_revision(), ")\n");
  }
  return text;
}

constexpr uint32_t kPathRgb = 0x1f5fbf;
constexpr uint32_t kStartRgb = 0x2a8c4a;
constexpr uint32_t kGoalRgb = 0xc8321e;

bool IsColor(absl::string_view word) {
  constexpr std::array<absl::string_view, 12> kColors = {"red",   "orange", "yellow", "green",
                                                         "cyan",  "blue",   "purple", "pink",
                                                         "brown", "black",  "grey",   "white"};
  return std::find(kColors.begin(), kColors.end(), word) != kColors.end();
}

// "couch", "red couch".
void FillPattern(absl::string_view words, v1::NodePattern* pattern) {
  const size_t blank = words.find(' ');
  if (blank != absl::string_view::npos && IsColor(words.substr(0, blank))) {
    pattern->set_color(std::string(words.substr(0, blank)));
    words.remove_prefix(blank + 1);
  }
  pattern->set_class_name(std::string(words));
}

// Names may have commas, but hardly numbers on both sides of them.
bool IsMeantAsPoint(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ',');
  const auto is_number = [](const std::string& part) {
    double number = 0.0;
    return part.empty() || absl::SimpleAtod(part, &number);
  };
  return parts.size() > 1 && std::all_of(parts.begin(), parts.end(), is_number);
}

absl::Status FillEnd(const std::string& option, const std::string& text, v1::PathEnd* end) {
  absl::string_view rest = text;
  if (absl::ConsumePrefix(&rest, "nearest ")) {
    FillPattern(rest, end->mutable_nearest());
    return absl::OkStatus();
  }
  if (!IsMeantAsPoint(text)) {
    end->set_node(text);
    return absl::OkStatus();
  }
  DSG_ASSIGN_OR_RETURN(const Eigen::Vector3d point, ParsePoint(option, text));
  end->mutable_position()->set_x(point.x());
  end->mutable_position()->set_y(point.y());
  end->mutable_position()->set_z(point.z());
  return absl::OkStatus();
}

absl::StatusOr<v1::PlanPathRequest> PathRequest(Session* session, const PathVerb& verb) {
  auto request = session->Begin<v1::PlanPathRequest>();
  DSG_RETURN_IF_ERROR(FillEnd("FROM", verb.from, request.mutable_from()));
  DSG_RETURN_IF_ERROR(FillEnd("TO", verb.to, request.mutable_to()));
  request.set_robot_radius_m(verb.radius_m);
  for (const std::string& node : verb.blocked) request.add_blocked(node);
  request.set_mode(verb.flat ? v1::FLAT : v1::HIERARCHICAL);
  DSG_RETURN_IF_ERROR(
      SetInstant("--at", verb.at, session->map(), &request, &v1::PlanPathRequest::set_at_ns));
  request.set_check_collision(verb.check);
  return request;
}

AnswerPicture DrawPath(const v1::PlanPathRequest& request, const v1::PlanPathResponse& reply,
                       const PathVerb& verb) {
  AnswerPicture picture{.title = absl::StrCat("from ", verb.from, " to ", verb.to, ": ",
                                              Fixed(reply.length_m(), 1), " m"),
                        .revision = reply.header().read_revision()};
  if (request.has_at_ns()) picture.at_ns = request.at_ns();
  OverlayLine line{.points_map = {}, .rgb = kPathRgb};
  for (const v1::Vector3& point : reply.polyline()) line.points_map.push_back(PointOf(point));
  if (!line.points_map.empty()) {
    picture.overlay.marks = {
        {.position_map = line.points_map.front(), .rgb = kStartRgb, .label = "start"},
        {.position_map = line.points_map.back(), .rgb = kGoalRgb, .label = "goal"}};
  }
  picture.overlay.legend.push_back(
      {absl::StrCat("way of ", Fixed(reply.length_m(), 1), " m, clearance at least ",
                    Fixed(reply.clearance_m_min(), 2), " m"),
       kPathRgb});
  if (reply.collision().hit()) {
    picture.overlay.marks.push_back({.position_map = PointOf(reply.collision().point()),
                                     .rgb = 0xd0104c,
                                     .shape = OverlayMark::Shape::kCross,
                                     .label = "touches"});
  }
  picture.overlay.lines.push_back(std::move(line));
  return picture;
}

absl::Status RunPath(Session* session, const PathVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::PlanPathRequest request, PathRequest(session, verb));
  v1::PlanPathResponse reply;
  DSG_RETURN_IF_ERROR(session->api().PlanPath(session->NewCall(), request, &reply));
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(reply, out));
  } else {
    std::vector<std::string> ids(reply.room_ids().begin(), reply.room_ids().end());
    ids.insert(ids.end(), {reply.from_node_id(), reply.to_node_id(), reply.collision().node_id()});
    DSG_ASSIGN_OR_RETURN(const NodeNames names,
                         NamesOf(session, reply.header().read_revision(), ids));
    out << RenderPath(reply, names);
  }
  return WritePicture(session, verb.picture, DrawPath(request, reply, verb), out);
}

constexpr uint32_t kBodyRgb = 0x1f5fbf;
constexpr uint32_t kTouchedRgb = 0xd0104c;
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

absl::StatusOr<v1::CheckCollisionRequest> CollisionRequest(Session* session,
                                                           const CollideVerb& verb) {
  auto request = session->Begin<v1::CheckCollisionRequest>();
  DSG_RETURN_IF_ERROR(FillBody(verb, request.add_bodies()));
  FillScope(verb, request.mutable_scope());
  DSG_RETURN_IF_ERROR(
      SetInstant("--at", verb.at, session->map(), &request, &v1::CheckCollisionRequest::set_at_ns));
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

// The body at one of its poses, true to scale. Nothing for meshes.
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

AnswerPicture DrawCollision(const v1::CheckCollisionRequest& request,
                            const v1::CheckCollisionResponse& reply, const NodeNames& names,
                            bool is_hit) {
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
         .rgb = result.hit() ? kTouchedRgb : kFreeRgb,
         .shape = OverlayMark::Shape::kCross,
         .label = result.node_id().empty() ? result.what() : names.Text(result.node_id())});
  }
  overlay.legend = {{"body", kBodyRgb},
                    {is_hit ? "touched" : "nearest", is_hit ? kTouchedRgb : kFreeRgb}};
  return picture;
}

absl::Status RunCollide(Session* session, const CollideVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::CheckCollisionRequest request, CollisionRequest(session, verb));
  v1::CheckCollisionResponse reply;
  DSG_RETURN_IF_ERROR(session->api().CheckCollision(session->NewCall(), request, &reply));
  bool is_hit = false;
  for (const v1::CollisionResult& result : reply.results()) is_hit |= result.hit();
  session->set_found(is_hit);
  std::vector<std::string> ids;
  for (const v1::CollisionResult& result : reply.results()) ids.push_back(result.node_id());
  DSG_ASSIGN_OR_RETURN(const NodeNames names,
                       NamesOf(session, reply.header().read_revision(), ids));
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(reply, out));
  } else {
    out << RenderCollisions(reply, names);
  }
  return WritePicture(session, verb.picture, DrawCollision(request, reply, names, is_hit), out);
}

absl::Status CheckCollide(const CollideVerb& verb, const CommonOptions&) {
  const bool given[] = {verb.sphere_radius_m > 0.0, !verb.box.empty(), !verb.capsule.empty(),
                        !verb.mesh_file.empty()};
  if (std::count(std::begin(given), std::end(given), true) == 1) return absl::OkStatus();
  return Usage(
      "collide asks about one body: give one of --sphere RADIUS, --box X,Y,Z, --capsule "
      "RADIUS,LENGTH, --mesh FILE.ply",
      "collide");
}

void AddPath(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<PathVerb>({.name = "path",
                              .what = "A path from one place to another",
                              .example = "carol \"nearest fridge\" --at +30s --radius 0.2",
                              .run = RunPath});
  constexpr char kEnd[] = "X,Y,Z, an id or a unique name, or \"nearest CLASS\"";
  app->add_option("FROM", verb->from, kEnd)->required();
  app->add_option("TO", verb->to, kEnd)->required();
  app->add_option("--radius", verb->radius_m, "Radius of the robot, metres; default 0")
      ->check(AboveZero());
  app->add_option("--avoid", verb->blocked, "Avoid this place or room; repeatable")
      ->allow_extra_args(false);
  app->add_flag("--flat", verb->flat, "Search all places at once, instead of rooms first");
  app->add_option("--at", verb->at, "The world at this TIME; default now");
  app->add_flag("--check", verb->check,
                "Sweep the robot along the path and report what it touches: objects, walls, and "
                "the other agents where they were at --at (default: at their last poses)");
  AddPicture(app, "the path", &verb->picture);
}

void AddCollide(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<CollideVerb>(
      {.name = "collide",
       .what = "What a body touches, or its distance to the nearest obstacle",
       .example = "--capsule 0.25,1.2 --pose 10,7,0.9 5,7,0.9 --at +89s",
       .run = RunCollide,
       .check = CheckCollide,
       .footer =
           "Checks against everything but predicted agents, unless --objects and similar options\n"
           "choose.\n"
           "Exit codes: 0 the body touches something, 1 it is free, 2 usage, 3 unavailable, 4 data "
           "loss."});
  app->add_option("--sphere", verb->sphere_radius_m, "Radius, metres")->check(AboveZero());
  app->add_option("--box", verb->box, "X,Y,Z: edge lengths, metres");
  app->add_option("--capsule", verb->capsule,
                  "RADIUS,LENGTH along z, between the centres of its ends, metres");
  app->add_option("--mesh", verb->mesh_file, "A PLY file of triangles, in the frame of the body");
  app->add_option("--pose", verb->poses,
                  "X,Y,Z or X,Y,Z,QX,QY,QZ,QW in the map frame; several are a path")
      ->required();
  app->add_option("--at", verb->at, "The world at this TIME; default now");
  app->add_option("--margin", verb->margin_m, "A smaller distance is a hit, metres; default 0")
      ->check(ZeroOrMore());
  app->add_option("--reach", verb->clearance_max_m,
                  "Largest distance to look for obstacles, metres; default 2")
      ->check(AboveZero());
  app->add_flag("--objects", verb->objects, "Check against objects");
  app->add_flag("--structures", verb->structures, "Check against walls, floors, ceilings");
  app->add_flag("--mesh-blocks", verb->mesh_blocks, "Check against the mesh of the map");
  app->add_flag("--agents", verb->agents, "Check against agents at their observed poses");
  app->add_flag("--predicted", verb->predicted_agents,
                "Check against agents at their predicted poses");
  app->add_flag("--ignore-floor", verb->ignore_floor, "Ignore floors of the mesh");
  app->add_option("--ignore", verb->ignored, "Ignore this node; repeatable")
      ->allow_extra_args(false);
  AddPicture(app, "body and obstacle", &verb->picture);
}

}  // namespace

void AddSpaceVerbs(Grammar* grammar) {
  AddPath(grammar);
  AddCollide(grammar);
}

}  // namespace dsg::cli
