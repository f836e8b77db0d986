// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/picks.h"

#include <gtest/gtest.h>

namespace dsg::evaluation {
namespace {

constexpr TimeNs kS = kNsPerSecond;

std::vector<TruePick> PickTruth() {
  return {
      {0, 0, 10 * kS, true}, {1, 1, 20 * kS, true}, {2, 0, 30 * kS, true}, {3, 1, 40 * kS, false}};
}

std::vector<PredictedPick> PerfectPicks() {
  return {{0, 0, 10 * kS, 1.0}, {1, 1, 21 * kS, 1.0}, {2, 0, 28 * kS, 1.0}};
}

TEST(PickMetric, IsPerfectForTheTruthItself) {
  const PickResult result = EvaluatePicks(PerfectPicks(), PickTruth(), {});
  EXPECT_DOUBLE_EQ(*result.precision, 1.0);
  EXPECT_DOUBLE_EQ(*result.recall, 1.0);
  EXPECT_DOUBLE_EQ(*result.brier, 0.0);
}

TEST(PickMetric, IsZeroForSwappedPeople) {
  std::vector<PredictedPick> swapped = PerfectPicks();
  for (PredictedPick& pick : swapped) pick.human = 1 - pick.human;
  const PickResult result = EvaluatePicks(swapped, PickTruth(), {});
  EXPECT_DOUBLE_EQ(*result.precision, 0.0);
  EXPECT_DOUBLE_EQ(*result.recall, 0.0);
  EXPECT_DOUBLE_EQ(*result.brier, 1.0);
}

TEST(PickMetric, WantsTheRightTime) {
  std::vector<PredictedPick> late = PerfectPicks();
  late[0].pick_ns += 5 * kS;
  late[1].pick_ns += 5 * kS;
  late[2].pick_ns = kTimeMin;
  EXPECT_NEAR(*EvaluatePicks(late, PickTruth(), {}).recall, 1.0 / 3.0, 1e-12);
}

TEST(PickMetric, TakesTheUnsureForAbstentions) {
  std::vector<PredictedPick> unsure = PerfectPicks();
  unsure[0].probability = 0.5;
  unsure.push_back({0, 1, 10 * kS, 0.5});
  const PickResult result = EvaluatePicks(unsure, PickTruth(), {});
  EXPECT_DOUBLE_EQ(*result.precision, 1.0);
  EXPECT_NEAR(*result.recall, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(*result.brier, (0.25 + 0.0 + 0.0 + 0.25) / 4.0, 1e-12);
}

TEST(PickMetric, GivesEachPickOnce) {
  std::vector<PredictedPick> twice = PerfectPicks();
  twice.push_back(twice[0]);
  EXPECT_DOUBLE_EQ(*EvaluatePicks(twice, PickTruth(), {}).precision, 0.75);
}

TEST(PickMetric, NeitherAsksForNorPunishesWhatNobodySaw) {
  std::vector<PredictedPick> all = PerfectPicks();
  all.push_back({3, 1, 40 * kS, 0.9});
  const PickResult result = EvaluatePicks(all, PickTruth(), {});
  EXPECT_DOUBLE_EQ(*result.precision, 1.0);
  EXPECT_DOUBLE_EQ(*result.recall, 1.0);
  EXPECT_EQ(result.truth_count, 3);
}

TEST(PickMetric, CountsHowFarTheChainCame) {
  std::vector<TruePick> truth = PickTruth();
  for (TruePick& pick : truth) pick.is_mapped = true;
  truth[1].is_mapped = false;
  truth[2].is_noticed = truth[3].is_noticed = true;
  std::vector<PredictedPick> picks = PerfectPicks();
  picks[0].human = 1;
  picks[1].probability = 0.3;
  const PickResult result = EvaluatePicks(picks, truth, {});
  EXPECT_EQ(result.mapped_count, 2);
  EXPECT_EQ(result.noticed_count, 1);
  EXPECT_EQ(result.sure_count, 2);
  EXPECT_EQ(result.right_count, 1);
}

TEST(PickMetric, IsEmptyWithoutPredictions) {
  const PickResult result = EvaluatePicks({}, PickTruth(), {});
  EXPECT_FALSE(result.precision.has_value());
  EXPECT_FALSE(result.recall.has_value());
  EXPECT_FALSE(result.brier.has_value());
}

}  // namespace
}  // namespace dsg::evaluation
