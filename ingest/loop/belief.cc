// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/belief.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <optional>

#include "ingest/loop/believed_paths.h"
#include "ingest/loop/optimize.h"
#include "ingest/loop/pairwise.h"
#include "ingest/loop/twist.h"

namespace dsg::ingest {

double NoiseScaleOf(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
                    const std::vector<bool>& is_believed, const EvidenceOptions& evidence) {
  double squared = 0.0;
  int freedom = 0;
  for (size_t e = 0; e < graph.edges.size(); ++e) {
    const RelativePose& edge = graph.edges[e];
    if (!is_believed[e]) continue;
    squared += SquaredResidual(edge, graph.is_planar, map_T_pose[Index(edge.from)],
                               map_T_pose[Index(edge.to)]);
    if (edge.is_loop) freedom += graph.is_planar ? 3 : 6;
  }
  if (freedom < evidence.noise_freedom_min) return 1.0;
  // A graph without noise must not make every loop of it impossible: numerical, no option.
  return std::clamp(evidence.noise_margin * squared / freedom, 1e-9, 1.0);
}

Belief::Belief(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
               const std::vector<bool>& is_believed, double gate, const EvidenceOptions& evidence,
               const TellWork& on_work)
    : graph_(graph),
      map_T_pose_(map_T_pose),
      is_believed_(is_believed),
      gate_(gate),
      evidence_(evidence),
      noise_scale_(NoiseScaleOf(graph, map_T_pose, is_believed, evidence)),
      covariances_(graph, map_T_pose, is_believed),
      judgements_(graph.edges.size()) {
  Eigen::AlignedBox3d box;
  for (const Pose3d& pose : map_T_pose) box.extend(pose.position);
  if (!box.isEmpty()) extent_m_ = box.sizes();
  JudgeDoubtful(on_work);
  for (size_t e = 0; e < graph.edges.size(); ++e) {
    if (!judgements_[e].is_possible) impossible_chances_.push_back(judgements_[e].accident_chance);
    if (graph.edges[e].is_loop && is_believed[e]) ++believed_count_;
  }
}

void Belief::JudgeDoubtful(const TellWork& on_work) {
  const BelievedPaths paths(graph_, map_T_pose_, is_believed_);
  const auto doubtful_count = std::count(is_believed_.begin(), is_believed_.end(), false);
  int64_t done = 0;
  std::map<int, std::vector<int>> doubtful_by_pose;
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    if (!is_believed_[e]) doubtful_by_pose[graph_.edges[e].from].push_back(static_cast<int>(e));
  }
  for (const auto& [from, edges] : doubtful_by_pose) {
    if (on_work) on_work("judging doubtful loop closures", done, doubtful_count);
    done += std::ssize(edges);
    std::vector<int> targets;
    for (const int e : edges) targets.push_back(graph_.edges[Index(e)].to);
    const std::vector<std::optional<Matrix6d>> bounds = paths.CovariancesFrom(from, targets);
    for (size_t k = 0; k < edges.size(); ++k) {
      const RelativePose& edge = graph_.edges[Index(edges[k])];
      Judgement& judgement = judgements_[Index(edges[k])];
      // Nothing is known about parts that hang apart.
      judgement = {true, 1.0};
      if (!bounds[k]) continue;
      judgement = JudgementOf(TwistOf(edge), *bounds[k] + NoiseOf(edge));
      if (!judgement.is_possible) continue;
      // Most wrong loops do not pass the bound; the rest are worth an exact look.
      const std::optional<Matrix6d> covariance = covariances_.Between(edge.from, edge.to);
      if (covariance) judgement = JudgementOf(TwistOf(edge), *covariance + NoiseOf(edge));
    }
  }
}

// What the loop says of its poses, and what they are: a twist of the map's frame.
Vector6d Belief::TwistOf(const RelativePose& edge) const {
  return LogOf(map_T_pose_[Index(edge.from)] * edge.from_T_to *
               map_T_pose_[Index(edge.to)].Inverse());
}

Matrix6d Belief::NoiseOf(const RelativePose& edge) const {
  return MovedCovariance(AdjointOf(map_T_pose_[Index(edge.from)] * edge.from_T_to),
                         CovarianceOf(edge, graph_.is_planar));
}

Belief::Judgement Belief::JudgementOf(const Vector6d& twist_map, const Matrix6d& covariance) const {
  const Deviation deviation = DeviationOf(twist_map, noise_scale_ * covariance, graph_.is_planar);
  return {deviation.squared <= gate_,
          AccidentChance(extent_m_, graph_.is_planar, gate_, deviation.volume, evidence_)};
}

// Loops that are known to be wrong stand for those that may be in the place of a right one: how
// many would have passed a test as severe as the one of chance `accident_chance`.
double Belief::WrongCountAt(double accident_chance) const {
  double count = 0.0;
  for (const double chance : impossible_chances_) {
    if (chance > evidence_.alike_factor * accident_chance) continue;
    count += std::min(chance, accident_chance);
  }
  return count;
}

std::vector<bool> Belief::WithConvincing(const std::vector<bool>& is_supported,
                                         double wrong_count_max) const {
  std::vector<bool> is_convincing = is_believed_;
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    if (is_believed_[e] || !judgements_[e].is_possible) continue;
    is_convincing[e] =
        is_supported[e] || WrongCountAt(judgements_[e].accident_chance) <= wrong_count_max;
  }
  return is_convincing;
}

std::vector<bool> Belief::WithPossible() const {
  std::vector<bool> is_possible;
  for (const Judgement& judgement : judgements_) is_possible.push_back(judgement.is_possible);
  return is_possible;
}

Belief::Verdict Belief::VerdictOf(int edge, double wrong_share_max) {
  const RelativePose& measured = graph_.edges[Index(edge)];
  // The loop has drawn the poses towards itself. To first order its residual was larger without it
  // by the share that the others left it.
  const Matrix6d noise = CovarianceOf(measured, graph_.is_planar);
  const Matrix6d to_of_map = AdjointOf(map_T_pose_[Index(measured.to)].Inverse());
  Judgement judgement{true, 1.0};
  const std::optional<Matrix6d> with = covariances_.Between(measured.from, measured.to);
  if (with) {
    const std::optional<Matrix6d> without =
        WithoutEdge(MovedCovariance(to_of_map, *with), noise, graph_.is_planar);
    if (!without) return Verdict::kUnsure;
    const Matrix6d total = *without + noise;
    const Vector6d drawn = to_of_map * TwistOf(measured);
    judgement = JudgementOf(total * InverseOf(noise, graph_.is_planar) * drawn, total);
  }
  const double wrong_share = static_cast<double>(impossible_chances_.size()) /
                             std::max(1.0, static_cast<double>(believed_count_));
  if (judgement.accident_chance * wrong_share > wrong_share_max) return Verdict::kUnsure;
  return judgement.is_possible ? Verdict::kConfirmed : Verdict::kContradicted;
}

}  // namespace dsg::ingest
