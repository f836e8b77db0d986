// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/consensus.h"

#include <gtest/gtest.h>

#include <set>

namespace dsg::ingest {
namespace {

TEST(SampleCountFor, IsThatOfTheLiterature) {
  EXPECT_EQ(SampleCountFor(0.5, 5, 0.995), 167);
  EXPECT_EQ(SampleCountFor(0.5, 3, 0.995), 40);
  EXPECT_EQ(SampleCountFor(0.5, 2, 0.995), 19);
  EXPECT_EQ(SampleCountFor(0.5, 1, 0.995), 8);
  EXPECT_EQ(SampleCountFor(0.3, 5, 0.995), 2178);
  EXPECT_EQ(SampleCountFor(0.3, 3, 0.995), 194);
  EXPECT_EQ(SampleCountFor(0.3, 2, 0.995), 57);
  EXPECT_EQ(SampleCountFor(0.3, 1, 0.995), 15);
}

TEST(SampleCountFor, IsBoundedWhereNoneOrAllAreRight) {
  EXPECT_EQ(SampleCountFor(1.0, 5, 0.995), 1);
  EXPECT_EQ(SampleCountFor(0.0, 5, 0.995), 1'000'000'000);
  EXPECT_EQ(SampleCountFor(1e-9, 5, 0.995), 1'000'000'000);
}

std::vector<std::vector<int>> AllSamples(int count, int size, const ConsensusOptions& options) {
  std::vector<std::vector<int>> samples;
  SampleDraws draws(count, size, options);
  for (auto sample = draws.Next(); !sample.empty(); sample = draws.Next()) {
    samples.emplace_back(sample.begin(), sample.end());
  }
  EXPECT_EQ(draws.drawn_count(), static_cast<int>(samples.size()));
  return samples;
}

TEST(SampleDraws, DrawsDifferentPointsAndTheSameAgain) {
  ConsensusOptions options;
  options.draw_count_max = 300;
  const auto samples = AllSamples(7, 5, options);
  ASSERT_EQ(samples.size(), 300u);
  std::set<int> drawn;
  for (const std::vector<int>& sample : samples) {
    const std::set<int> different(sample.begin(), sample.end());
    EXPECT_EQ(different.size(), 5u);
    drawn.insert(different.begin(), different.end());
  }
  EXPECT_EQ(drawn, (std::set<int>{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(AllSamples(7, 5, options), samples);
  options.seed = 2;
  EXPECT_NE(AllSamples(7, 5, options), samples);
}

TEST(SampleDraws, EndsWhenEnoughAgree) {
  const ConsensusOptions options;
  SampleDraws draws(100, 2, options);
  while (!draws.Next().empty()) {
    if (draws.drawn_count() == 3) draws.NoteAgreement(30);
  }
  EXPECT_EQ(draws.drawn_count(), 57);
}

TEST(SampleDraws, DrawsNoFewerThanTheLeast) {
  const ConsensusOptions options;
  SampleDraws draws(100, 2, options);
  while (!draws.Next().empty()) draws.NoteAgreement(100);
  EXPECT_EQ(draws.drawn_count(), options.draw_count_min);
}

TEST(IsConsensus, NeedsACountAndAShare) {
  const ConsensusOptions options;
  EXPECT_TRUE(IsConsensus(10, 50, options));
  EXPECT_FALSE(IsConsensus(9, 9, options));
  EXPECT_FALSE(IsConsensus(10, 51, options));
}

}  // namespace
}  // namespace dsg::ingest
