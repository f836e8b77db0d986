// SPDX-License-Identifier: Apache-2.0
// Landmarks that another map of the same place should contain too, and votes of their pairs for
// coarse transforms between two upright maps. The best vote may be wrong; align.h decides.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/map_content.h"

namespace dsg::merge {

struct Landmark {
  /// Landmarks of different kinds never match.
  std::string kind;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// Length of the box's diagonal, or a place's clearance, metres; 0 when unknown.
  double size_m = 0.0;
};

/// Things with a class that are still there; `with_regions`: rooms and places too. Things without a
/// class are left out: they would match everything.
std::vector<Landmark> LandmarksOf(const MapContent& content, bool with_regions);

/// Sizes differ by less than a factor of two, or one is unknown.
bool AreAlike(const Landmark& a, const Landmark& b);

/// The landmarks of one kind in both maps, by index.
struct KindPair {
  std::vector<int> into;
  std::vector<int> other;
};
/// Ascending by kind; only kinds that both have.
std::vector<KindPair> PairKinds(const std::vector<Landmark>& into,
                                const std::vector<Landmark>& other);

/// into = Rz(yaw) other + shift; accurate to about a metre and a yaw step.
struct Guess {
  double yaw_rad = 0.0;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  double votes = 0.0;
};

struct VoteOptions {
  double yaw_step_rad = 0.0349;
  double cell_m = 0.5;
  int guess_count_max = 40;
};

/// The guesses with the most votes, best first, no two of them close to each other.
///
/// Cost: pairs of the same kind times steps of the yaw.
/// Errors: what `stop` returned.
absl::StatusOr<std::vector<Guess>> VoteOnTransform(const std::vector<Landmark>& into,
                                                   const std::vector<Landmark>& other,
                                                   const VoteOptions& options,
                                                   const StopCheck& stop);

}  // namespace dsg::merge
