// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/drift_files.h"

#include "absl/strings/str_cat.h"
#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/truth/truth.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

constexpr int kDecimals = 9;

void AppendNumbers(const std::vector<double>& numbers, const char* separator, std::string* out) {
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0) out->append(separator);
    ingest::AppendFixed(numbers[i], kDecimals, out);
  }
}

absl::Status WriteOdometry(const std::vector<StampedPose>& poses, const std::string& path) {
  DSG_ASSIGN_OR_RETURN(ingest::OutputFile file, ingest::OutputFile::Create(path));
  file.buffer() =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z []\n";
  for (const StampedPose& pose : poses) {
    std::string& row = file.buffer();
    const Eigen::Vector3d& p = pose.map_T_body.position;
    const Eigen::Quaterniond& q = pose.map_T_body.orientation;
    ingest::AppendInteger(pose.time_ns, &row);
    row.push_back(',');
    AppendNumbers({p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}, ",", &row);
    row.push_back('\n');
    DSG_RETURN_IF_ERROR(file.Flush());
  }
  return file.Commit();
}

std::string LoopLine(const SimulatedLoop& loop, const DriftOptions& options) {
  const Eigen::Vector3d& p = loop.from_T_to.position;
  const Eigen::Quaterniond& q = loop.from_T_to.orientation;
  std::string line = absl::StrCat("{\"from_ns\": ", loop.from_ns, ", \"to_ns\": ", loop.to_ns,
                                  ", \"translation\": [");
  AppendNumbers({p.x(), p.y(), p.z()}, ", ", &line);
  line.append("], \"rotation\": [");
  AppendNumbers({q.x(), q.y(), q.z(), q.w()}, ", ", &line);
  line.append("], \"sigma_m\": ");
  ingest::AppendFixed(options.loop_sigma_m, kDecimals, &line);
  line.append(", \"sigma_rad\": ");
  ingest::AppendFixed(options.loop_sigma_rad, kDecimals, &line);
  line.append("}\n");
  return line;
}

absl::Status WriteLoops(const std::vector<SimulatedLoop>& loops, const DriftOptions& options,
                        const std::string& out) {
  std::string lines;
  std::string truth = "line,is_right\n";
  for (size_t i = 0; i < loops.size(); ++i) {
    lines += LoopLine(loops[i], options);
    absl::StrAppend(&truth, i + 1, ",", loops[i].is_right ? 1 : 0, "\n");
  }
  DSG_RETURN_IF_ERROR(ingest::WriteFile(out + "/loops.jsonl", std::move(lines)));
  return ingest::WriteFile(out + "/loop_truth.csv", std::move(truth));
}

}  // namespace

absl::StatusOr<DriftSummary> WriteDrift(const std::string& folder, const std::string& out,
                                        const DriftOptions& options) {
  DSG_RETURN_IF_ERROR(options.Validate());
  DSG_ASSIGN_OR_RETURN(const truth::Truth truth, truth::ReadTruth(folder + "/truth"));
  std::vector<StampedPose> poses;
  for (const truth::RobotState& state : truth.robot) {
    poses.push_back({state.time_ns, state.map_T_body});
  }
  const std::vector<StampedPose> odometry = AddDrift(poses, options);
  const std::vector<SimulatedLoop> loops = DrawLoops(poses, options);
  DSG_RETURN_IF_ERROR(ingest::CheckIsFolderOrMissing(out));
  DSG_RETURN_IF_ERROR(ingest::MakeFolder(out));
  DSG_RETURN_IF_ERROR(WriteLoops(loops, options, out));
  DSG_RETURN_IF_ERROR(WriteOdometry(odometry, out + "/odometry.csv"));
  DriftSummary summary;
  summary.pose_count = static_cast<int64_t>(poses.size());
  for (const SimulatedLoop& loop : loops) {
    ++(loop.is_right ? summary.right_count : summary.wrong_count);
  }
  for (size_t i = 1; i < poses.size(); ++i) {
    summary.way_m += (poses[i].map_T_body.position - poses[i - 1].map_T_body.position).norm();
  }
  if (!poses.empty()) {
    summary.end_error_m =
        (odometry.back().map_T_body.position - poses.back().map_T_body.position).norm();
  }
  return summary;
}

}  // namespace dsg::simulator
