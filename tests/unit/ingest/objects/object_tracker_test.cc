// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/object_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "schema/base/random.h"
#include "tests/unit/ingest/objects/objects_test_util.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;
using Clusters = std::vector<ObjectCluster>;

bool Nowhere(const Eigen::Vector3f&) { return false; }
bool Everywhere(const Eigen::Vector3f&) { return true; }

bool IsEmpty(const ObjectChanges& changes) {
  return changes.added.empty() && changes.changed.empty() && changes.merged.empty() &&
         changes.gone.empty();
}

ObjectCluster ChairAt(double x, uint32_t instance = 0) {
  return BoxCluster(11, instance, {x, 0.0, 0.0}, kChairSize);
}

TEST(ObjectTracker, AddsObjectsInTheOrderOfTheirClusters) {
  ObjectTracker tracker;
  const ObjectChanges changes = tracker.Update({ChairAt(0.0), ChairAt(2.0)}, 5, Nowhere);
  EXPECT_EQ(changes.added, (std::vector<int64_t>{0, 1}));
  ASSERT_EQ(tracker.objects().size(), 2u);
  EXPECT_EQ(tracker.objects()[1].first_observed_ns, 5);
  EXPECT_EQ(tracker.objects()[1].observation_count, 1);
}

TEST(ObjectTracker, ForgetsWhatIsLostWhereClustersAreAllThereIs) {
  for (const bool forgets_lost : {false, true}) {
    ObjectTracker tracker(forgets_lost);
    tracker.Update({ChairAt(0.0), ChairAt(2.0)}, 1, Nowhere);
    const ObjectChanges changes = tracker.Update({ChairAt(2.0)}, 2, Nowhere);
    EXPECT_TRUE(changes.gone.empty());
    EXPECT_EQ(changes.forgotten, forgets_lost ? std::vector<int64_t>{0} : std::vector<int64_t>());
    EXPECT_EQ(tracker.objects().size(), forgets_lost ? 1u : 2u);
    // What is seen to be away was there.
    EXPECT_EQ(tracker.Update({}, 3, Everywhere).gone.back(), 1);
  }
}

TEST(ObjectTracker, ForgetsWhatANewSurfaceDoesNotHave) {
  ObjectTracker tracker;
  tracker.Update({ChairAt(0.0), ChairAt(2.0), ChairAt(4.0)}, 1, Nowhere);
  tracker.BeginAgain();
  const ObjectChanges changes = tracker.Update({ChairAt(2.0, 7)}, 2, Everywhere);
  EXPECT_TRUE(changes.gone.empty());
  EXPECT_EQ(changes.forgotten, (std::vector<int64_t>{0, 2}));
  ASSERT_EQ(tracker.objects().size(), 1u);
  EXPECT_EQ(tracker.objects()[0].id, 1);
  // Once only.
  EXPECT_EQ(tracker.Update({}, 3, Everywhere).gone.back(), 1);
}

TEST(ObjectTracker, CallsSmallDifferencesNoChange) {
  ObjectTracker tracker;
  tracker.Update({ChairAt(0.0)}, 1, Nowhere);
  EXPECT_TRUE(IsEmpty(tracker.Update({ChairAt(0.0)}, 2, Nowhere)));
  EXPECT_EQ(tracker.objects()[0].last_observed_ns, 1);
  EXPECT_TRUE(IsEmpty(tracker.Update({ChairAt(0.015)}, 3, Nowhere)));
  // It was looked at, but it is where it was.
  EXPECT_EQ(tracker.objects()[0].last_observed_ns, 3);
  EXPECT_EQ(tracker.objects()[0].observation_count, 1);
  EXPECT_EQ(tracker.objects()[0].cluster.center_map, ChairAt(0.0).center_map);
}

TEST(ObjectTracker, SumsUpSmallDifferencesToAChange) {
  ObjectTracker tracker;
  tracker.Update({ChairAt(0.0)}, 1, Nowhere);
  int change_count = 0;
  for (int i = 1; i <= 10; ++i) {
    const ObjectChanges changes = tracker.Update({ChairAt(0.01 * i)}, i + 1, Nowhere);
    EXPECT_TRUE(changes.added.empty());
    change_count += changes.changed.empty() ? 0 : 1;
  }
  EXPECT_GE(change_count, 3);
  EXPECT_LE(change_count, 5);
  EXPECT_NEAR(tracker.objects()[0].cluster.center_map.x(), 0.325, 0.021);
}

TEST(ObjectTracker, FollowsAnInstanceThroughAChangeOfClass) {
  ObjectTracker tracker;
  tracker.Update({ChairAt(0.0, 7)}, 1, Nowhere);
  ObjectCluster armchair = ChairAt(0.0, 7);
  armchair.class_id = 15;
  const ObjectChanges changes = tracker.Update({armchair}, 2, Nowhere);
  EXPECT_EQ(changes.changed, (std::vector<int64_t>{0}));
  EXPECT_TRUE(changes.added.empty());
  EXPECT_EQ(tracker.objects()[0].cluster.class_id, 15);
}

TEST(ObjectTracker, PrefersTheInstanceToTheOverlap) {
  ObjectTracker tracker;
  tracker.Update({ChairAt(0.0, 7), ChairAt(0.5, 8)}, 1, Nowhere);
  // Both have moved, each to where the other was.
  const ObjectChanges changes = tracker.Update({ChairAt(0.0, 8), ChairAt(0.5, 7)}, 2, Nowhere);
  EXPECT_TRUE(changes.added.empty());
  EXPECT_EQ(changes.changed, (std::vector<int64_t>{0, 1}));
  EXPECT_NEAR(tracker.objects()[0].cluster.center_map.x(), 0.725, 1e-6);
}

TEST(ObjectTracker, KeepsTheIdOfAnObjectThatGrowsIntoView) {
  ObjectTracker tracker;
  for (int i = 1; i <= 8; ++i) {
    const auto couch = BoxCluster(13, 0, {0.0, 0.0, 0.0}, {0.25 * i, 0.85, 0.8});
    const ObjectChanges changes = tracker.Update({couch}, i, Nowhere);
    EXPECT_EQ(changes.added.empty(), i > 1);
  }
  ASSERT_EQ(tracker.objects().size(), 1u);
  EXPECT_EQ(tracker.objects()[0].id, 0);
  EXPECT_EQ(tracker.objects()[0].observation_count, 8);
}

TEST(ObjectTracker, MergesPartsThatTurnOutToBeOne) {
  ObjectTracker tracker;
  const auto left = BoxCluster(13, 0, {0.0, 0.0, 0.0}, {0.5, 0.85, 0.8});
  const auto right = BoxCluster(13, 0, {0.9, 0.0, 0.0}, {1.0, 0.85, 0.8});
  tracker.Update({left, right}, 1, Nowhere);
  const auto whole = BoxCluster(13, 0, {0.0, 0.0, 0.0}, {1.9, 0.85, 0.8});
  const ObjectChanges changes = tracker.Update({whole}, 2, Nowhere);
  ASSERT_EQ(changes.merged.size(), 1u);
  EXPECT_EQ(changes.merged[0], (std::pair<int64_t, int64_t>(0, 1)));
  EXPECT_EQ(changes.changed, (std::vector<int64_t>{1}));
  EXPECT_TRUE(changes.gone.empty());
  ASSERT_EQ(tracker.objects().size(), 1u);
  EXPECT_EQ(tracker.objects()[0].first_observed_ns, 1);
}

TEST(ObjectTracker, AddsThePartThatSplitsOffAndNeverReusesAnId) {
  ObjectTracker tracker;
  tracker.Update({BoxCluster(11, 0, {0.0, 0.0, 0.0}, {0.91, 0.45, 0.9})}, 1, Nowhere);
  const ObjectChanges split = tracker.Update({ChairAt(0.0, 1), ChairAt(0.46, 2)}, 2, Nowhere);
  EXPECT_EQ(split.changed, (std::vector<int64_t>{0}));
  EXPECT_EQ(split.added, (std::vector<int64_t>{1}));
  EXPECT_EQ(tracker.Update({}, 3, Everywhere).gone, (std::vector<int64_t>{0, 1}));
  EXPECT_TRUE(tracker.objects().empty());
  EXPECT_EQ(tracker.Update({ChairAt(0.0)}, 4, Nowhere).added, (std::vector<int64_t>{2}));
}

TEST(ObjectTracker, KeepsWhatNobodyLookedAt) {
  ObjectTracker tracker;
  tracker.Update({ChairAt(0.0), ChairAt(2.0)}, 1, Nowhere);
  EXPECT_TRUE(IsEmpty(tracker.Update({ChairAt(2.0)}, 2, Nowhere)));
  EXPECT_EQ(tracker.objects().size(), 2u);
}

TEST(ObjectTracker, DropsWhatIsSeenThroughForTheMostPart) {
  ObjectTracker tracker;
  tracker.Update({ChairAt(0.0)}, 1, Nowhere);
  const auto is_left = [](const Eigen::Vector3f& point) { return point.x() < 0.15f; };
  EXPECT_TRUE(IsEmpty(tracker.Update({}, 2, is_left)));
  const auto is_wide_left = [](const Eigen::Vector3f& point) { return point.x() < 0.4f; };
  EXPECT_EQ(tracker.Update({}, 3, is_wide_left).gone, (std::vector<int64_t>{0}));
}

TEST(ObjectTracker, GivesThePointsOfARelabelledFragmentToTheirNewObject) {
  ObjectTracker tracker;
  const auto table = BoxCluster(12, 0, {0.0, 0.0, 0.0}, {1.4, 0.8, 0.75});
  ObjectCluster fragment = BoxCluster(20, 0, {0.0, 0.0, 0.6}, {0.2, 0.2, 0.15});
  // The fragment was a corner of the table, with another label.
  fragment.points_map.clear();
  for (const Eigen::Vector3f& point : table.points_map) {
    if (point.x() < 0.2f && point.y() < 0.2f && point.z() > 0.6f) {
      fragment.points_map.push_back(point);
    }
  }
  ASSERT_FALSE(fragment.points_map.empty());
  tracker.Update({table, fragment}, 1, Nowhere);
  const ObjectChanges changes = tracker.Update({table}, 2, Nowhere);
  ASSERT_EQ(changes.merged.size(), 1u);
  EXPECT_EQ(changes.merged[0], (std::pair<int64_t, int64_t>(1, 0)));
}

TEST(ObjectTracker, KeepsACupOnATableThatIsNotSeenForAWhile) {
  ObjectTracker tracker;
  const auto table = BoxCluster(12, 0, {0.0, 0.0, 0.0}, {1.4, 0.8, 0.75});
  const auto cup = BoxCluster(20, 0, {0.6, 0.4, 0.75}, {0.08, 0.08, 0.1});
  tracker.Update({table, cup}, 1, Nowhere);
  EXPECT_TRUE(IsEmpty(tracker.Update({table}, 2, Nowhere)));
}

TEST(ObjectTracker, KeepsItsBooksStraightInAnyHistory) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 0);
    ObjectTracker tracker;
    std::vector<int64_t> known;
    int64_t next_id = 0;
    for (int update = 0; update < 30; ++update) {
      Clusters clusters;
      for (int i = random.Index(6); i > 0; --i) {
        clusters.push_back(BoxCluster(
            11 + random.Index(2), static_cast<uint32_t>(random.Index(5)),
            {random.Uniform(0.0, 3.0), random.Uniform(0.0, 3.0), 0.0},
            {random.Uniform(0.1, 1.0), random.Uniform(0.1, 1.0), random.Uniform(0.1, 1.0)}));
      }
      const double seen_share = random.Uniform();
      const auto is_seen_through = [&](const Eigen::Vector3f& point) {
        return static_cast<double>(point.x()) < 3.0 * seen_share;
      };
      const ObjectChanges changes = tracker.Update(clusters, update, is_seen_through);
      for (const int64_t id : changes.added) {
        EXPECT_EQ(id, next_id++);
        known.push_back(id);
      }
      for (const int64_t id : changes.changed)
        EXPECT_TRUE(std::count(known.begin(), known.end(), id));
      for (const int64_t id : changes.gone) EXPECT_EQ(std::erase(known, id), 1u);
      for (const auto& [from, to] : changes.merged) {
        EXPECT_EQ(std::erase(known, from), 1u);
        EXPECT_TRUE(std::count(known.begin(), known.end(), to));
      }
      std::vector<int64_t> ids;
      for (const TrackedObject& object : tracker.objects()) ids.push_back(object.id);
      EXPECT_EQ(ids, known);
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
