// SPDX-License-Identifier: Apache-2.0
// What a detection, its cues and a person's walk say of the states of a torso graph.
// Refuses to solve anything.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "ingest/agents/estimation/state_chain.h"
#include "ingest/agents/estimation/torso_graph.h"
#include "ingest/agents/person_observation.h"

namespace dsg::ingest {

/// kSmooth: position, velocity, and the lasting error along the ray in its standard deviations.
inline constexpr int kSmoothStateCount = 7;

/// Numbers are finite, the covariance positive definite, the heading's sigma positive.
bool IsUsable(const PersonObservation& observation);

/// Of the x axis about the map's z axis.
double HeadingOf(const Eigen::Quaterniond& map_Q_torso);

ChainLink<3> StandingLink(const TorsoOptions& options, double step_s);
ChainLink<kSmoothStateCount> WalkingLink(const TorsoOptions& options, double step_s);
/// Of the heading (kSmooth).
ChainLink<1> TurningLink(const TorsoOptions& options, double step_s);

/// Before the first detection.
Eigen::Matrix3d StandingStart();
Eigen::Matrix<double, kSmoothStateCount, kSmoothStateCount> WalkingStart(
    const TorsoOptions& options);

std::vector<ChainTerm<3>> StandingTerms(const TorsoOptions& options,
                                        const PersonObservation& observation);
/// A detection split across its ray and along it, each with a loss of its own: a person half behind
/// a table is still in the right direction.
class RayDetection {
 public:
  RayDetection(const TorsoOptions& options, const PersonObservation& observation);

  /// Across the ray, then along it; the ray is the one to `believed_map`. Were it the one to the
  /// detection, then the nearer a person came to the camera, the less a detection would be missed,
  /// and everybody would be drawn towards the camera.
  std::array<ChainTerm<kSmoothStateCount>, 2> TermsAt(const Eigen::Vector3d& believed_map) const;

 private:
  Eigen::Vector3d camera_map_;
  Eigen::Vector3d position_map_;
  /// Columns: two directions across, and the ray to the detection.
  Eigen::Matrix3d map_Q_ray_;
  Eigen::Matrix3d whitening_ray_;
  double lasting_sigma_m_ = 0.0;
  double loss_scale_ = 0.0;
};

/// `step_s` since the last observation; infinity for the first.
std::vector<ChainTerm<kSmoothStateCount>> CueTerms(const TorsoOptions& options,
                                                   const PersonObservation& observation,
                                                   double step_s);
std::vector<ChainTerm<1>> HeadingTerms(const TorsoOptions& options,
                                       const PersonObservation& observation);

}  // namespace dsg::ingest
