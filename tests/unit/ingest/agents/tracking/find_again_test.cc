// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/find_again.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/ingest/agents/tracking/people_util.h"

namespace dsg::ingest {
namespace {

class FindAgainTest : public testing::Test {
 protected:
  SeenPerson See(const ShapeVector& shape, const Eigen::Vector3d& at, double t_s) {
    PersonObservation observation = ObservationAt(at, 0.2);
    observation.time_ns = AtS(t_s);
    observation.shape_coefficients = NoisyShape(shape, 0.4, &random_);
    return MakeSeen(std::move(observation));
  }

  void AddTrack(const ShapeVector& shape, const Eigen::Vector3d& at) {
    entries_.push_back(std::make_unique<TrackEntry>(std::ssize(entries_) + 1, options_));
    for (int i = 0; i < 8; ++i) entries_.back()->Add(See(shape, at, 0.2 * i));
    earlier_.push_back(entries_.back().get());
  }

  std::vector<SameAs> Find(const SeenPerson& seen) const {
    return FindAgain({seen.observation.time_ns, &seen.skeleton, &seen.shape}, earlier_,
                     ShapeStatistics(0.4, 1.0), options_);
  }

  TrackerOptions options_;
  Random random_{21, 0};
  std::vector<std::unique_ptr<TrackEntry>> entries_;
  std::vector<const TrackEntry*> earlier_;
};

TEST_F(FindAgainTest, NamesTheRightOneOfMany) {
  std::vector<ShapeVector> people;
  for (int i = 0; i < 20; ++i) {
    people.push_back(DrawShape(&random_));
    AddTrack(people.back(), {static_cast<double>(i), 0.0, 0.95});
  }
  for (size_t i = 0; i < people.size(); ++i) {
    const std::vector<SameAs> found = Find(See(people[i], {10.0, 5.0, 0.95}, 30.0));
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found.front().earlier_track, static_cast<int64_t>(i) + 1);
    EXPECT_GT(found.front().probability, 0.9);
  }
}

TEST_F(FindAgainTest, TwinsShareTheProbability) {
  const ShapeVector twin = DrawShape(&random_);
  AddTrack(twin, {0.0, 0.0, 0.95});
  AddTrack(twin, {1.0, 0.0, 0.95});
  const std::vector<SameAs> found = Find(See(twin, {2.0, 0.0, 0.95}, 10.0));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_LT(found.front().probability, options_.again_probability_min);
  EXPECT_LE(found[0].probability + found[1].probability, 1.0);
  EXPECT_GE(found[0].probability, found[1].probability);
}

TEST_F(FindAgainTest, NobodyRunsThroughTheBuilding) {
  const ShapeVector shape = DrawShape(&random_);
  AddTrack(shape, {0.0, 0.0, 0.95});
  EXPECT_TRUE(Find(See(shape, {40.0, 0.0, 0.95}, 6.0)).empty());
  EXPECT_FALSE(Find(See(shape, {40.0, 0.0, 0.95}, 30.0)).empty());
}

TEST_F(FindAgainTest, ForgetsAfterAWhile) {
  const ShapeVector shape = DrawShape(&random_);
  AddTrack(shape, {0.0, 0.0, 0.95});
  const double again_s = static_cast<double>(options_.again_ns) / 1e9;
  EXPECT_FALSE(Find(See(shape, {0.0, 0.0, 0.95}, again_s)).empty());
  EXPECT_TRUE(Find(See(shape, {0.0, 0.0, 0.95}, again_s + 2.0)).empty());
}

TEST_F(FindAgainTest, SaysNothingOfStrangersAndOfThoseWithoutShape) {
  for (int i = 0; i < 20; ++i) AddTrack(DrawShape(&random_), {0.0, 0.0, 0.95});
  EXPECT_TRUE(Find(See(DrawShape(&random_), {0.0, 0.0, 0.95}, 10.0)).empty());
  SeenPerson bare = See(DrawShape(&random_), {0.0, 0.0, 0.95}, 10.0);
  bare.shape = ShapeMean();
  EXPECT_TRUE(Find(bare).empty());
}

TEST_F(FindAgainTest, NobodyIsTwiceInOneImage) {
  const ShapeVector shape = DrawShape(&random_);
  AddTrack(shape, {0.0, 0.0, 0.95});
  SeenPerson seen = See(shape, {0.0, 0.0, 0.95}, 1.4);
  EXPECT_EQ(seen.observation.time_ns, entries_.front()->last_ns());
  EXPECT_TRUE(Find(seen).empty());
}

}  // namespace
}  // namespace dsg::ingest
