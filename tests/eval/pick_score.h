// SPDX-License-Identifier: Apache-2.0
// What ListInteractions makes of a pick world, against what happened, as counts and shares.
// Refuses to count a lucky guess: the right person of another pick is wrong.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "dsg/v1/meetings.pb.h"
#include "tests/eval/pick_world.h"

namespace dsg::eval {

/// A pick is answerable if an object stood for the thing, it was noticed to be gone, and the person
/// was tracked within so many seconds of it.
inline constexpr double kSeenApartS = 3.0;

/// A change that the map tells of, and what it really was.
struct ScoredChange {
  std::string world;
  v1::Interaction change;
  /// Index in PickWorld::picks; -1 = nothing happened.
  int pick = -1;
  bool is_answerable = false;
  bool is_robot_map = false;
  /// For each candidate, whether it did it: tracks of the person, or false_change, or unseen where
  /// no track of the person is a candidate.
  std::vector<bool> did_it;

  bool IsRight() const { return pick >= 0 && !change.abstained() && did_it[0]; }
};

/// Counts that add up over worlds.
struct PickFigures {
  int64_t pick_count = 0, held_count = 0, noticed_count = 0, answerable_count = 0;
  int64_t change_count = 0, real_count = 0, answer_count = 0, right_count = 0;
  int64_t answerable_right_count = 0;
  /// Of the changes that are picks: the likeliest person is the one.
  int64_t top_count = 0;
  double brier_sum = 0.0;
  int64_t brier_count = 0;
  /// By the probability of the likeliest person, in fifths.
  std::array<int64_t, 5> bin_counts{};
  std::array<double, 5> bin_sums{};
  std::array<int64_t, 5> bin_right_counts{};

  void Add(const PickFigures& other);
  double precision() const;
  double recall_of_all() const;
  double recall_of_answerable() const;
  double brier() const;
  /// A few lines for people.
  std::string Text() const;
};

struct PickScore {
  PickFigures picked;
  PickFigures placed;
  std::vector<ScoredChange> picked_changes;
  std::vector<ScoredChange> placed_changes;
};

/// Stores the world in a temporary folder and asks.
absl::StatusOr<PickScore> ScorePicks(PickWorld world);

}  // namespace dsg::eval
