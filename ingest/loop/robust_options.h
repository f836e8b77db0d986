// SPDX-License-Identifier: Apache-2.0
// Which loop closures are believed: all numbers that decide on it.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/loop/optimize.h"

namespace dsg::ingest {

/// What a solver is at, for the user: a phrase, and how much of how much is done; of 0: nobody
/// knows. Called often, from the thread that solves.
using TellWork = std::function<void(const char* what, int64_t done, int64_t total)>;

/// What counts as evidence for or against a loop.
struct EvidenceOptions {
  /// Pairs with the shortest odometry between them are compared first, and no more than this. The
  /// rest tell little, and count as agreeing.
  int pair_count_max = 2'000'000;
  /// Cycles less sure of their turn than this (standard deviation) never make a disagreement: the
  /// formula is of first order.
  double turn_rad_max = 0.6;
  /// Pairs that agree by accident more often than this do so in swarms: where one wrong loop fits,
  /// its neighbours fit as well.
  double telling_chance_max = 3e-3;
  /// Chances below this are not trusted: wrong loops are not that random.
  double chance_min = 1e-9;
  /// A map may be flat or a corridor; wrong loops are not that thin: each side of the room that
  /// they are in is this share of the longest one at least.
  double room_side_share_min = 0.1;
  /// Minus the logarithm of the chance that a loop from which the noise is learned found its
  /// support by accident.
  double support_min = 14.0;
  /// Loops disagree when their squared distance is above the gate times this, twice the standard
  /// deviations that it allows: the largest set is for throwing out liars, and not for losing one
  /// right loop in a hundred from every comparison.
  double disagreement_factor = 4.0;
  /// Noise has longer tails than the normal law, and edges of one graph differ.
  double noise_margin = 4.0;
  /// Degrees of freedom, six a spatial loop; fewer measurements say nothing about the noise.
  int noise_freedom_min = 30;
  /// Chances of wrong loops are bounds, and few loops are no sample: those that had it up to this
  /// many times easier count as if they had not.
  double alike_factor = 100.0;

  std::vector<BoundOption> Bind();
};

struct RobustOptions {
  /// Its weights are not used.
  OptimizeOptions optimize;
  /// Chance that right measurements pass each test. Loops that are believed are given up by a gate
  /// that all of them pass with this chance.
  double confidence = 0.99;
  bool is_pairwise_used = true;
  bool is_graduated_used = true;
  /// mu grows by this factor a step. Source: Yang et al. 2020.
  double graduation = 1.4;
  int graduation_count_max = 100;
  /// Loops are believed before graduation, and after it by themselves, when no more wrong ones than
  /// this are to be expected among them all...
  double wrong_count_max = 1e-2;
  /// ...and of loops that graduation kept those whose like are wrong this often at most.
  double wrong_share_max = 1e-2;
  /// Doubtful loops are not worth a graduation when they are fewer than this share of those
  /// believed: it is slow, and all that few can do is bend the poses their way.
  double doubtful_share_min = 0.05;
  /// How often belief spreads, and how often graduation decides on what is left.
  int belief_round_count_max = 8;
  int graduation_round_count_max = 4;
  EvidenceOptions evidence;
  /// May be empty.
  TellWork on_work;

  /// Without those of `optimize`.
  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
