// SPDX-License-Identifier: Apache-2.0
// How well a transform explains two maps: things found in both, against things that are missing and
// places that stand in walls.
// Refuses to improve the transform.
#pragma once

#include <utility>
#include <vector>

#include "schema/merge/landmarks.h"

namespace dsg::merge {

/// One map, ready to be compared under many transforms.
struct AlignSide {
  std::vector<Landmark> landmarks;
  /// x, y, z and clearance of places; a place without one has 0.
  std::vector<Eigen::Vector4d> places;
  /// Upright faces: walls with the box in their frame.
  std::vector<std::pair<Pose3d, Box3d>> walls;
  /// Of its places near a wall of its own, those that stand in one: walls are drawn across doors.
  double own_blocked_share = 0.0;
};

/// `center` is taken off all positions, so that far frames cost no precision.
AlignSide MakeSide(const MapContent& content, bool with_regions, const Eigen::Vector3d& center);

struct AlignScore {
  /// Index in the landmarks of `into`, of `other`.
  std::vector<std::pair<int, int>> matches;
  /// Landmarks of both that match nothing, though they lie where the other map has been.
  int missing_count = 0;
  /// Those, and those that match.
  int shared_count = 0;
  /// Places near a wall of the other map, and those that such a wall stands in.
  int walled_count = 0;
  int blocked_count = 0;
  /// Of the former, beyond what walls of one's own would do; 0 to 1.
  double blocked_share = 0.0;
  /// Of what both maps could have seen, what both did see; 0 to 1.
  double agreeing_share = 0.0;
  double score = 0.0;
};

/// Each landmark with at most one, the nearest that is nearest to each other.
std::vector<std::pair<int, int>> MatchLandmarks(const AlignSide& into, const AlignSide& other,
                                                const Pose3d& into_T_other, double gate_m);

/// About how many transforms between maps of so many things, strewn at random, would let so many
/// agree. Two pairs settle a transform; the others meet by chance (Poisson).
double ChanceOf(const AlignSide& into, const AlignSide& other, const AlignScore& score,
                double gate_m);

AlignScore ScoreTransform(const AlignSide& into, const AlignSide& other, const Pose3d& into_T_other,
                          double gate_m);

}  // namespace dsg::merge
