// SPDX-License-Identifier: Apache-2.0
// What moves: timed poses, the factors between them, body shapes, stays.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/ids.h"
#include "schema/model/node.h"

namespace dsg {

/// Upper triangle of a 6x6 covariance, row by row: translation (metres, axes of the map) before
/// rotation (a small turn on the right of the orientation: radians, axes of the agent).
using Covariance6 = std::array<float, 21>;

namespace pose_flags {
/// The source gave positions only; the orientation is the identity and says nothing.
inline constexpr uint32_t kNoOrientation = 1;
/// Moved by a later estimate, such as a loop closure.
inline constexpr uint32_t kCorrected = 2;
inline constexpr uint32_t kPredicted = 4;
inline constexpr uint32_t kAll = 7;
}  // namespace pose_flags

/// Where an agent was at one instant.
struct TimedPose {
  TimeNs time_ns = 0;
  uint32_t flags = 0;
  Pose3d map_T_agent;
  /// Shared, because logs often repeat one covariance; null = not given.
  std::shared_ptr<const Covariance6> covariance;
};

/// Constraint of a pose graph between two poses, or on one (from == to).
/// Source: RSS 2020, section IV-A ("Human Nodes": odometry-free pose graph with detection priors
/// and zero-velocity links; "Robot Node").
struct PoseFactor {
  /// "odometry", "zero_velocity", "motion", "detection_prior", "loop_closure",
  /// "loop_closure_rejected" (seen, and not believed).
  std::string type;
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  /// The other agent of an inter-robot factor; empty = the same agent.
  NodeId to_agent;
  Pose3d relative_pose;
  /// Inverse covariance. Of a prior in the axes of Covariance6.
  std::optional<Covariance6> information;
};

/// Body shape at one instant. Every part may be empty.
///
/// Frames: vertices and joints are in the agent's frame.
struct BodyShape {
  TimeNs time_ns = 0;
  /// Radians: the axis times the angle of each joint against its parent; 72 numbers for SMPL.
  std::vector<float> pose_coefficients;
  /// 10 numbers for SMPL.
  std::vector<float> shape_coefficients;
  /// x, y, z of each vertex, metres; the faces stand in the topology of the ShapeAppend.
  std::vector<float> vertices;
  /// x, y, z of each joint, metres; 24 joints for SMPL.
  std::vector<float> joints;
};

/// An agent was in a place and a room during [enter_ns, exit_ns). Key: (agent, enter_ns).
struct Stay {
  NodeId agent;
  /// May be empty.
  NodeId place;
  /// May be empty.
  NodeId room;
  TimeNs enter_ns = 0;
  /// kTimeMax while the agent has not been seen to leave; readers clip it to the track's end.
  TimeNs exit_ns = kTimeMax;
  bool operator==(const Stay&) const = default;
};

/// "Who was here at t" looks back so far, and finds longer stays one by one: writers that know
/// better cut theirs at this length, as ours do.
inline constexpr TimeNs kStayNsMax = 3600 * kNsPerSecond;

}  // namespace dsg
