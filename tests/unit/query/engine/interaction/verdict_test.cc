// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/verdict.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg::query {
namespace {

Suspect Of(NodeId agent, double log_odds) {
  Suspect candidate;
  candidate.agent = agent;
  if (agent.empty()) candidate.alternative = kFalseChange;
  candidate.evidence.push_back({"prior", log_odds});
  return candidate;
}

double Sum(const Verdict& verdict) {
  double sum = 0.0;
  for (const Suspect& one : verdict.candidates) sum += one.probability;
  return sum;
}

constexpr NodeId kAnna('H', 1);
constexpr NodeId kBert('H', 2);

TEST(Verdict, NamesTheClearlyBest) {
  const Verdict verdict = Judge({Of(kAnna, 0.0), Of(kBert, 4.0), Of(NodeId(), -1.0)}, {});
  EXPECT_FALSE(verdict.abstained);
  EXPECT_EQ(verdict.candidates[0].agent, kBert);
  EXPECT_EQ(verdict.reason, "");
  EXPECT_NEAR(Sum(verdict), 1.0, 1e-12);
}

TEST(Verdict, AbstainsBetweenTwoThatAreAlike) {
  const Verdict verdict = Judge({Of(kAnna, 3.0), Of(kBert, 3.0), Of(NodeId(), -3.0)}, {});
  EXPECT_TRUE(verdict.abstained);
  EXPECT_EQ(verdict.candidates[0].agent, kAnna) << "ties by id";
  EXPECT_FALSE(verdict.reason.empty());
}

TEST(Verdict, AbstainsWhereNothingHappened) {
  const Verdict verdict = Judge({Of(kAnna, 0.0), Of(NodeId(), 4.0)}, {});
  EXPECT_TRUE(verdict.abstained);
  EXPECT_EQ(verdict.candidates[0].alternative, kFalseChange);
}

TEST(Verdict, GivesTheEarlierTrackItsShareOfTheLaterOne) {
  const Verdict verdict = Judge({Of(kBert, 5.0), Of(NodeId(), -5.0)}, {{kBert, kAnna, 0.9}});
  EXPECT_FALSE(verdict.abstained);
  EXPECT_EQ(verdict.candidates[0].agent, kAnna);
  EXPECT_NEAR(verdict.candidates[0].probability, 0.9, 0.01);
  EXPECT_EQ(verdict.candidates[0].evidence.back().source, "H2 SAME_AS H1");
  EXPECT_NEAR(Sum(verdict), 1.0, 1e-12);
}

TEST(Verdict, AbstainsWhenTheIdentityIsOpen) {
  const Verdict verdict = Judge({Of(kBert, 5.0), Of(NodeId(), -5.0)}, {{kBert, kAnna, 0.5}});
  EXPECT_TRUE(verdict.abstained);
}

TEST(Verdict, NamesNobodyWhomNobodySawNear) {
  Suspect anna = Of(kAnna, 4.0);
  anna.was_near = false;
  const Verdict verdict = Judge({anna, Of(NodeId(), -1.0)}, {});
  EXPECT_TRUE(verdict.abstained);
  EXPECT_EQ(verdict.candidates[0].agent, kAnna);
  EXPECT_NE(verdict.reason.find("H1"), std::string::npos) << verdict.reason;
}

TEST(Verdict, SurvivesExtremeWeights) {
  const Verdict verdict = Judge({Of(kAnna, -1e5), Of(kBert, -1e6)}, {});
  EXPECT_EQ(verdict.candidates[0].agent, kAnna);
  EXPECT_TRUE(std::isfinite(Sum(verdict)));
}

}  // namespace
}  // namespace dsg::query
