// SPDX-License-Identifier: Apache-2.0
// Everything that a sensor log is made from, drawn from the options once: world, scene, people,
// robot, inertial samples, calibration.
// Refuses to write files.
#pragma once

#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/sensor/calibration.h"
#include "ingest/simulator/body/human_motion.h"
#include "ingest/simulator/motion/imu.h"
#include "ingest/simulator/motion/robot_motion.h"
#include "ingest/simulator/scene/renderer.h"
#include "ingest/simulator/sensors/sensors_options.h"
#include "ingest/simulator/world/world.h"

namespace dsg::simulator {

/// A person or a carried object, ready to be drawn. Owns what MovingBody refers to.
struct DrawnBody {
  /// Index of the person; -1 = an object.
  int person = -1;
  /// Index in World::furniture; -1 = a person.
  int object = -1;
  TriangleMesh mesh_map;
  MovingBody body;
};

/// What a person wears, or an object is made of, in the frame that moves with it.
struct BodyLook {
  TriangleMesh rest_mesh;
  std::vector<Color> vertex_colors;
};

/// Threads: safe; immutable.
class SensorSession {
 public:
  /// Same options, same session. Errors: of the options; of the world's generation.
  static absl::StatusOr<std::unique_ptr<SensorSession>> Make(const SensorsOptions& options);

  const SensorsOptions& options() const { return options_; }
  const World& world() const { return *world_; }
  const Scene& scene() const { return scene_; }
  const Renderer& renderer() const { return *renderer_; }
  const CrowdMotion& crowd() const { return *crowd_; }
  const RobotMotion& robot() const { return *robot_; }
  const std::vector<ImuSample>& imu() const { return imu_; }
  /// As the sensors are.
  const ingest::RigCalibration& rig() const { return rig_; }
  /// As the log says they are, and how late the inertial stamps are.
  const ingest::RigCalibration& told_rig() const { return told_rig_; }
  TimeNs imu_delay_ns() const { return imu_delay_ns_; }
  int human_class_id() const { return human_class_id_; }

  int64_t frame_count() const { return options_.FrameCount(); }
  /// First stamp of the log. Logs of other options have other times, so that the truth of one is
  /// not taken for that of another.
  TimeNs begin_ns() const { return options_.BeginNs(); }
  bool IsKeyframe(int64_t frame) const { return frame % options_.keyframe_every == 0; }
  /// From the log's begin.
  TimeNs TimeOf(int64_t frame) const;
  TimeNs StampOf(int64_t frame) const { return begin_ns() + TimeOf(frame); }
  /// Requires: a camera of rig().
  Pose3d MapTCamera(const ingest::CameraCalibration& camera, int64_t frame) const;

  /// People, then objects that somebody carries at some time, where they are at a frame. Those
  /// farther from `viewer_map` than anyone can see are left out.
  std::vector<std::unique_ptr<DrawnBody>> BodiesAt(int64_t frame,
                                                   const Eigen::Vector3d& viewer_map) const;

 private:
  SensorSession() = default;
  void MakeLooks();
  std::unique_ptr<DrawnBody> DrawPerson(int person, TimeNs time_ns) const;
  std::unique_ptr<DrawnBody> DrawObject(size_t movable_index, TimeNs time_ns) const;

  SensorsOptions options_;
  std::unique_ptr<World> world_;
  Scene scene_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<CrowdMotion> crowd_;
  std::unique_ptr<RobotMotion> robot_;
  std::vector<ImuSample> imu_;
  ingest::RigCalibration rig_;
  ingest::RigCalibration told_rig_;
  TimeNs imu_delay_ns_ = 0;
  int human_class_id_ = 0;
  /// Label instance of each piece of furniture.
  std::vector<int> instances_;
  std::vector<BodyLook> people_looks_;
  /// Of CrowdMotion::movable(), in its order.
  std::vector<BodyLook> object_looks_;
};

}  // namespace dsg::simulator
