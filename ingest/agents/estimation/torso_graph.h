// SPDX-License-Identifier: Apache-2.0
// The pose graph of one person: where the torso was at each detection, all of them together.
// Refuses to decide which detections are of the person.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "ingest/agents/estimation/torso_options.h"
#include "ingest/agents/person_observation.h"
#include "schema/model/geometry.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// Where the torso was at a detection's stamp, as believed now.
struct TorsoEstimate {
  TimeNs time_ns = 0;
  Pose3d map_T_torso;
  /// Translation in the map before rotation (right perturbation).
  Covariance6 covariance{};
};

/// Where the torso will be.
struct TorsoPrediction {
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_map = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_map = Eigen::Matrix3d::Identity();
};

/// Threads: one caller at a time. Deterministic.
class TorsoGraph {
 public:
  explicit TorsoGraph(const TorsoOptions& options);
  TorsoGraph(TorsoGraph&&) noexcept;
  TorsoGraph& operator=(TorsoGraph&&) noexcept;
  ~TorsoGraph();

  /// False, and nothing changes, unless the observation is later than the last, all its numbers are
  /// finite and of a person's size, and its covariance is positive definite.
  bool Add(const PersonObservation& observation);

  /// Moves the last lag_count nodes; cheap (some tenths of a millisecond).
  /// Returns the index of the first estimate that may have moved.
  size_t SolveRecent();
  /// Moves all of them, and computes every covariance; at the end of a track.
  void SolveAll();

  /// Keeps the estimates and frees the rest, 4 kB an observation: nothing more will be added,
  /// solved or asked for but estimates().
  void Freeze();

  /// One per observation, ascending in time.
  const std::vector<TorsoEstimate>& estimates() const;
  /// Puts others in their place, of a frozen graph whose estimates are elsewhere for a while.
  /// Returns those before.
  std::vector<TorsoEstimate> ExchangeEstimates(std::vector<TorsoEstimate> estimates);
  /// Requires: at least one observation. `time_ns` not before the last.
  TorsoPrediction Predict(TimeNs time_ns) const;
  /// The factors behind the estimates from index `first` on, for the store: "detection_prior" (the
  /// observation's map_T_torso as it came), and "zero_velocity" or "motion" between neighbours.
  std::vector<PoseFactor> Factors(size_t first) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
