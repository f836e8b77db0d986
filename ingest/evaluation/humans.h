// SPDX-License-Identifier: Apache-2.0
// How far tracked people are from where they were, and whether tracks keep to one person.
// Refuses to match by nearness of tracks: a pose belongs to the person whose detection made it.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::evaluation {

/// A row of the truth's table of detections.
struct TrueDetection {
  TimeNs time_ns = 0;
  /// -1 = of nobody.
  int human = -1;
  double visibility = 0.0;
  Eigen::Vector3d torso_map = Eigen::Vector3d::Zero();
  /// What the detector said, put into the map by the true robot pose.
  Eigen::Vector3d detected_torso_map = Eigen::Vector3d::Zero();
  int64_t id = 0;
};

/// A detection that the estimate took in: a prior on a track's pose at its stamp.
struct EstimatedPrior {
  TimeNs time_ns = 0;
  int track = 0;
  Eigen::Vector3d torso_map = Eigen::Vector3d::Zero();
  /// The same put into the map by the true robot pose, to find the detection by: a drift of the
  /// robot must not decide whose detection it was.
  Eigen::Vector3d torso_true_map = Eigen::Vector3d::Zero();
};

/// A tracked pose that is not a prediction.
struct EstimatedTorso {
  TimeNs time_ns = 0;
  int track = 0;
  Eigen::Vector3d torso_map = Eigen::Vector3d::Zero();
};

struct HumanOptions {
  /// Between prior and detection at the same stamp. A detection is stored as it is, so this only
  /// has to absorb another way to compute its position, such as a floor contact.
  double prior_gate_m = 1.0;
  /// Below this, nobody is asked to see the person.
  double visibility_min = 0.1;
};

/// Units: metres.
struct HumanResult {
  /// Means over humans of the mean |torso - true torso|: all detections of the log, the ones the
  /// estimate took in, the tracked poses at their stamps.
  std::optional<double> raw_m;
  std::optional<double> filtered_m;
  std::optional<double> tracked_m;
  std::optional<double> idf1;
  std::optional<double> mota;
  int64_t id_switch_count = 0;
  std::optional<double> tracks_per_human;
  int64_t scored_pose_count = 0;
  /// Poses that no true detection explains. They count as false in IDF1 and MOTA.
  int64_t unexplained_pose_count = 0;
  int64_t detection_count = 0;
  /// Detections behind filtered_m.
  int64_t filtered_count = 0;
  /// Of ScoreBodies: mean over bodies of the mean distance of joints and of vertices, each turned
  /// as in the map but against the pelvis, and where they are in the map. Unset without any.
  std::optional<double> joint_root_m;
  std::optional<double> joint_m;
  std::optional<double> vertex_root_m;
  std::optional<double> vertex_m;
  int64_t joint_body_count = 0;
  int64_t vertex_body_count = 0;
  /// The true detection's id behind a track's pose, by stamp and track; without those of nobody.
  std::map<std::pair<TimeNs, int>, int64_t> detection_of;
  /// The human that most poses of a track are of.
  std::map<int, int> human_of_track;
};

/// IDF1 = 2 IDTP / (truth + estimate) over (human, stamp) and (track, stamp), whole tracks
/// assigned to whole humans so that IDTP is largest. MOTA = 1 - (misses + false + switches) /
/// truth. A pose of a person below visibility_min counts neither way.
/// Source: Ristani et al. 2016 (IDF1); Bernardin and Stiefelhagen 2008 (MOTA).
HumanResult EvaluateHumans(const std::vector<TrueDetection>& detections,
                           const std::vector<EstimatedPrior>& priors,
                           const std::vector<EstimatedTorso>& poses, const HumanOptions& options);

}  // namespace dsg::evaluation
