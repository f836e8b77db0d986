// SPDX-License-Identifier: Apache-2.0
// What the loops that are believed say of those that are not (yet).
// Refuses to move poses.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ingest/loop/pose_graph.h"
#include "ingest/loop/relative_covariance.h"
#include "ingest/loop/robust_options.h"
#include "ingest/loop/twist.h"

namespace dsg::ingest {

/// The squared noise of the edges of a set, as a share of what their information admits: never
/// above 1, with a margin, and 1 where loops are too few to tell. Public graphs are off by factors
/// up to a thousand.
double NoiseScaleOf(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
                    const std::vector<bool>& is_believed, const EvidenceOptions& evidence);

class Belief {
 public:
  /// `map_T_pose`: the solution of the edges of `is_believed`, all odometry among them. `gate`: the
  /// largest squared deviation of a right loop. `on_work` (may be empty) hears of the doubtful
  /// loops while they are judged, here. All others must outlive this. Requires: edges within the
  /// poses.
  Belief(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
         const std::vector<bool>& is_believed, double gate, const EvidenceOptions& evidence,
         const TellWork& on_work = {});

  /// What is believed, and loops that fit into it where few wrong ones would: less than
  /// `wrong_count_max` wrong ones are to be expected. Loops of `is_supported` need only fit.
  std::vector<bool> WithConvincing(const std::vector<bool>& is_supported,
                                   double wrong_count_max) const;
  /// What is believed, and every loop that may be right.
  std::vector<bool> WithPossible() const;
  enum class Verdict {
    kConfirmed,
    /// Wrong loops would fit as well.
    kUnsure,
    /// Wrong ones would not, but nor does this one, to first order.
    kContradicted,
  };
  /// What the other edges say of one that is believed. Sure where wrong ones are no more than
  /// `wrong_share_max` of the like.
  Verdict VerdictOf(int edge, double wrong_share_max);

 private:
  struct Judgement {
    bool is_possible = true;
    /// That a wrong loop in its place would be possible, too.
    double accident_chance = 0.0;
  };
  Judgement JudgementOf(const Vector6d& twist_map, const Matrix6d& covariance) const;
  Vector6d TwistOf(const RelativePose& edge) const;
  Matrix6d NoiseOf(const RelativePose& edge) const;
  double WrongCountAt(double accident_chance) const;
  void JudgeDoubtful(const TellWork& on_work);

  const PoseGraph& graph_;
  const std::vector<Pose3d>& map_T_pose_;
  const std::vector<bool>& is_believed_;
  double gate_;
  const EvidenceOptions& evidence_;
  double noise_scale_;
  RelativeCovariances covariances_;
  Eigen::Vector3d extent_m_ = Eigen::Vector3d::Ones();
  /// By edge; of edges that are believed, the default.
  std::vector<Judgement> judgements_;
  /// Of judgements that are not possible, by edge.
  std::vector<double> impossible_chances_;
  int64_t believed_count_ = 0;
};

}  // namespace dsg::ingest
