// SPDX-License-Identifier: Apache-2.0
// Simulated logs (DSG_LOGS: a folder of `dsg-simulate sensors` outputs): the detections of the log
// without names, put into the map by the truth's table; who they were stays in the table.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "ingest/log/log_source.h"
#include "tests/unit/ingest/agents/tracking/people_util.h"

namespace dsg::ingest {
namespace {

std::map<int64_t, evaluation::TrueDetection> ReadTable(const std::string& path) {
  std::map<int64_t, evaluation::TrueDetection> table;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream in(line);
    int64_t id = 0;
    double distance_m = 0.0;
    int border = 0;
    evaluation::TrueDetection row;
    in >> id >> row.time_ns >> row.human >> row.visibility >> distance_m >> border;
    for (int i = 0; i < 3; ++i) in >> row.torso_map[i];
    for (int i = 0; i < 3; ++i) in >> row.detected_torso_map[i];
    EXPECT_TRUE(static_cast<bool>(in)) << path << ": " << line;
    table[id] = row;
  }
  return table;
}

bool IsAtBorder(const HumanDetection& detection, const CameraCalibration& camera) {
  const Eigen::Vector4d& box = detection.box_px;
  return box[0] <= 5.0 || box[1] <= 5.0 || box[2] >= camera.width - 6.0 ||
         box[3] >= camera.height - 6.0;
}

PersonObservation MakeObservation(const HumanDetection& detection, const Eigen::Vector3d& torso_map,
                                  const Pose3d& map_T_camera) {
  PersonObservation observation = ObservationAt(torso_map, 1.0);
  const Eigen::Vector3d ray = torso_map - map_T_camera.position;
  const double range_m = ray.norm();
  const double along_m = 0.12 * range_m + 0.1;
  const double across_m = 0.02 * range_m + 0.08;
  const Eigen::Matrix3d outer = ray * ray.transpose() / (range_m * range_m);
  observation.position_covariance_map =
      along_m * along_m * outer + across_m * across_m * (Eigen::Matrix3d::Identity() - outer);
  observation.camera_map = map_T_camera.position;
  observation.has_joints = detection.has_joints;
  for (size_t joint = 0; joint < observation.joints_torso.size(); ++joint) {
    observation.joints_torso[joint] = map_T_camera.orientation * detection.joints_root[joint];
  }
  observation.joint_visibility = detection.joint_visibility;
  observation.shape_coefficients = detection.shape_coefficients;
  return observation;
}

enum class Border { kUsed, kWeak, kDropped };

struct Reading {
  Border border = Border::kWeak;
  bool has_shape = true;
};

PeopleLog ReadPeople(const std::string& folder, const Reading& reading) {
  PeopleLog out;
  const std::map<int64_t, evaluation::TrueDetection> table =
      ReadTable(folder + "/truth/detections.csv");
  for (const auto& [id, row] : table) out.truth.push_back(row);
  LogOptions options;
  options.poses = PoseSource::kGroundTruth;
  const auto log = OpenLog(folder + "/log", options);
  EXPECT_TRUE(log.ok()) << log.status();
  Pose3d map_T_body;
  while (log.ok()) {
    const auto next = (*log)->Next();
    EXPECT_TRUE(next.ok()) << next.status();
    if (!next.ok() || !next->has_value()) break;
    if (const auto* const pose = std::get_if<PoseMeasurement>(&**next)) {
      map_T_body = pose->pose.map_T_agent;
    } else if (const auto* const image = std::get_if<ImageMeasurement>(&**next)) {
      if (image->channel == "depth0") out.images[image->time_ns];
    } else if (const auto* const detection = std::get_if<HumanDetection>(&**next)) {
      const CameraCalibration* const camera = (*log)->info().rig.FindCamera(detection->camera);
      const Eigen::Vector4d& box = detection->box_px;
      if (std::max(box[2] - box[0], box[3] - box[1]) <= 30.0) continue;
      const bool is_border = IsAtBorder(*detection, *camera);
      if (is_border && reading.border == Border::kDropped) continue;
      PersonObservation observation =
          MakeObservation(*detection, table.at(detection->id).detected_torso_map,
                          map_T_body * camera->body_T_camera);
      observation.time_ns = detection->time_ns;
      observation.detection_id = detection->id;
      observation.is_weak = is_border && reading.border == Border::kWeak;
      if (!reading.has_shape) observation.shape_coefficients.clear();
      out.images[detection->time_ns].push_back(std::move(observation));
    }
  }
  return out;
}

evaluation::HumanResult Report(const std::string& name, const char* mode, const PeopleLog& log,
                               const TrackerOptions& options) {
  TrackerCounts counts;
  const auto begin = std::chrono::steady_clock::now();
  PersonTracker tracker(options);
  const std::vector<int64_t> tracks = ConfirmedTracks(RunAll(log, &tracker));
  counts = tracker.counts();
  const evaluation::HumanResult result = Score(log, tracker, tracks);
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  std::printf(
      "%-14s %-12s IDF1 %.3f MOTA %.3f sw %2d tr/hum %.2f err raw %.2f filt %.2f trk %.2f m, "
      "poses %d of %d, tracks %d dropped %d again %d same_as %d dup %d weak %d, %.2f ms/image\n",
      name.c_str(), mode, result.idf1.value_or(-1.0), result.mota.value_or(-1.0),
      static_cast<int>(result.id_switch_count), result.tracks_per_human.value_or(-1.0),
      result.raw_m.value_or(-1.0), result.filtered_m.value_or(-1.0),
      result.tracked_m.value_or(-1.0), static_cast<int>(result.scored_pose_count),
      static_cast<int>(result.detection_count), static_cast<int>(counts.track_count),
      static_cast<int>(counts.dropped_track_count), static_cast<int>(counts.found_again_count),
      static_cast<int>(counts.same_as_count), static_cast<int>(counts.duplicate_count),
      static_cast<int>(counts.weak_unused_count), ms / static_cast<double>(log.images.size()));
  return result;
}

TEST(SimulatedPeople, KeepTheirIdentities) {
  const char* const folder = std::getenv("DSG_LOGS");
  if (folder == nullptr) GTEST_SKIP() << "set DSG_LOGS to a folder of simulated logs";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!std::filesystem::exists(entry.path() / "truth" / "detections.csv")) continue;
    const std::string name = entry.path().filename();
    const std::string path = entry.path();
    const auto tracked = Report(name, "default", ReadPeople(path, {}), {});
    Report(name, "filtered", ReadPeople(path, {Border::kDropped, true}), {});
    Report(name, "border used", ReadPeople(path, {Border::kUsed, true}), {});
    Report(name, "no shape", ReadPeople(path, {Border::kWeak, false}), {});
    const auto paper =
        Report(name, "paper", ReadPeople(path, {Border::kDropped, true}), PaperTrackerOptions());
    EXPECT_GE(tracked.idf1.value_or(0.0), 0.6);
    EXPECT_GT(tracked.idf1.value_or(0.0), paper.idf1.value_or(0.0));
  }
}

}  // namespace
}  // namespace dsg::ingest
