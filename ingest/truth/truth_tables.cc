// SPDX-License-Identifier: Apache-2.0
#include "absl/strings/str_cat.h"
#include "ingest/files/output_file.h"
#include "ingest/truth/csv_table.h"
#include "ingest/truth/truth_parts_internal.h"

namespace dsg::truth {
namespace {

using ingest::AppendFixed;
using ingest::AppendInteger;

constexpr char kRobotHeader[] =
    "time_ns,x,y,z,qx,qy,qz,qw,vx,vy,vz,gyro_bias_x,gyro_bias_y,gyro_bias_z,accel_bias_x,"
    "accel_bias_y,accel_bias_z";
constexpr char kDetectionHeader[] =
    "id,time_ns,human,visibility,distance_m,touches_border,torso_x,torso_y,torso_z,detected_x,"
    "detected_y,detected_z";
constexpr int kJointDecimals = 6;

const std::string& HumanHeader() {
  static const std::string header = [] {
    std::string text = "time_ns,human,x,y,z,qx,qy,qz,qw";
    for (int joint = 0; joint < ingest::kJointCount; ++joint) {
      for (const char* axis : {"x", "y", "z"}) absl::StrAppend(&text, ",joint", joint, "_", axis);
    }
    return text;
  }();
  return header;
}

void AppendVector(const Eigen::Vector3d& vector, std::string* out) {
  for (int axis = 0; axis < 3; ++axis) {
    out->push_back(',');
    AppendExact(vector[axis], out);
  }
}

void AppendPose(const Pose3d& pose, std::string* out) {
  AppendVector(pose.position, out);
  for (int i = 0; i < 4; ++i) {
    out->push_back(',');
    AppendExact(pose.orientation.coeffs()[i], out);
  }
}

// A bool or an index; the caller says up to what.
int SmallInteger(int low, int high, CsvTable* table) {
  const int64_t value = table->Integer();
  if (value >= low && value <= high) return static_cast<int>(value);
  table->Fail(absl::StrCat(value, " is not from ", low, " to ", high));
  return 0;
}

}  // namespace

void AppendRobotHeader(std::string* out) { absl::StrAppend(out, kRobotHeader, "\n"); }
void AppendHumanHeader(std::string* out) { absl::StrAppend(out, HumanHeader(), "\n"); }
void AppendDetectionHeader(std::string* out) { absl::StrAppend(out, kDetectionHeader, "\n"); }

void AppendRobotRow(const RobotState& state, std::string* out) {
  AppendInteger(state.time_ns, out);
  AppendPose(state.map_T_body, out);
  AppendVector(state.velocity_map, out);
  AppendVector(state.gyro_bias, out);
  AppendVector(state.accel_bias, out);
  out->push_back('\n');
}

void AppendHumanRow(const HumanState& state, std::string* out) {
  AppendInteger(state.time_ns, out);
  out->push_back(',');
  AppendInteger(state.human, out);
  AppendPose(state.map_T_torso, out);
  for (const Eigen::Vector3d& joint : state.joints_map) {
    for (int axis = 0; axis < 3; ++axis) {
      out->push_back(',');
      AppendFixed(joint[axis], kJointDecimals, out);
    }
  }
  out->push_back('\n');
}

void AppendDetectionRow(const DetectionTruth& detection, std::string* out) {
  absl::StrAppend(out, detection.id, ",", detection.time_ns, ",", detection.human, ",");
  AppendExact(detection.visibility, out);
  out->push_back(',');
  AppendExact(detection.distance_m, out);
  absl::StrAppend(out, ",", detection.touches_border ? 1 : 0);
  AppendVector(detection.torso_map, out);
  AppendVector(detection.detected_torso_map, out);
  out->push_back('\n');
}

absl::Status ReadRobotTable(std::string_view bytes, const std::string& file, Truth* truth) {
  CsvTable table(bytes, file, kRobotHeader);
  while (table.NextRow()) {
    RobotState state;
    state.time_ns = table.Integer();
    if (!truth->robot.empty() && state.time_ns <= truth->robot.back().time_ns) {
      table.Fail("is not after the row before");
    }
    state.map_T_body = table.Pose();
    state.velocity_map = table.Vector();
    state.gyro_bias = table.Vector();
    state.accel_bias = table.Vector();
    truth->robot.push_back(state);
  }
  return table.status();
}

absl::Status ReadHumanTable(std::string_view bytes, const std::string& file, Truth* truth) {
  CsvTable table(bytes, file, HumanHeader());
  const int human_max = static_cast<int>(truth->humans.size()) - 1;
  while (table.NextRow()) {
    HumanState state;
    state.time_ns = table.Integer();
    state.human = SmallInteger(0, human_max, &table);
    state.map_T_torso = table.Pose();
    for (Eigen::Vector3d& joint : state.joints_map) joint = table.Vector();
    truth->human_states.push_back(state);
  }
  return table.status();
}

absl::Status ReadDetectionTable(std::string_view bytes, const std::string& file, Truth* truth) {
  CsvTable table(bytes, file, kDetectionHeader);
  const int human_max = static_cast<int>(truth->humans.size()) - 1;
  while (table.NextRow()) {
    DetectionTruth detection;
    detection.id = table.Integer();
    detection.time_ns = table.Integer();
    detection.human = SmallInteger(-1, human_max, &table);
    detection.visibility = table.Number();
    detection.distance_m = table.Number();
    detection.touches_border = SmallInteger(0, 1, &table) == 1;
    detection.torso_map = table.Vector();
    detection.detected_torso_map = table.Vector();
    truth->detections.push_back(detection);
  }
  return table.status();
}

}  // namespace dsg::truth
