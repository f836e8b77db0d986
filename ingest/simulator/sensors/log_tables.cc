// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/log_tables.h"

#include "absl/strings/str_cat.h"
#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/simulator/body/body_skin.h"
#include "ingest/simulator/body/detection_json.h"
#include "ingest/simulator/sensors/label_colors.h"
#include "ingest/simulator/sensors/log_layout.h"
#include "ingest/simulator/sensors/rig_files.h"
#include "ingest/simulator/sensors/truth_builder.h"
#include "ingest/simulator/world/catalogue.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

using ingest::AppendFixed;
using ingest::AppendInteger;
using ingest::WriteFile;

constexpr char kImu[] = "imu0";
constexpr char kTruth[] = "state_groundtruth_estimate0";
constexpr char kDetections[] = "detections0";

void AppendVector(const Eigen::Vector3d& vector, std::string* out) {
  for (int axis = 0; axis < 3; ++axis) {
    out->push_back(',');
    AppendFixed(vector[axis], 9, out);
  }
}

absl::Status WriteImageTables(const SensorSession& session, const std::string& log_folder) {
  for (const ImageChannel& channel : ImageChannels()) {
    const std::string folder = ChannelFolder(log_folder, channel.name);
    std::string table = "#timestamp [ns],filename\n";
    for (int64_t frame = 0; frame < session.frame_count(); ++frame) {
      if (channel.keyframes_only && !session.IsKeyframe(frame)) continue;
      const TimeNs stamp_ns = session.StampOf(frame);
      absl::StrAppend(&table, stamp_ns, ",", stamp_ns, channel.ending, "\n");
    }
    DSG_RETURN_IF_ERROR(WriteFile(folder + "/data.csv", std::move(table)));
    const std::string name(channel.name);
    const ingest::CameraCalibration* camera =
        session.told_rig().FindCamera(name.substr(0, name.find('_')));
    DSG_CHECK(camera != nullptr);
    DSG_RETURN_IF_ERROR(WriteFile(folder + "/sensor.yaml", CameraYaml(*camera)));
  }
  return absl::OkStatus();
}

absl::Status WriteImu(const SensorSession& session, const std::string& log_folder) {
  const std::string folder = ChannelFolder(log_folder, kImu);
  DSG_RETURN_IF_ERROR(ingest::MakeFolder(folder));
  std::string table =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& sample : session.imu()) {
    AppendInteger(session.begin_ns() + sample.time_ns + session.imu_delay_ns(), &table);
    AppendVector(sample.gyro, &table);
    AppendVector(sample.accel, &table);
    table.push_back('\n');
  }
  DSG_RETURN_IF_ERROR(WriteFile(folder + "/data.csv", std::move(table)));
  return WriteFile(folder + "/sensor.yaml", ImuYaml(*session.told_rig().imu));
}

absl::Status WriteRobotPoses(const SensorSession& session, const std::string& log_folder) {
  const std::string folder = ChannelFolder(log_folder, kTruth);
  DSG_RETURN_IF_ERROR(ingest::MakeFolder(folder));
  std::string table =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
      "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
      "b_a_RS_S_z [m s^-2]\n";
  for (const ImuSample& sample : session.imu()) {
    const MotionState motion = session.robot().StateAt(sample.time_ns);
    AppendInteger(session.begin_ns() + sample.time_ns, &table);
    AppendVector(motion.map_T_body.position, &table);
    const Eigen::Quaterniond& q = motion.map_T_body.orientation;
    for (const double number : {q.w(), q.x(), q.y(), q.z()}) {
      table.push_back(',');
      AppendFixed(number, 9, &table);
    }
    AppendVector(motion.velocity_map, &table);
    AppendVector(sample.gyro_bias, &table);
    AppendVector(sample.accel_bias, &table);
    table.push_back('\n');
  }
  DSG_RETURN_IF_ERROR(WriteFile(folder + "/data.csv", std::move(table)));
  return WriteFile(folder + "/sensor.yaml", GroundTruthYaml());
}

ingest::HumanDetection WithSkin(const SensorSession& session, const DetectionOutput& output) {
  ingest::HumanDetection detection = output.detection;
  if (!output.body.has_value()) return detection;
  const SkinPair skins =
      MakeSkins(*output.body, ModelOf(session, *output.body), detection.joints_root);
  for (const Eigen::Vector3f& vertex : skins.detected_root_camera) {
    detection.vertices_root.insert(detection.vertices_root.end(), vertex.begin(), vertex.end());
  }
  return detection;
}

absl::Status WriteDetections(const SensorSession& session,
                             const std::vector<DetectionOutput>& detections,
                             const std::string& log_folder) {
  const std::string folder = ChannelFolder(log_folder, kDetections);
  DSG_RETURN_IF_ERROR(ingest::MakeFolder(folder));
  DSG_ASSIGN_OR_RETURN(ingest::OutputFile file, ingest::OutputFile::Create(folder + "/data.jsonl"));
  for (const DetectionOutput& output : detections) {
    absl::StrAppend(&file.buffer(), DetectionJson(WithSkin(session, output)), "\n");
    DSG_RETURN_IF_ERROR(file.Flush());
  }
  DSG_RETURN_IF_ERROR(file.Commit());
  if (!session.options().has_bodies) return absl::OkStatus();
  const SkinTopology& skin = SkinTopologyOfAll();
  return WriteFile(folder + "/topology.json", TopologyJson(skin.bindings.size(), skin.faces));
}

}  // namespace

absl::Status WriteLogTables(const SensorSession& session,
                            const std::vector<DetectionOutput>& detections,
                            const std::string& log_folder) {
  DSG_RETURN_IF_ERROR(WriteImageTables(session, log_folder));
  DSG_RETURN_IF_ERROR(WriteImu(session, log_folder));
  DSG_RETURN_IF_ERROR(WriteRobotPoses(session, log_folder));
  DSG_RETURN_IF_ERROR(WriteDetections(session, detections, log_folder));
  return WriteFile(log_folder + "/labels.csv", LabelTable(Labels()));
}

std::string LogJson(const SensorSession& session, size_t detection_count) {
  const int every = session.options().keyframe_every;
  const int64_t keyframe_count = (session.frame_count() + every - 1) / every;
  std::string counts;
  for (const ImageChannel& channel : ImageChannels()) {
    if (std::string_view(channel.name).ends_with("_clean")) continue;
    absl::StrAppend(&counts, "    \"", channel.name,
                    "\": ", channel.keyframes_only ? keyframe_count : session.frame_count(), ",\n");
  }
  absl::StrAppend(&counts, "    \"", kImu, "\": ", session.imu().size(), ",\n    \"", kDetections,
                  "\": ", detection_count, "\n");
  return absl::StrCat("{\n  \"format\": \"dsg-sensors\",\n  \"version\": 1,\n",
                      "  \"generator\": \"dsg-simulate\",\n  \"command\": \"",
                      session.options().CommandLine(), "\",\n  \"counts\": {\n", counts,
                      "  }\n}\n");
}

}  // namespace dsg::simulator
