// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/robot_model.h"

#include <filesystem>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/objects/shapes/mesh_file.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"

namespace dsg::ingest {
namespace {

constexpr double kRobotSizeMaxM = 50.0;

absl::Status Malformed(const std::string& path, const std::string& message) {
  return MakeError(Reason::kFileMalformed, absl::StrCat(path, ": ", message), {{"file", path}});
}

absl::StatusOr<TriangleSoup> ReadMesh(const std::string& path, const std::string& ending,
                                      const std::string& bytes) {
  if (ending == ".ply") return ReadPly(bytes, path);
  if (ending == ".obj") return ReadObj(bytes, path);
  return Malformed(path, "a robot's model ends in .ply or .obj; convert it");
}

}  // namespace

absl::StatusOr<RobotModel> ReadRobotModel(const std::string& path) {
  const std::string ending =
      absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  std::error_code error;
  const uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > static_cast<uintmax_t>(kCadFileBytesMax)) {
    return Malformed(path, absl::StrCat("has ", size, " bytes, more than ", kCadFileBytesMax,
                                        "; simplify the model"));
  }
  DSG_ASSIGN_OR_RETURN(LogFile file, ReadLogFile(path));
  DSG_ASSIGN_OR_RETURN(const TriangleSoup mesh, ReadMesh(path, ending, file.bytes));
  if (mesh.faces.empty()) return Malformed(path, "has no faces; points alone are no shape");
  RobotModel model;
  for (const auto& face : mesh.faces) {
    for (const uint32_t corner : face) model.box_robot.extend(mesh.vertices[corner]);
  }
  const double edge_m = model.box_robot.sizes().maxCoeff();
  if (!(edge_m <= kRobotSizeMaxM) || !(edge_m > 0.0)) {
    return Malformed(path, absl::StrCat("is ", edge_m, " m long; a robot of at most ",
                                        kRobotSizeMaxM, " m is due: models are in metres"));
  }
  model.asset.media_type = ending == ".ply" ? "model/ply" : "model/obj";
  model.asset.sha256 = ComputeSha256(file.bytes);
  model.asset.content = std::move(file.bytes);
  return model;
}

void SetRobotModel(const RobotModel& model, Node* robot) {
  if (!robot->agent.has_value()) robot->agent.emplace();
  robot->agent->body_model = model.asset.sha256;
  robot->box_node = model.box_robot;
}

}  // namespace dsg::ingest
