// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/robust_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<RobustOptions> kRobustFields[] = {
    {"loop-confidence", &RobustOptions::confidence, 0.5, 0.999999,
     "Chance that right loop closures pass each test: one in a hundred is given up"},
    {"loop-wrong-count", &RobustOptions::wrong_count_max, 1e-9, 100.0,
     "Loop closures are believed while no more wrong ones are to be expected among all that are: "
     "one in a hundred logs"},
    {"loop-wrong-share", &RobustOptions::wrong_share_max, 1e-9, 1.0,
     "Those that graduation keeps are believed if no larger a share of their like is wrong: one in "
     "a hundred"},
    {"loop-doubtful-share", &RobustOptions::doubtful_share_min, 0.0, 100.0,
     "Doubtful loop closures are graduated from this share of the believed ones on: it is slow, "
     "and few can only bend the path their way"},
    {"loop-belief-rounds", &RobustOptions::belief_round_count_max, 1, 1000,
     "How often belief spreads from loop closures to others that fit, at most: it ends by itself "
     "before that in most logs"},
    {"loop-graduation-rounds", &RobustOptions::graduation_round_count_max, 1, 1000,
     "How often graduation decides on what is still doubtful, at most: each is slow, and later "
     "ones decide little"},
    {"loop-graduation-steps", &RobustOptions::graduation_count_max, 1, 10'000,
     "Steps of a graduation at most: it has converged long before"},
    {"loop-graduation-factor", &RobustOptions::graduation, 1.01, 10.0,
     "Factor by which the cost of a doubtful loop closure hardens a step: Yang et al., 2020, have "
     "1.4"},
};

constexpr OptionField<EvidenceOptions> kEvidenceFields[] = {
    {"loop-pairs", &EvidenceOptions::pair_count_max, 1, 5e7,
     "Pairs of loop closures that are compared, those with the least odometry between them: some "
     "seconds and 0.1 GB; the rest tells little, and counts as agreeing"},
    {"loop-pair-turn", &EvidenceOptions::turn_rad_max, 0.01, 3.2,
     "Pairs whose odometry is less sure of its turn never disagree, radians: the formula is of "
     "first order"},
    {"loop-pair-disagreement", &EvidenceOptions::disagreement_factor, 1.0, 1000.0,
     "Pairs disagree at this many times the squared deviation that right ones have: twice the "
     "standard deviations, or each comparison would lose some right ones"},
    {"loop-telling-chance", &EvidenceOptions::telling_chance_max, 1e-9, 1.0,
     "Pairs that wrong loop closures pass more often tell nothing: where one passes, so do those "
     "beside it"},
    {"loop-chance-min", &EvidenceOptions::chance_min, 1e-15, 0.1,
     "Least chance that a wrong loop closure passes a test: they are not that random"},
    {"loop-room-side", &EvidenceOptions::room_side_share_min, 1e-3, 1.0,
     "Least side of the room that wrong loop closures are spread in, of its longest: a map may be "
     "flat or a corridor, they are not"},
    {"loop-support", &EvidenceOptions::support_min, 0.0, 1000.0,
     "Noise is learned from loop closures that so many others support that accident has a chance "
     "of e to minus this: one in a million"},
    {"loop-noise-margin", &EvidenceOptions::noise_margin, 1.0, 1000.0,
     "Squared noise is taken to be so many times what is seen: it has long tails, and loop "
     "closures of one log differ"},
    {"loop-noise-freedom", &EvidenceOptions::noise_freedom_min, 1, 1'000'000,
     "Noise is learned from as many numbers at least, six a loop closure: five of them; with fewer "
     "it is what their information says"},
    {"loop-alike", &EvidenceOptions::alike_factor, 1.0, 1e9,
     "Wrong loop closures to which a test was up to so many times easier count as wrong ones that "
     "met it: chances are bounds, and few are no sample"},
};

}  // namespace

std::vector<BoundOption> EvidenceOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<EvidenceOptions>(kEvidenceFields, this, &bound);
  return bound;
}

std::vector<BoundOption> RobustOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<RobustOptions>(kRobustFields, this, &bound);
  const std::vector<BoundOption> evidence_bound = evidence.Bind();
  bound.insert(bound.end(), evidence_bound.begin(), evidence_bound.end());
  return bound;
}

}  // namespace dsg::ingest
