// SPDX-License-Identifier: Apache-2.0
// The verb shape: the body of an agent over time, as a table, as mesh files or as a picture.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/export/body_view.h"
#include "query/cli/export/mesh_file.h"
#include "query/cli/export/top_view.h"
#include "query/cli/json.h"
#include "query/cli/list_writer.h"
#include "query/cli/read_bodies.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/files/atomic_file.h"
#include "schema/picture/raster.h"

namespace dsg::cli {
namespace {

struct ShapeVerb {
  std::string agent;
  std::string from;
  std::string to;
  // Instead of the two: the body nearest to this.
  std::string at;
  // At most one: a file for the first body, a folder for one file per body, a picture of all.
  std::string ply;
  std::string obj_folder;
  std::string png;
  int width_px = 1600;
  bool force = false;
};

// Source: Loper et al., "SMPL: a skinned multi-person linear model", 2015: 24 joints, hands last.
constexpr int kJointCount = 24;
constexpr int kLeftHand = 22;
constexpr int kRightHand = 23;

Cell CountOrNone(int count) { return count == 0 ? Cell() : Cell(int64_t{count}); }

Cell JointCell(const v1::AgentShape& body, int joint) {
  const auto& joints = body.shape().joints();
  if (joints.size() != 3 * kJointCount || !body.has_pose()) return Cell();
  const Eigen::Vector3d joint_agent(static_cast<double>(joints[3 * joint]),
                                    static_cast<double>(joints[3 * joint + 1]),
                                    static_cast<double>(joints[3 * joint + 2]));
  const Pose3d map_T_agent = FromProto(body.pose());
  const Eigen::Vector3d joint_map = map_T_agent * joint_agent;
  return absl::StrCat(Fixed(joint_map.x(), 2), " ", Fixed(joint_map.y(), 2), " ",
                      Fixed(joint_map.z(), 2));
}

// What is stored of a body, and where its hands are in the map. Only skeletons of 24 joints in the
// order of SMPL show hands.
std::vector<ListColumn> BodyColumns() {
  const auto optional = [](const char* heading, CellType type) {
    return ListColumn{.heading = heading, .type = type, .unknown = "-"};
  };
  return {{"time", CellType::kTime},
          optional("pose", CellType::kCount),
          optional("shape", CellType::kCount),
          optional("joints", CellType::kCount),
          optional("vertices", CellType::kCount),
          optional("left hand m", CellType::kText),
          optional("right hand m", CellType::kText),
          {"date", CellType::kDate}};
}

Row BodyRow(const v1::AgentShape& body) {
  const v1::BodyShape& shape = body.shape();
  return {shape.time_ns(),
          CountOrNone(shape.pose_coefficients_size()),
          CountOrNone(shape.shape_coefficients_size()),
          CountOrNone(shape.joints_size() / 3),
          CountOrNone(body.vertex_count()),
          JointCell(body, kLeftHand),
          JointCell(body, kRightHand),
          shape.time_ns()};
}

absl::StatusOr<v1::GetAgentShapeRequest> ShapeRequest(const Session& session,
                                                      const ShapeVerb& verb) {
  auto request = session.Begin<v1::GetAgentShapeRequest>();
  request.set_agent(verb.agent);
  const MapSpec& map = session.map();
  DSG_RETURN_IF_ERROR(
      SetInstant("--from", verb.from, map, &request, &v1::GetAgentShapeRequest::set_from_ns));
  DSG_RETURN_IF_ERROR(
      SetInstant("--to", verb.to, map, &request, &v1::GetAgentShapeRequest::set_to_ns));
  return request;
}

absl::Status ListBodies(Session* session, v1::GetAgentShapeRequest request, std::ostream& out) {
  // Vertices go to files: one body has thousands.
  request.add_parts(v1::SHAPE_PART_COEFFICIENTS);
  request.add_parts(v1::SHAPE_PART_JOINTS);
  ListWriter list(session->common(), session->times(), "shapes", BodyColumns(), &out);
  int64_t left = EntriesLeft(session->common().limit);
  std::string agent_id;
  int64_t revision = 0;
  absl::Status written;
  DSG_RETURN_IF_ERROR(
      session->Read(&query::Api::GetAgentShape, request, [&](v1::GetAgentShapeResponse message) {
        // The first message has both.
        if (message.has_header()) {
          agent_id = message.agent_id();
          revision = message.header().read_revision();
        }
        CutToLimit(message.mutable_shapes(), &left);
        written = list.Add(message, message.shapes(), BodyRow);
        return written.ok() && left > 0;
      }));
  DSG_RETURN_IF_ERROR(written);
  return list.End(absl::StrCat(Counted(list.count(), "body shape"), " of ", agent_id, " (revision ",
                               revision, ")\n"));
}

// Writes bodies as they arrive, without keeping them.
class BodyWriter {
 public:
  BodyWriter(const Session& session, const ShapeVerb& verb)
      : verb_(verb),
        count_max_(verb.obj_folder.empty() ? 1 : EntriesLeft(session.common().limit)),
        times_(session.times()) {}

  /// False when no more is needed; status() then says whether that is an error.
  bool Take(const BodySource& source, const Body& body) {
    if (static_cast<int64_t>(files_.size()) >= count_max_) return false;
    if (body.points_map.empty()) return true;
    status_ = Write(source, body);
    return status_.ok() && static_cast<int64_t>(files_.size()) < count_max_;
  }

  const absl::Status& status() const { return status_; }
  const std::vector<Written>& files() const { return files_; }

 private:
  absl::Status Write(const BodySource& source, const Body& body) {
    const bool is_obj = !verb_.obj_folder.empty();
    const std::string path =
        is_obj ? absl::StrCat(verb_.obj_folder, "/", source.agent_id, "_", body.time_ns, ".obj")
               : verb_.ply;
    const std::string comment =
        absl::StrCat("agent ", source.agent_id, " at ", times_.Full(body.time_ns), ", revision ",
                     source.revision, ", metres, z up");
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, verb_.force));
    DSG_RETURN_IF_ERROR(is_obj ? WriteBodyObj(body, comment, &file)
                               : WriteBodyPly(body, comment, &file));
    DSG_RETURN_IF_ERROR(file.Commit());
    const size_t face_count = body.faces == nullptr ? 0 : body.faces->size();
    files_.push_back({.format = is_obj ? "obj" : "ply",
                      .path = path,
                      .byte_count = file.byte_count(),
                      .counts = {{"vertices", static_cast<int64_t>(body.points_map.size())},
                                 {"faces", static_cast<int64_t>(face_count)}}});
    return absl::OkStatus();
  }

  const ShapeVerb& verb_;
  const int64_t count_max_;
  const TimeText& times_;
  absl::Status status_;
  std::vector<Written> files_;
};

absl::Status PrepareFiles(const ShapeVerb& verb) {
  for (const std::string* path : {&verb.ply, &verb.png}) {
    if (!path->empty()) return CheckMayWrite(*path, verb.force);
  }
  return MakeFolder("--obj", verb.obj_folder);
}

absl::Status NoBody(const BodySource& source, const std::string& what) {
  return absl::NotFoundError(absl::StrCat("agent ", source.agent_id, " has no body with ", what,
                                          " and a pose in that interval; list its bodies with dsg "
                                          "shape ",
                                          source.agent_id));
}

absl::Status WriteBodies(Session* session, v1::GetAgentShapeRequest request, const ShapeVerb& verb,
                         std::ostream& out) {
  request.add_parts(v1::SHAPE_PART_VERTICES);
  request.add_parts(v1::SHAPE_PART_TOPOLOGY);
  BodyWriter writer(*session, verb);
  BodySource source;
  DSG_RETURN_IF_ERROR(ReadBodies(
      *session, request, &source,
      [&](const BodySource& from, const Body& body) { return writer.Take(from, body); }));
  DSG_RETURN_IF_ERROR(writer.status());
  if (writer.files().empty()) return NoBody(source, "vertices");
  TellWritten(writer.files(), source.revision, session->common().json, out);
  return absl::OkStatus();
}

absl::Status DrawPicture(Session* session, const v1::GetAgentShapeRequest& request,
                         const ShapeVerb& verb, std::ostream& out) {
  BodySource source;
  std::vector<Body> bodies;
  DSG_RETURN_IF_ERROR(
      ReadBodies(*session, request, &source, [&bodies](const BodySource&, Body body) {
        if (!body.joints_map.empty() || !body.points_map.empty()) bodies.push_back(std::move(body));
        return true;
      }));
  if (bodies.empty()) return NoBody(source, "joints or vertices");
  const std::string title = absl::StrCat(
      source.agent_id, "  ", session->times().Relative(bodies.front().time_ns), " to ",
      session->times().Relative(bodies.back().time_ns), "  revision ", source.revision);
  const picture::Picture picture = DrawBodies(
      bodies, {.width_px = verb.width_px, .title = title, .gap_ns = session->map().gap_ns_max});
  DSG_ASSIGN_OR_RETURN(Written written, WritePng(picture, verb.png, verb.force));
  written.counts.emplace(written.counts.begin(), "bodies", static_cast<int64_t>(bodies.size()));
  TellWritten({written}, source.revision, session->common().json, out);
  return absl::OkStatus();
}

// Narrows the request to the body nearest to --at.
absl::Status NarrowTo(const Session& session, const std::string& at,
                      v1::GetAgentShapeRequest* request) {
  DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", at, session.map()));
  DSG_ASSIGN_OR_RETURN(const std::optional<Body> body, ReadBodyAt(session, *request, at_ns));
  if (!body.has_value()) {
    return absl::NotFoundError(
        absl::StrCat("agent ", request->agent(), " has no body with a pose within ",
                     static_cast<double>(BodyReachNs(session)) / static_cast<double>(kNsPerSecond),
                     " s of --at ", at, "; list its bodies with dsg shape ", request->agent()));
  }
  request->set_from_ns(body->time_ns);
  request->set_to_ns(body->time_ns + 1);
  return absl::OkStatus();
}

absl::Status RunShape(Session* session, const ShapeVerb& verb, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(v1::GetAgentShapeRequest request, ShapeRequest(*session, verb));
  if (!verb.at.empty()) DSG_RETURN_IF_ERROR(NarrowTo(*session, verb.at, &request));
  if (verb.ply.empty() && verb.obj_folder.empty() && verb.png.empty()) {
    return ListBodies(session, std::move(request), out);
  }
  DSG_RETURN_IF_ERROR(PrepareFiles(verb));
  if (!verb.png.empty()) return DrawPicture(session, request, verb, out);
  return WriteBodies(session, std::move(request), verb, out);
}

}  // namespace

void AddShapeVerb(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<ShapeVerb>({.name = "shape",
                               .what = "The body shapes of an agent over time",
                               .example = "person-1 --from +20s --to +30s --obj bodies",
                               .takes = kQuestion | kLimit | kFormat,
                               .run = RunShape});
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  CLI::Option* from = app->add_option("--from", verb->from, "First TIME; default the first body");
  CLI::Option* to =
      app->add_option("--to", verb->to, "TIME to stop before; default after the last body");
  app->add_option("--at", verb->at, "The body nearest to this TIME alone, at most half a gap away")
      ->excludes(from)
      ->excludes(to);
  CLI::Option* ply =
      app->add_option("--ply", verb->ply, "Write the first body to this file, binary PLY")
          ->check(EndsIn({".ply"}));
  CLI::Option* obj = app->add_option("--obj", verb->obj_folder,
                                     "Write one Wavefront OBJ file per body to this folder");
  CLI::Option* png =
      app->add_option("--png", verb->png, "Draw bodies and skeletons over time as a picture")
          ->check(EndsIn({".png"}));
  ply->excludes(obj)->excludes(png);
  obj->excludes(png);
  app->add_option("--width", verb->width_px, "Width of the picture, pixels")
      ->check(Between(kTopViewWidthMin, kTopViewWidthMax))
      ->capture_default_str();
  app->add_flag("--force", verb->force, "Replace existing files");
}

}  // namespace dsg::cli
