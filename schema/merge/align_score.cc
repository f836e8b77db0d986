// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/align_score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "schema/merge/point_grid.h"

namespace dsg::merge {
namespace {

// A map has been where one of its places is this near beyond its clearance, or a landmark is.
constexpr double kSeenBeyondM = 0.5;
constexpr double kSeenAroundM = 1.5;
// Walls are thick, and clearances are measured on a grid.
constexpr double kWallSlackM = 0.35;
constexpr double kClearanceMaxM = 4.0;

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

// The landmark of `side` that is nearest to each point, of the point's kind and within the gate.
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

// How many of `points` match nothing, though they lie where `side` has been.
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

// Places of `free` that have a wall of `side` near, and those that such a wall stands in.
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
      // What stands at the height of a body only: places are on the floor or in the air.
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

}  // namespace

AlignSide MakeSide(const MapContent& content, bool with_regions, const Eigen::Vector3d& center) {
  AlignSide side;
  side.landmarks = LandmarksOf(content, with_regions);
  for (Landmark& landmark : side.landmarks) landmark.position -= center;
  for (const Node& node : content.nodes) {
    if (node.kind == kinds::kPlace) {
      Eigen::Vector4d place;
      place << node.map_T_node.position - center,
          node.place.has_value() ? node.place->clearance_m : 0.0;
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
  // Of two pairs the distances must agree: one in so many does, by the size of the map.
  const double alike = std::min(1.0, 4.0 * gate_m / std::sqrt(area));
  const double guess_count = std::max(1.0, pair_count * pair_count * alike);
  const int free = std::max(0, static_cast<int>(score.matches.size()) - 2);
  // The tail of Poisson is at most that of its first term times a geometric series.
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

}  // namespace dsg::merge
