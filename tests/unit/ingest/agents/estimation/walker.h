// SPDX-License-Identifier: Apache-2.0
// People who walk by a rule, and a camera that sees them with known errors, for tests.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ingest/agents/estimation/torso_graph.h"
#include "ingest/agents/person_observation.h"
#include "schema/base/random.h"

namespace dsg::ingest {

struct WalkerOptions {
  int count = 150;
  TimeNs step_ns = 200'000'000;
  double radius_m = 3.0;
  double speed_m_s = 1.2;
  double ray_sigma_m = 0.5;
  double across_sigma_m = 0.1;
  double heading_sigma_rad = 0.3;
  /// Of being off by outlier_m along a random direction.
  double outlier_probability = 0.0;
  double outlier_m = 3.0;
  /// Puts a perfect floor cue of this sigma along the ray; 0 = none.
  double cue_sigma_m = 0.0;
};

struct Walk {
  std::vector<PersonObservation> observations;
  std::vector<Pose3d> map_T_torso;
};

inline constexpr TimeNs kWalkBeginNs = 1'700'000'000'000'000'000;

/// Five a second.
TimeNs TimeOf(int i);

/// The paper's literal model.
TorsoOptions Paper();

double Heading(const Pose3d& pose);

Pose3d TorsoAt(const Eigen::Vector3d& position, double heading);

/// Seen from `camera`: white errors, long along the ray.
PersonObservation Seen(const Pose3d& map_T_torso, const Eigen::Vector3d& camera_map, TimeNs time_ns,
                       const WalkerOptions& options, Random* random);

/// A detection at (x, 0), looking along 0.5 rad, sure to 0.2 m in all directions.
PersonObservation StandingAt(double x, TimeNs time_ns);

/// In a circle about (4, 0), seen from (0, -4).
Walk WalkCircle(const WalkerOptions& options, uint64_t seed);

/// Adds all, solving as the tracker does.
TorsoGraph Track(const TorsoOptions& options, const std::vector<PersonObservation>& observations);

double MeanError(const std::vector<TorsoEstimate>& estimates, const std::vector<Pose3d>& truth);
double MeanRawError(const Walk& walk);

/// The 3x3 block of the position.
Eigen::Matrix3d PositionCovariance(const TorsoEstimate& estimate);

}  // namespace dsg::ingest
