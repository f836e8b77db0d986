// SPDX-License-Identifier: Apache-2.0
// What really was: the ground truth beside a simulated log, as plain data and as a folder.
// Refuses to be read by dsg-ingest; the evaluation alone opens it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/human_detection.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"

namespace dsg::truth {

/// Names the layout; readers refuse others.
inline constexpr int kTruthVersion = 1;

/// Frames: map. Units: metres, radians, nanoseconds on the log's clock.
struct RobotState {
  TimeNs time_ns = 0;
  Pose3d map_T_body;
  Eigen::Vector3d velocity_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
};

struct HumanState {
  TimeNs time_ns = 0;
  /// Index in Truth::humans.
  int human = 0;
  Pose3d map_T_torso;
  std::array<Eigen::Vector3d, ingest::kJointCount> joints_map;
};

struct Human {
  std::string name;
  std::array<double, ingest::kShapeCount> shape{};
  double height_m = 0.0;
};

/// Where a detection came from. A detection of nobody has human = -1.
struct DetectionTruth {
  int64_t id = 0;
  TimeNs time_ns = 0;
  int human = -1;
  /// Share of the body's pixels that the image shows, 0 to 1.
  double visibility = 0.0;
  double distance_m = 0.0;
  bool touches_border = false;
  /// Pelvis in the map: as it was, and as the detection says, by the true robot pose.
  Eigen::Vector3d torso_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d detected_torso_map = Eigen::Vector3d::Zero();
};

struct Object {
  std::string name;
  std::string class_name;
  int class_id = 0;
  /// Instance within the class, as in the label images.
  int instance = 0;
  int room = 0;
  /// At the start of the log; origin in the middle of the box.
  Pose3d map_T_object;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  /// File under truth/cad of its CAD model; empty when it has none. The model's origin is in the
  /// middle of its floor face: map_T_model = map_T_object * (0, 0, -size.z / 2).
  std::string cad_file;
  /// Turns about z that look alike: 1, 2, 4.
  int symmetry_order = 1;
  /// Share of the surface that some depth image showed, 0 to 1.
  double observed = 0.0;
};

struct Room {
  std::string name;
  std::string class_name;
  Polygon2d footprint_map;
  double ceiling_m = 0.0;
};

struct Door {
  int room_a = 0;
  int room_b = 0;
  Eigen::Vector2d from_map = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_map = Eigen::Vector2d::Zero();
  double height_m = 0.0;
};

struct Pick {
  /// Indices.
  int object = 0;
  int human = 0;
  int room = 0;
  TimeNs pick_ns = 0;
  /// kTimeMax if it is still carried at the end.
  TimeNs place_ns = kTimeMax;
  Pose3d map_T_object_after;
  /// Whether a camera saw the object before and after, and the person while taking it.
  bool observed = false;
};

/// Occupancy of the static world between 0.1 and 1.8 m above the floor.
struct FreeGrid {
  Eigen::Vector2d origin_map = Eigen::Vector2d::Zero();
  double cell_m = 0.1;
  int width = 0;
  int height = 0;
  /// Row by row from low y: bit 0 free, bit 1 observed by a depth image, bit 2 door band.
  std::vector<uint8_t> cells;
};
inline constexpr uint8_t kCellFree = 1;
inline constexpr uint8_t kCellObserved = 2;
inline constexpr uint8_t kCellDoorBand = 4;

struct Truth {
  std::string world;
  uint64_t seed = 0;
  TimeNs begin_ns = 0;
  TimeNs end_ns = 0;
  std::vector<SemanticLabel> labels;
  /// As the sensors really are; the log's is perturbed.
  ingest::RigCalibration rig;
  std::vector<RobotState> robot;
  std::vector<Human> humans;
  /// Ascending by time, then human.
  std::vector<HumanState> human_states;
  std::vector<DetectionTruth> detections;
  std::vector<Object> objects;
  std::vector<Room> rooms;
  std::vector<Door> doors;
  std::vector<Pick> picks;
  FreeGrid free_grid;
  /// The static world with positions_map, labels, instance_ids, faces. An instance id is
  /// class << 8 | instance, as in label images.
  MeshBlock mesh;
  /// For each face of the mesh, whether a depth image showed it.
  std::vector<uint8_t> face_observed;
};

/// Writes world.json, robot.csv, humans.csv, detections.csv, mesh.ply, free_grid.png. Files appear
/// whole or not at all, world.json last.
/// Errors: UNAVAILABLE, RESOURCE_EXHAUSTED/DISK_FULL naming the file.
absl::Status WriteTruth(const Truth& truth, const std::string& folder);

/// Errors: NOT_FOUND for a missing file; INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field.
absl::StatusOr<Truth> ReadTruth(const std::string& folder);

}  // namespace dsg::truth
