// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/association.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/ingest/agents/tracking/people_util.h"

namespace dsg::ingest {
namespace {

struct Tracks {
  TrackEntry* Add(const Eigen::Vector3d& from, const Eigen::Vector3d& velocity) {
    entries.push_back(std::make_unique<TrackEntry>(std::ssize(entries) + 1, options));
    for (int i = 0; i < 6; ++i) {
      const double t_s = 0.2 * i;
      PersonObservation observation = ObservationAt(from + t_s * velocity, 0.1);
      observation.time_ns = AtS(t_s);
      entries.back()->Add(MakeSeen(observation));
    }
    pointers.push_back(entries.back().get());
    return pointers.back();
  }

  std::vector<int> All(const std::vector<SeenPerson>& seen, double t_s) const {
    return AssignAll(pointers, seen, AtS(t_s), ShapeStatistics(0.4, 1.0), options);
  }

  TrackerOptions options;
  std::vector<std::unique_ptr<TrackEntry>> entries;
  std::vector<TrackEntry*> pointers;
};

SeenPerson SeenAt(const Eigen::Vector3d& torso) { return MakeSeen(ObservationAt(torso, 0.1)); }

TEST(Reach, IsThatOfASecondAtLeast) {
  const TrackerOptions options;
  EXPECT_DOUBLE_EQ(ReachM(options, 1), 3.0);
  EXPECT_DOUBLE_EQ(ReachM(options, kNsPerSecond), 3.0);
  EXPECT_DOUBLE_EQ(ReachM(options, 2 * kNsPerSecond), 6.0);
}

TEST(Association, WorksWithoutTracksAndWithoutObservations) {
  Tracks tracks;
  EXPECT_TRUE(tracks.All({}, 2.0).empty());
  EXPECT_EQ(tracks.All({SeenAt(Eigen::Vector3d::Zero())}, 2.0), std::vector<int>{-1});
}

TEST(Association, TakesTheLeastSumAndNotTheFirst) {
  Tracks tracks;
  tracks.Add({0.0, 0.0, 0.95}, Eigen::Vector3d::Zero());
  tracks.Add({0.6, 0.0, 0.95}, Eigen::Vector3d::Zero());
  const std::vector<SeenPerson> seen = {SeenAt({0.62, 0.0, 0.95}), SeenAt({0.02, 0.0, 0.95})};
  EXPECT_EQ(tracks.All(seen, 1.2), (std::vector<int>{1, 0}));
  EXPECT_EQ(AssignFirst(tracks.pointers, seen, AtS(1.2), tracks.options), (std::vector<int>{0, 1}));
}

TEST(Association, FollowsTheWayOneWalks) {
  Tracks tracks;
  tracks.Add({0.0, 0.0, 0.95}, {1.2, 0.0, 0.0});
  tracks.Add({2.4, 0.3, 0.95}, {-1.2, 0.0, 0.0});
  // They have passed each other: nearest to each last position is the other one.
  const std::vector<SeenPerson> seen = {SeenAt({0.72, 0.3, 0.95}), SeenAt({1.68, 0.0, 0.95})};
  EXPECT_EQ(tracks.All(seen, 1.4), (std::vector<int>{1, 0}));
}

TEST(Association, LeavesAloneWhatIsTooFar) {
  Tracks tracks;
  tracks.Add({0.0, 0.0, 0.95}, Eigen::Vector3d::Zero());
  EXPECT_EQ(tracks.All({SeenAt({2.9, 0.0, 0.95})}, 1.2), std::vector<int>{-1});
  EXPECT_EQ(AssignFirst(tracks.pointers, {SeenAt({2.9, 0.0, 0.95})}, AtS(1.2), tracks.options),
            std::vector<int>{0});
  EXPECT_EQ(AssignFirst(tracks.pointers, {SeenAt({3.1, 0.0, 0.95})}, AtS(1.2), tracks.options),
            std::vector<int>{-1});
}

TEST(Association, OneFastJointIsTooMuch) {
  Tracks tracks;
  PersonObservation observation = ObservationAt({0.0, 0.0, 0.95}, 0.1);
  observation.has_joints = true;
  for (Eigen::Vector3d& joint : observation.joints_torso) joint.setZero();
  tracks.entries.push_back(std::make_unique<TrackEntry>(1, tracks.options));
  observation.time_ns = AtS(0.0);
  tracks.entries.back()->Add(MakeSeen(observation));
  tracks.pointers.push_back(tracks.entries.back().get());
  EXPECT_EQ(tracks.All({MakeSeen(observation)}, 0.2), std::vector<int>{0});
  observation.joints_torso[kRightHand] = {0.0, 3.1, 0.0};
  EXPECT_EQ(tracks.All({MakeSeen(observation)}, 0.2), std::vector<int>{-1});
}

}  // namespace
}  // namespace dsg::ingest
