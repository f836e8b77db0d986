// SPDX-License-Identifier: Apache-2.0
// The verb shape: the body of an agent over time, as a table or as mesh files.
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/export/mesh_file.h"
#include "query/cli/json.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/topology.h"

namespace dsg::cli {
namespace {

struct ShapeVerb {
  std::string agent;
  std::string from;
  std::string to;
  // At most one of the two: a file for the first body, a folder for one file per body.
  std::string ply;
  std::string obj_folder;
  bool force = false;
};

// Source: Loper et al., "SMPL: a skinned multi-person linear model", 2015: 24 joints, hands last.
constexpr int kJointCount = 24;
constexpr int kLeftHand = 22;
constexpr int kRightHand = 23;

std::string CountOrDash(int count) { return count == 0 ? "-" : absl::StrCat(count); }

std::string JointText(const v1::AgentShape& body, int joint) {
  const auto& joints = body.shape().joints();
  if (joints.size() != 3 * kJointCount || !body.has_pose()) return "-";
  const Eigen::Vector3d joint_agent(static_cast<double>(joints[3 * joint]),
                                    static_cast<double>(joints[3 * joint + 1]),
                                    static_cast<double>(joints[3 * joint + 2]));
  const Pose3d map_T_agent = FromProto(body.pose());
  const Eigen::Vector3d joint_map = map_T_agent * joint_agent;
  return absl::StrCat(Fixed(joint_map.x(), 2), " ", Fixed(joint_map.y(), 2), " ",
                      Fixed(joint_map.z(), 2));
}

// One line per body: what is stored of it, and where its hands are in the map. Only skeletons of 24
// joints in the order of SMPL show hands.
std::string RenderShapes(const v1::GetAgentShapeResponse& reply, const TimeText& times) {
  std::vector<Column> columns{{"time", Align::kRight},        {"pose", Align::kRight},
                              {"shape", Align::kRight},       {"joints", Align::kRight},
                              {"vertices", Align::kRight},    {"left hand m", Align::kRight},
                              {"right hand m", Align::kRight}};
  if (times.has_dates()) columns.push_back({"date"});
  Table table(columns);
  for (const v1::AgentShape& body : reply.shapes()) {
    const v1::BodyShape& shape = body.shape();
    std::vector<std::string> cells{times.Relative(shape.time_ns()),
                                   CountOrDash(shape.pose_coefficients_size()),
                                   CountOrDash(shape.shape_coefficients_size()),
                                   CountOrDash(shape.joints_size() / 3),
                                   CountOrDash(body.vertex_count()),
                                   JointText(body, kLeftHand),
                                   JointText(body, kRightHand)};
    if (times.has_dates()) cells.push_back(times.Date(shape.time_ns()));
    table.AddRow(std::move(cells));
  }
  return absl::StrCat(table.Render(), Counted(reply.shapes_size(), "body shape"), " of ",
                      reply.agent_id(), " (revision ", reply.header().read_revision(), ")\n");
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
  v1::GetAgentShapeResponse all;
  const int64_t count_max = EntriesLeft(session->common().limit);
  const auto merge = [&](const v1::GetAgentShapeResponse& message) {
    all.MergeFrom(message);
    return all.shapes_size() < count_max;
  };
  DSG_RETURN_IF_ERROR(session->Read(&query::Api::GetAgentShape, request, merge));
  if (all.shapes_size() > count_max) {
    all.mutable_shapes()->DeleteSubrange(static_cast<int>(count_max),
                                         all.shapes_size() - static_cast<int>(count_max));
  }
  if (session->common().json) return WriteJson(all, out);
  out << RenderShapes(all, session->times());
  return absl::OkStatus();
}

// Writes bodies as they arrive, without keeping them.
class BodyWriter {
 public:
  BodyWriter(const Session& session, const ShapeVerb& verb)
      : verb_(verb),
        count_max_(verb.obj_folder.empty() ? 1 : EntriesLeft(session.common().limit)),
        times_(session.times()) {}

  /// False when no more is needed; status() then says whether that is an error.
  bool Take(const v1::GetAgentShapeResponse& message) {
    if (message.has_header()) revision_ = message.header().read_revision();
    if (!message.agent_id().empty()) agent_ = message.agent_id();
    for (const v1::Asset& asset : message.topologies()) {
      status_ = TakeTopology(asset);
      if (!status_.ok()) return false;
    }
    for (const v1::AgentShape& body : message.shapes()) {
      if (static_cast<int64_t>(files_.size()) >= count_max_) return false;
      // A body without a pose has no place in the map.
      if (body.shape().vertices().empty() || !body.has_pose()) continue;
      status_ = Write(body);
      if (!status_.ok()) return false;
    }
    return static_cast<int64_t>(files_.size()) < count_max_;
  }

  const absl::Status& status() const { return status_; }
  const std::vector<Written>& files() const { return files_; }
  Revision revision() const { return revision_; }
  const std::string& agent() const { return agent_; }

 private:
  absl::Status TakeTopology(const v1::Asset& asset) {
    if (DecodeTopology(asset.content(), &topologies_[asset.sha256()])) return absl::OkStatus();
    return absl::DataLossError(absl::StrCat(
        "the topology of agent ", agent_, " has media type ", Printable(asset.media_type()),
        " instead of ", std::string(kTopologyMediaType), "; commit one of that type"));
  }

  BodyMesh MeshOf(const v1::AgentShape& body) const {
    const Pose3d map_T_agent = FromProto(body.pose());
    BodyMesh mesh;
    const auto& vertices = body.shape().vertices();
    for (int i = 0; i + 2 < vertices.size(); i += 3) {
      const Eigen::Vector3f point_agent(vertices[i], vertices[i + 1], vertices[i + 2]);
      mesh.points_map.push_back((map_T_agent * point_agent.cast<double>()).cast<float>());
    }
    const auto topology = topologies_.find(body.topology_sha256());
    if (topology != topologies_.end()) mesh.faces = topology->second.faces;
    mesh.comment = absl::StrCat("agent ", agent_, " at ", times_.Full(body.shape().time_ns()),
                                ", revision ", revision_, ", metres, z up");
    return mesh;
  }

  absl::Status Write(const v1::AgentShape& body) {
    const bool is_obj = !verb_.obj_folder.empty();
    const std::string path =
        is_obj ? absl::StrCat(verb_.obj_folder, "/", agent_, "_", body.shape().time_ns(), ".obj")
               : verb_.ply;
    const BodyMesh mesh = MeshOf(body);
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, verb_.force));
    DSG_RETURN_IF_ERROR(is_obj ? WriteBodyObj(mesh, &file) : WriteBodyPly(mesh, &file));
    DSG_RETURN_IF_ERROR(file.Commit());
    files_.push_back({.format = is_obj ? "obj" : "ply",
                      .path = path,
                      .byte_count = file.byte_count(),
                      .counts = {{"vertices", static_cast<int64_t>(mesh.points_map.size())},
                                 {"faces", static_cast<int64_t>(mesh.faces.size())}}});
    return absl::OkStatus();
  }

  const ShapeVerb& verb_;
  const int64_t count_max_;
  const TimeText& times_;
  absl::Status status_;
  Revision revision_ = 0;
  std::string agent_;
  std::map<std::string, Topology> topologies_;
  std::vector<Written> files_;
};

absl::Status PrepareFiles(const ShapeVerb& verb) {
  if (!verb.ply.empty()) return CheckMayWrite(verb.ply, verb.force);
  std::error_code failure;
  std::filesystem::create_directories(verb.obj_folder, failure);
  if (!failure) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--obj ", verb.obj_folder, ": cannot create the folder (",
                                failure.message(), "); name another folder"),
                   {{"field", "--obj"}, {"value", verb.obj_folder}});
}

absl::Status WriteBodies(Session* session, v1::GetAgentShapeRequest request, const ShapeVerb& verb,
                         std::ostream& out) {
  DSG_RETURN_IF_ERROR(PrepareFiles(verb));
  request.add_parts(v1::SHAPE_PART_VERTICES);
  request.add_parts(v1::SHAPE_PART_TOPOLOGY);
  BodyWriter writer(*session, verb);
  DSG_RETURN_IF_ERROR(session->Read(
      &query::Api::GetAgentShape, request,
      [&](const v1::GetAgentShapeResponse& message) { return writer.Take(message); }));
  DSG_RETURN_IF_ERROR(writer.status());
  if (writer.files().empty()) {
    return absl::NotFoundError(absl::StrCat("agent ", writer.agent(),
                                            " has no body with vertices and a pose in that "
                                            "interval; list its bodies with dsg shape ",
                                            writer.agent()));
  }
  TellWritten(writer.files(), writer.revision(), session->common().json, out);
  return absl::OkStatus();
}

absl::Status RunShape(Session* session, const ShapeVerb& verb, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(v1::GetAgentShapeRequest request, ShapeRequest(*session, verb));
  if (verb.ply.empty() && verb.obj_folder.empty()) {
    return ListBodies(session, std::move(request), out);
  }
  return WriteBodies(session, std::move(request), verb, out);
}

}  // namespace

void AddShapeVerb(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<ShapeVerb>({.name = "shape",
                               .what = "The body shapes of an agent over time",
                               .example = "person-1 --from +20s --to +30s --obj bodies",
                               .takes = kQuestion | kLimit,
                               .run = RunShape});
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--from", verb->from, "First TIME; default the first body");
  app->add_option("--to", verb->to, "TIME to stop before; default after the last body");
  CLI::Option* ply =
      app->add_option("--ply", verb->ply, "Write the first body to this file, binary PLY");
  CLI::Option* obj = app->add_option("--obj", verb->obj_folder,
                                     "Write one Wavefront OBJ file per body to this folder");
  ply->excludes(obj);
  app->add_flag("--force", verb->force, "Replace existing files");
}

}  // namespace dsg::cli
