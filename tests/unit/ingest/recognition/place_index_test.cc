// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/place_index.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"
#include "tests/unit/ingest/recognition/made_places.h"

namespace dsg::ingest {
namespace {

std::shared_ptr<const KeyframeFeatures> Glimpse(uint64_t place, int track, double time_s,
                                                double bit_chance = 0.08) {
  ViewSpec spec;
  spec.stamp = {track, static_cast<TimeNs>(time_s * kNsPerSecond)};
  spec.bit_chance = bit_chance;
  spec.seed = 1000 * place + static_cast<uint64_t>(10.0 * time_s + 7.0 * track);
  return std::make_shared<const KeyframeFeatures>(
      MadeKeyframe(MakePlace(place, /*count=*/150), spec));
}

PlaceIndex MadeIndex(const PlaceIndexOptions& options = {}) {
  absl::StatusOr<PlaceIndex> index = PlaceIndex::Make(options);
  EXPECT_TRUE(index.ok()) << index.status();
  return *std::move(index);
}

// A path by so many places, one every second.
PlaceIndex IndexOfPath(int place_count, const PlaceIndexOptions& options = {}) {
  PlaceIndex index = MadeIndex(options);
  for (int i = 0; i < place_count; ++i) {
    index.Add(Glimpse(static_cast<uint64_t>(i), /*track=*/0, i));
  }
  return index;
}

TEST(PlaceIndex, FindsThePlaceAgain) {
  PlaceIndex index = IndexOfPath(60);
  for (const uint64_t place : {0u, 17u, 42u}) {
    const auto candidates = index.Query(*Glimpse(place, 0, 100.0));
    ASSERT_EQ(candidates.size(), 1u) << place;
    EXPECT_EQ(candidates[0].keyframe->stamp.time_ns, static_cast<TimeNs>(place) * kNsPerSecond);
    EXPECT_GT(candidates[0].vote_count, 100);
    EXPECT_GT(candidates[0].score, 0.4);
    EXPECT_LE(candidates[0].score, 1.0);
  }
}

TEST(PlaceIndex, UnknownPlacesAreNotFound) {
  PlaceIndex index = IndexOfPath(60);
  EXPECT_TRUE(index.Query(*Glimpse(99, 0, 100.0)).empty());
  EXPECT_TRUE(MadeIndex().Query(*Glimpse(1, 0, 100.0)).empty());
  EXPECT_TRUE(index.Query(KeyframeFeatures()).empty());
}

// Half of the bits of unrelated descriptors differ; of a place seen again, ever more do.
TEST(PlaceIndex, FewerVotesAsItLooksLessAlike) {
  PlaceIndex index = IndexOfPath(20);
  int before = 1000;
  for (const double chance : {0.04, 0.12, 0.16}) {
    const auto candidates = index.Query(*Glimpse(5, 0, 100.0, chance));
    ASSERT_FALSE(candidates.empty()) << chance;
    EXPECT_LT(candidates[0].vote_count, before);
    before = candidates[0].vote_count;
  }
  EXPECT_TRUE(index.Query(*Glimpse(5, 0, 100.0, 0.4)).empty());
}

TEST(PlaceIndex, RecentKeyframesOfTheSameTrackAreLeftOut) {
  PlaceIndex index = MadeIndex({.recent_ns = 10 * kNsPerSecond});
  index.Add(Glimpse(1, /*track=*/0, 0.0));
  EXPECT_TRUE(index.Query(*Glimpse(1, 0, 10.0)).empty());
  EXPECT_EQ(index.Query(*Glimpse(1, 0, 10.1)).size(), 1u);
  // Another robot's clock says nothing about the time between.
  EXPECT_EQ(index.Query(*Glimpse(1, 1, 5.0)).size(), 1u);
}

TEST(PlaceIndex, NeighboursInTimeAreOneIsland) {
  PlaceIndex index = MadeIndex({.island_gap_ns = 2 * kNsPerSecond});
  // The same place at three times; the first time it looks most alike in the middle.
  for (int i = 0; i < 5; ++i) index.Add(Glimpse(1, 0, i, i == 2 ? 0.01 : 0.1));
  for (int i = 0; i < 5; ++i) index.Add(Glimpse(1, 0, 50 + i, 0.12));
  index.Add(Glimpse(1, /*track=*/1, 4.0, 0.05));
  const auto candidates = index.Query(*Glimpse(1, 0, 100.0, 0.01));
  ASSERT_EQ(candidates.size(), 3u);
  EXPECT_EQ(candidates[0].keyframe->stamp.time_ns, 2 * kNsPerSecond);
  EXPECT_EQ(candidates[1].keyframe->stamp.track, 1);
  EXPECT_GE(candidates[2].keyframe->stamp.time_ns, 50 * kNsPerSecond);
  PlaceIndex fewer = MadeIndex({.island_gap_ns = 100 * kNsPerSecond, .candidate_count = 1});
  for (int i = 0; i < 5; ++i) fewer.Add(Glimpse(1, 0, 30 * i));
  EXPECT_EQ(fewer.Query(*Glimpse(1, 0, 1000.0)).size(), 1u);
}

TEST(PlaceIndex, PlacesFarBehindTheBestOneAreLeftOut) {
  for (const double share : {0.0, 0.9}) {
    PlaceIndex index = MadeIndex({.score_share_min = share});
    index.Add(Glimpse(1, /*track=*/0, 0.0, 0.01));
    index.Add(Glimpse(1, /*track=*/1, 0.0, 0.15));
    const auto candidates = index.Query(*Glimpse(1, 2, 0.0, 0.01));
    ASSERT_EQ(candidates.size(), share == 0.0 ? 2u : 1u);
    EXPECT_EQ(candidates[0].keyframe->stamp.track, 0);
  }
}

TEST(PlaceIndex, OnlyTheStrongestFeaturesVote) {
  PlaceIndex index = MadeIndex({.feature_count_max = 20});
  index.Add(Glimpse(1, 0, 0.0));
  const auto candidates = index.Query(*Glimpse(1, 1, 0.0, 0.01));
  ASSERT_EQ(candidates.size(), 1u);
  EXPECT_LE(candidates[0].vote_count, 20);
  EXPECT_GT(candidates[0].score, 0.4);
}

TEST(PlaceIndex, ConsistencyAsksForQueriesInARow) {
  PlaceIndexOptions options{.recent_ns = 0, .consistency_count = 3};
  PlaceIndex index = MadeIndex(options);
  for (int i = 0; i < 4; ++i) index.Add(Glimpse(1, 0, i));
  EXPECT_TRUE(index.Query(*Glimpse(1, 0, 100.0)).empty());
  EXPECT_TRUE(index.Query(*Glimpse(1, 0, 101.0)).empty());
  // Queries of other tracks do not count.
  EXPECT_TRUE(index.Query(*Glimpse(1, 5, 101.5)).empty());
  const auto candidates = index.Query(*Glimpse(1, 0, 102.0));
  ASSERT_EQ(candidates.size(), 1u);
  EXPECT_EQ(candidates[0].query_count, 3);
  // One that finds nothing ends the row.
  EXPECT_TRUE(index.Query(*Glimpse(2, 0, 103.0)).empty());
  EXPECT_TRUE(index.Query(*Glimpse(1, 0, 104.0)).empty());
}

TEST(PlaceIndex, IsThinnedOutWhenFullAndAlikeEverywhere) {
  PlaceIndex index = MadeIndex({.keyframe_count_max = 20, .recent_ns = 0});
  // Two robots take turns: none of them is forgotten whole.
  for (int i = 0; i < 100; ++i) {
    for (const int track : {0, 1}) {
      const int place = 2 * i + track;
      index.Add(Glimpse(static_cast<uint64_t>(place), track, i));
      EXPECT_LE(index.size(), 20);
    }
  }
  for (const int track : {0, 1}) {
    std::vector<int> found;
    for (int i = 0; i < 100; ++i) {
      const int place = 2 * i + track;
      const auto candidates = index.Query(*Glimpse(static_cast<uint64_t>(place), 2, 1000.0));
      if (candidates.empty()) continue;
      EXPECT_EQ(candidates[0].keyframe->stamp.time_ns, i * kNsPerSecond);
      found.push_back(i);
    }
    ASSERT_GE(found.size(), 5u) << track;
    for (size_t i = 1; i < found.size(); ++i) EXPECT_EQ(found[i] - found[i - 1], found[1]);
  }
}

TEST(PlaceIndex, BucketsThatAreFullTellNothing) {
  PlaceIndex index = MadeIndex({.bucket_count_max = 1, .recent_ns = 0});
  index.Add(Glimpse(1, 0, 0.0));
  EXPECT_FALSE(index.Query(*Glimpse(1, 0, 100.0)).empty());
  for (int i = 1; i < 4; ++i) index.Add(Glimpse(1, 0, i, 0.0));
  index.Add(Glimpse(1, 0, 5.0, 0.0));
  EXPECT_TRUE(index.Query(*Glimpse(1, 0, 100.0, 0.0)).empty());
}

TEST(PlaceIndex, AnswersTheSameAgain) {
  PlaceIndex one = IndexOfPath(30);
  PlaceIndex two = IndexOfPath(30);
  for (int i = 0; i < 5; ++i) {
    const auto query = Glimpse(static_cast<uint64_t>(i), 0, 100.0);
    const auto a = one.Query(*query);
    const auto b = two.Query(*query);
    ASSERT_EQ(a.size(), b.size());
    for (size_t k = 0; k < a.size(); ++k) {
      EXPECT_EQ(a[k].score, b[k].score);
      EXPECT_EQ(a[k].keyframe->stamp.time_ns, b[k].keyframe->stamp.time_ns);
    }
  }
}

TEST(PlaceIndex, RefusesOptionsOutOfRange) {
  EXPECT_EQ(ReasonOf(PlaceIndex::Make({.keyframe_count_max = 1}).status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::ingest
