// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/align.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/status.h"
#include "schema/matching/registration.h"
#include "schema/merge/landmarks.h"
#include "schema/merge/point_grid.h"

namespace dsg::merge {
namespace {

// A map has observed what is this close to one of its places beyond its clearance, or to a
// landmark.
constexpr double kSeenBeyondM = 0.5;
constexpr double kSeenAroundM = 1.5;
// Walls are thick, and clearances are measured on a grid.
constexpr double kWallSlackM = 0.35;
constexpr double kClearanceMaxM = 4.0;

/// One map, prepared for comparison under many transforms.
struct AlignSide {
  std::vector<Landmark> landmarks;
  /// x, y, z and clearance of places; 0 without a clearance.
  std::vector<Eigen::Vector4d> places;
  /// Walls, with their boxes in their frames.
  std::vector<std::pair<Pose3d, Box3d>> walls;
  /// Share of its own places near walls that stand in one: mapped walls cross doors.
  double own_blocked_share = 0.0;
};

struct AlignScore {
  /// Indices of landmarks of `into` and of `other`.
  std::vector<std::pair<int, int>> matches;
  /// Landmarks of both that have no match although the other map has observed their place.
  int missing_count = 0;
  /// Those, and the matched ones.
  int shared_count = 0;
  /// Places near a wall of the other map, and those of them that stand in one.
  int walled_count = 0;
  int blocked_count = 0;
  /// Share of blocked places beyond what a map's own walls block; 0 to 1.
  double blocked_share = 0.0;
  /// Share of matched landmarks among those that both maps could have seen; 0 to 1.
  double agreeing_share = 0.0;
  double score = 0.0;
};

std::vector<Eigen::Vector3d> PositionsOf(const std::vector<Landmark>& landmarks) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(landmarks.size());
  for (const Landmark& landmark : landmarks) positions.push_back(landmark.position);
  return positions;
}

std::vector<Eigen::Vector3d> PositionsOf(const std::vector<Eigen::Vector4d>& places) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(places.size());
  for (const Eigen::Vector4d& place : places) positions.push_back(place.head<3>());
  return positions;
}

// For each point the nearest landmark of `side` of its kind within the gate; -1 if there is none.
std::vector<int> NearestOf(const std::vector<Landmark>& points, const AlignSide& side,
                           const Pose3d& side_T_points, double gate_m) {
  const PointGrid grid(PositionsOf(side.landmarks), std::max(gate_m, 0.25));
  std::vector<int> nearest(points.size(), -1);
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d at = side_T_points * points[i].position;
    double best = gate_m;
    grid.ForEachNear(at, gate_m, [&](int candidate) {
      const Landmark& landmark = side.landmarks[static_cast<size_t>(candidate)];
      const double distance = (landmark.position - at).norm();
      const bool is_better = distance < best || (distance == best && candidate < nearest[i]);
      if (!is_better || landmark.kind != points[i].kind || !AreAlike(landmark, points[i])) return;
      best = distance;
      nearest[i] = candidate;
    });
  }
  return nearest;
}

// Number of `points` without a match although `side` has observed their place.
int CountMissing(const std::vector<Landmark>& points, const std::vector<char>& is_matched,
                 const AlignSide& side, const Pose3d& side_T_points) {
  const PointGrid places(PositionsOf(side.places), 1.0);
  const PointGrid things(PositionsOf(side.landmarks), 1.0);
  int count = 0;
  for (size_t k = 0; k < points.size(); ++k) {
    if (is_matched[k] != 0) continue;
    const Eigen::Vector3d at = side_T_points * points[k].position;
    bool is_seen = false;
    places.ForEachNear(at, kClearanceMaxM + kSeenBeyondM, [&](int i) {
      const Eigen::Vector4d& place = side.places[static_cast<size_t>(i)];
      const double reach = std::min(place.w(), kClearanceMaxM) + kSeenBeyondM;
      const Eigen::Vector3d offset = at - place.head<3>();
      is_seen |= offset.head<2>().norm() < reach && std::abs(offset.z()) < 3.0;
    });
    if (!is_seen && side.places.empty()) {
      things.ForEachNear(at, kSeenAroundM, [&](int i) {
        is_seen |= (side.landmarks[static_cast<size_t>(i)].position - at).norm() < kSeenAroundM;
      });
    }
    count += is_seen ? 1 : 0;
  }
  return count;
}

struct Blocked {
  int walled_count = 0;
  int blocked_count = 0;
};

// Counts places of `free` near walls of `side`, and those of them that stand in one.
Blocked CountBlocked(const AlignSide& free, const AlignSide& side, const Pose3d& side_T_free) {
  std::vector<Eigen::Vector3d> places;
  places.reserve(free.places.size());
  for (const Eigen::Vector4d& place : free.places) places.push_back(side_T_free * place.head<3>());
  const PointGrid grid(places, 1.0);
  std::vector<char> is_near(places.size(), 0);
  std::vector<char> is_blocked(places.size(), 0);
  for (const auto& [pose, box] : side.walls) {
    const Pose3d wall_T_side = pose.Inverse();
    const double reach = 0.5 * box.diagonal().norm() + 1.0;
    grid.ForEachNear(pose * box.center(), reach, [&](int i) {
      const size_t place = static_cast<size_t>(i);
      // Compares heights of a body only: places are on the floor or in the air.
      Eigen::Vector3d at = wall_T_side * places[place];
      at.z() = std::clamp(at.z(), box.min().z() - 0.5, box.max().z());
      const double distance = DistanceToBox(at, box);
      if (distance > 1.0) return;
      is_near[place] = 1;
      const double clearance = std::min(free.places[place].w(), 1.0);
      if (distance < clearance - kWallSlackM) is_blocked[place] = 1;
    });
  }
  return {static_cast<int>(std::count(is_near.begin(), is_near.end(), 1)),
          static_cast<int>(std::count(is_blocked.begin(), is_blocked.end(), 1))};
}

double ShareOf(double part, double whole) { return part / std::max(1.0, whole); }

// Subtracts `center` from all positions, to keep precision far from the origin.
AlignSide MakeSide(const MapContent& content, bool with_regions, const Eigen::Vector3d& center) {
  AlignSide side;
  side.landmarks = LandmarksOf(content, with_regions);
  for (Landmark& landmark : side.landmarks) landmark.position -= center;
  for (const Node& node : content.nodes) {
    if (node.kind == kinds::kPlace) {
      Eigen::Vector4d place;
      place << node.map_T_node.position - center, ClearanceOf(node);
      side.places.push_back(place);
    } else if (node.structure.has_value() && !node.box_node.isEmpty() &&
               node.structure->structure_type == "wall") {
      Pose3d pose = node.map_T_node;
      pose.position -= center;
      side.walls.emplace_back(pose, node.box_node);
    }
  }
  const Blocked own = CountBlocked(side, side, Pose3d());
  side.own_blocked_share = ShareOf(own.blocked_count, own.walled_count);
  return side;
}

// Mutually nearest pairs; each landmark is in at most one.
std::vector<std::pair<int, int>> MatchLandmarks(const AlignSide& into, const AlignSide& other,
                                                const Pose3d& into_T_other, double gate_m) {
  const std::vector<int> forward = NearestOf(other.landmarks, into, into_T_other, gate_m);
  const std::vector<int> backward =
      NearestOf(into.landmarks, other, into_T_other.Inverse(), gate_m);
  std::vector<std::pair<int, int>> matches;
  for (size_t i = 0; i < forward.size(); ++i) {
    const int partner = forward[i];
    if (partner < 0 || backward[static_cast<size_t>(partner)] != static_cast<int>(i)) continue;
    matches.emplace_back(partner, static_cast<int>(i));
  }
  return matches;
}

// Expected number of transforms between two random maps of these sizes under which as many
// landmarks agree. Two pairs determine a transform; the others agree by chance (Poisson).
double ChanceOf(const AlignSide& into, const AlignSide& other, const AlignScore& score,
                double gate_m) {
  Box3d box;
  for (const Landmark& landmark : into.landmarks) box.extend(landmark.position);
  if (box.isEmpty()) return 1.0;
  const double area = std::max(1.0, (box.sizes().x() + 1.0) * (box.sizes().y() + 1.0));
  double pair_count = 0.0;
  for (const KindPair& kind : PairKinds(into.landmarks, other.landmarks)) {
    pair_count += static_cast<double>(kind.into.size() * kind.other.size());
  }
  const double landmark_count = static_cast<double>(into.landmarks.size() + other.landmarks.size());
  const double shared = std::min(1.0, score.shared_count / std::max(1.0, landmark_count));
  const double expected = pair_count * shared * std::numbers::pi * gate_m * gate_m / area;
  // The distances of the two pairs must agree; the share of such pairs depends on the size of the
  // map.
  const double alike = std::min(1.0, 4.0 * gate_m / std::sqrt(area));
  const double guess_count = std::max(1.0, pair_count * pair_count * alike);
  const int free = std::max(0, static_cast<int>(score.matches.size()) - 2);
  // The Poisson tail is at most its first term times a geometric series.
  const double first =
      free * std::log(std::max(expected, 1e-12)) - expected - std::lgamma(free + 1.0);
  const double ratio = expected / (free + 1.0);
  if (ratio >= 0.9) return guess_count;
  return std::exp(std::log(guess_count) + first - std::log1p(-ratio));
}

AlignScore ScoreTransform(const AlignSide& into, const AlignSide& other, const Pose3d& into_T_other,
                          double gate_m) {
  AlignScore score;
  const Pose3d other_T_into = into_T_other.Inverse();
  score.matches = MatchLandmarks(into, other, into_T_other, gate_m);
  std::vector<char> mine(into.landmarks.size(), 0);
  std::vector<char> theirs(other.landmarks.size(), 0);
  for (const auto& [a, b] : score.matches) {
    mine[static_cast<size_t>(a)] = theirs[static_cast<size_t>(b)] = 1;
  }
  const int match_count = static_cast<int>(score.matches.size());
  score.missing_count = CountMissing(other.landmarks, theirs, into, into_T_other) +
                        CountMissing(into.landmarks, mine, other, other_T_into);
  score.shared_count = 2 * match_count + score.missing_count;
  const Blocked there = CountBlocked(other, into, into_T_other);
  const Blocked here = CountBlocked(into, other, other_T_into);
  score.walled_count = there.walled_count + here.walled_count;
  score.blocked_count = there.blocked_count + here.blocked_count;
  const double expected =
      there.walled_count * other.own_blocked_share + here.walled_count * into.own_blocked_share;
  score.blocked_share = ShareOf(std::max(0.0, score.blocked_count - expected), score.walled_count);
  score.agreeing_share = ShareOf(2.0 * match_count, score.shared_count);
  score.score = match_count * score.agreeing_share * std::max(0.0, 1.0 - 3.0 * score.blocked_share);
  return score;
}

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

// Candidate pairs under a coarse pose; the registration selects among them.
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
  // The gate narrows as the pose improves.
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
    return Register(PositionsOf(other_.landmarks), PositionsOf(into_.landmarks),
                    PairsNear(into_, other_, pose, gate_m), options);
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

std::string DescribeForPeople(const Pose3d& pose) {
  const Eigen::Vector3d x = pose.orientation * Eigen::Vector3d::UnitX();
  return absl::StrFormat("(%.1f m, %.1f m, %.0f degrees)", pose.position.x(), pose.position.y(),
                         std::atan2(x.y(), x.x()) * 57.29577951308232);
}

// Reverts the centring of both sides.
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

// Nothing contradicts the transform.
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
      agreeing, rival_agreeing, DescribeForPeople(best.into_T_other),
      DescribeForPeople(rival.into_T_other)));
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
