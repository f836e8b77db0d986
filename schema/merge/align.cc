// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/align.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/status.h"
#include "schema/matching/registration.h"
#include "schema/merge/align_score.h"
#include "schema/merge/vote_transform.h"

namespace dsg::merge {
namespace {

struct Candidate {
  Pose3d into_T_other;
  AlignScore score;
  /// See ChanceOf.
  double chance = 1.0;
  Registration registration;
};

Pose3d UprightPose(double yaw_rad, const Eigen::Vector3d& shift) {
  return {shift, Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()))};
}

Pose3d PoseOf(const Registration& registration) {
  Pose3d pose{registration.translation, Eigen::Quaterniond(registration.rotation)};
  pose.orientation.normalize();
  return pose;
}

Eigen::Vector3d CenterOf(const MapContent& content) {
  Box3d box;
  for (const Node& node : content.nodes) {
    if (!IsAgentKind(node.kind)) box.extend(node.map_T_node.position);
  }
  return box.isEmpty() ? Eigen::Vector3d::Zero().eval() : Eigen::Vector3d(box.center());
}

std::vector<Eigen::Vector3d> PositionsOf(const AlignSide& side) {
  std::vector<Eigen::Vector3d> positions;
  for (const Landmark& landmark : side.landmarks) positions.push_back(landmark.position);
  return positions;
}

// All pairs that could be under a coarse pose; the registration tells which are.
std::vector<Correspondence> PairsNear(const AlignSide& into, const AlignSide& other,
                                      const Pose3d& into_T_other, double gate_m) {
  std::vector<Correspondence> pairs;
  for (const auto& [a, b] : MatchLandmarks(into, other, into_T_other, gate_m)) {
    pairs.emplace_back(b, a);
  }
  return pairs;
}

class Aligner {
 public:
  Aligner(AlignSide into, AlignSide other, const AlignOptions& options)
      : into_(std::move(into)), other_(std::move(other)), options_(options) {}

  absl::StatusOr<std::vector<Candidate>> Candidates(const StopCheck& stop) const {
    DSG_ASSIGN_OR_RETURN(const std::vector<Guess> guesses,
                         VoteOnTransform(into_.landmarks, other_.landmarks, {}, stop));
    std::vector<Candidate> candidates;
    for (const Guess& guess : guesses) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      const auto candidate = Improve(UprightPose(guess.yaw_rad, guess.shift));
      if (candidate.has_value()) candidates.push_back(*candidate);
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const auto& a, const auto& b) { return a.score.score > b.score.score; });
    return candidates;
  }

 private:
  // The gate narrows as the pose gets better.
  std::optional<Candidate> Improve(Pose3d pose) const {
    Candidate candidate;
    for (const double gate_m : {2.0, 1.0, 0.7, 0.7}) {
      const absl::StatusOr<Registration> found = Fit(pose, gate_m);
      if (!found.ok()) return std::nullopt;
      candidate.registration = *found;
      pose = PoseOf(*found);
    }
    candidate.into_T_other = pose;
    candidate.score = ScoreTransform(into_, other_, pose, options_.noise_bound_m);
    candidate.chance = ChanceOf(into_, other_, candidate.score, options_.noise_bound_m);
    return candidate;
  }

  absl::StatusOr<Registration> Fit(const Pose3d& pose, double gate_m) const {
    RegistrationOptions options;
    options.noise_bound_m = options_.noise_bound_m;
    options.is_upright = true;
    options.clique_step_count_max = 300'000;
    return Register(PositionsOf(other_), PositionsOf(into_), PairsNear(into_, other_, pose, gate_m),
                    options);
  }

  AlignSide into_;
  AlignSide other_;
  AlignOptions options_;
};

bool AreApart(const Pose3d& a, const Pose3d& b) {
  return (a.position - b.position).norm() > 1.0 || AngleBetween(a.orientation, b.orientation) > 0.1;
}

absl::Status NoRegistration(const std::string& why) {
  return MakeError(Reason::kNoRegistration,
                   absl::StrCat("no transform between the maps can be told: ", why,
                                "; give one with --transform X,Y,Z,YAW"));
}

std::string Describe(const Pose3d& pose) {
  const Eigen::Vector3d x = pose.orientation * Eigen::Vector3d::UnitX();
  return absl::StrFormat("(%.1f m, %.1f m, %.0f degrees)", pose.position.x(), pose.position.y(),
                         std::atan2(x.y(), x.x()) * 57.29577951308232);
}

// Undoes the centring of both sides.
Pose3d WithCenters(const Pose3d& pose, const Eigen::Vector3d& into_center,
                   const Eigen::Vector3d& other_center) {
  return {into_center + pose.position - pose.orientation * other_center, pose.orientation};
}

absl::Status JudgeAlone(const Candidate& best, const AlignOptions& options) {
  const int agreeing = static_cast<int>(best.score.matches.size());
  if (agreeing < options.agreeing_count_min) {
    return NoRegistration(absl::StrCat(agreeing, " things agree at best, and ",
                                       options.agreeing_count_min, " are needed"));
  }
  if (best.chance > options.chance_max) {
    return NoRegistration(
        absl::StrCat(agreeing, " things agree at best, as many as would by chance"));
  }
  if (best.score.agreeing_share < options.agreeing_share_min) {
    return NoRegistration(absl::StrCat(agreeing, " things agree at best, and ",
                                       best.score.missing_count,
                                       " are missing where both maps looked"));
  }
  if (best.score.blocked_share > options.blocked_share_max) {
    return NoRegistration(absl::StrCat(agreeing, " things agree at best, but then ",
                                       best.score.blocked_count, " of ", best.score.walled_count,
                                       " places would stand in walls of the other map"));
  }
  return absl::OkStatus();
}

// Nothing speaks against it.
bool IsClean(const AlignScore& score, const AlignOptions& options) {
  return score.agreeing_share >= options.clean_agreeing_share_min &&
         score.walled_count >= options.clean_walled_count_min &&
         score.blocked_share <= options.clean_blocked_share_max;
}

absl::Status JudgeAgainst(const Candidate& rival, const Candidate& best,
                          const AlignOptions& options) {
  const int agreeing = static_cast<int>(best.score.matches.size());
  const int rival_agreeing = static_cast<int>(rival.score.matches.size());
  const bool is_alike = rival.score.score > options.rival_share_max * best.score.score;
  const double count_share_max = IsClean(best.score, options) ? options.clean_rival_count_share_max
                                                              : options.rival_count_share_max;
  if (!is_alike && rival_agreeing <= count_share_max * agreeing) {
    return absl::OkStatus();
  }
  return NoRegistration(absl::StrFormat(
      "%s, %d and %d things agree and they lie %s and %s from the middle of one map to that of "
      "the other",
      is_alike ? "two answers are as good as each other"
               : "the best answer is hardly better than any other",
      agreeing, rival_agreeing, Describe(best.into_T_other), Describe(rival.into_T_other)));
}

absl::Status Judge(const std::vector<Candidate>& candidates, const AlignOptions& options,
                   Alignment* alignment) {
  if (candidates.empty()) return NoRegistration("the maps share no kinds of things with a class");
  const Candidate& best = candidates.front();
  DSG_RETURN_IF_ERROR(JudgeAlone(best, options));
  alignment->agreeing_count = static_cast<int>(best.score.matches.size());
  alignment->shared_count = best.score.shared_count;
  for (const Candidate& rival : candidates) {
    if (!AreApart(best.into_T_other, rival.into_T_other)) continue;
    DSG_RETURN_IF_ERROR(JudgeAgainst(rival, best, options));
    const double share = rival.score.score / std::max(best.score.score, 1e-9);
    alignment->rival_share = std::max(alignment->rival_share, share);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Alignment> EstimateTransform(const MapContent& into, const MapContent& other,
                                            const AlignOptions& options, const StopCheck& stop) {
  const size_t few = static_cast<size_t>(options.few_things);
  const bool with_regions =
      LandmarksOf(into, false).size() < few || LandmarksOf(other, false).size() < few;
  const Eigen::Vector3d into_center = CenterOf(into);
  const Eigen::Vector3d other_center = CenterOf(other);
  const Aligner aligner(MakeSide(into, with_regions, into_center),
                        MakeSide(other, with_regions, other_center), options);
  DSG_ASSIGN_OR_RETURN(const std::vector<Candidate> candidates, aligner.Candidates(stop));
  Alignment alignment;
  DSG_RETURN_IF_ERROR(Judge(candidates, options, &alignment));
  const Candidate& best = candidates.front();
  alignment.map_T_other = WithCenters(best.into_T_other, into_center, other_center);
  alignment.residual_m = best.registration.residual_m;
  alignment.covariance = best.registration.covariance;
  return alignment;
}

Evidence EvidenceFor(const MapContent& into, const MapContent& other, const Pose3d& map_T_other,
                     const AlignOptions& options) {
  const Eigen::Vector3d center = CenterOf(into);
  const Eigen::Vector3d other_center = CenterOf(other);
  const Pose3d centered{map_T_other * other_center - center, map_T_other.orientation};
  const AlignScore score =
      ScoreTransform(MakeSide(into, false, center), MakeSide(other, false, other_center), centered,
                     options.noise_bound_m);
  return {static_cast<int>(score.matches.size()), score.missing_count, score.blocked_share};
}

}  // namespace dsg::merge
