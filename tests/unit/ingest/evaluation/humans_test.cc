// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/humans.h"

#include <gtest/gtest.h>

namespace dsg::evaluation {
namespace {

constexpr int kStamps = 20;

/// Two people 2 m apart who are detected at every stamp, 0.5 m and 0.3 m off.
struct Scene {
  std::vector<TrueDetection> detections;
  std::vector<EstimatedPrior> priors;
  std::vector<EstimatedTorso> poses;

  HumanResult Score() const { return EvaluateHumans(detections, priors, poses, {}); }
};

Eigen::Vector3d TorsoOf(int human, int stamp) { return {0.1 * stamp, 2.0 * human, 1.0}; }

Scene PerfectScene() {
  Scene scene;
  for (int stamp = 0; stamp < kStamps; ++stamp) {
    for (int human = 0; human < 2; ++human) {
      const Eigen::Vector3d torso = TorsoOf(human, stamp);
      const Eigen::Vector3d detected = torso + Eigen::Vector3d(human == 0 ? 0.5 : 0.3, 0, 0);
      const TimeNs time_ns = stamp * 200'000'000ll;
      scene.detections.push_back({time_ns, human, 0.9, torso, detected});
      scene.priors.push_back({time_ns, human, detected, detected});
      scene.poses.push_back({time_ns, human, torso});
    }
  }
  return scene;
}

TEST(HumanMetric, IsPerfectForPerfectTracks) {
  const HumanResult result = PerfectScene().Score();
  EXPECT_NEAR(*result.raw_m, 0.4, 1e-12);
  EXPECT_NEAR(*result.filtered_m, 0.4, 1e-12);
  EXPECT_NEAR(*result.tracked_m, 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(*result.idf1, 1.0);
  EXPECT_DOUBLE_EQ(*result.mota, 1.0);
  EXPECT_EQ(result.id_switch_count, 0);
  EXPECT_DOUBLE_EQ(*result.tracks_per_human, 1.0);
  EXPECT_EQ(result.human_of_track, (std::map<int, int>{{0, 0}, {1, 1}}));
}

TEST(HumanMetric, MeansOverHumansNotOverPoses) {
  Scene scene = PerfectScene();
  // Person 1 is seen once, 3 m off, by the tracker; person 0 always, 0 m off.
  std::erase_if(scene.poses, [](const auto& pose) { return pose.track == 1 && pose.time_ns > 0; });
  for (auto& pose : scene.poses) pose.torso_map.z() += pose.track == 1 ? 3.0 : 0.0;
  EXPECT_NEAR(*scene.Score().tracked_m, 1.5, 1e-12);
}

TEST(HumanMetric, LetsSwappedTracksHurt) {
  Scene scene = PerfectScene();
  // From half time on, each track takes the other's detections and stays with its old person.
  for (auto& prior : scene.priors) {
    if (prior.time_ns >= kStamps / 2 * 200'000'000ll) prior.track = 1 - prior.track;
  }
  HumanResult result = scene.Score();
  EXPECT_NEAR(*result.tracked_m, 1.0, 1e-12);
  EXPECT_DOUBLE_EQ(*result.idf1, 0.5);
  EXPECT_EQ(result.id_switch_count, 2);
  EXPECT_DOUBLE_EQ(*result.mota, 1.0 - 2.0 / 40.0);
  EXPECT_DOUBLE_EQ(*result.tracks_per_human, 2.0);
}

TEST(HumanMetric, LetsFragmentsHurtIdf1) {
  Scene scene = PerfectScene();
  const auto fragment = [](int track, TimeNs time_ns) {
    return track * 100 + static_cast<int>(time_ns / 1'000'000'000);
  };
  for (auto& prior : scene.priors) prior.track = fragment(prior.track, prior.time_ns);
  for (auto& pose : scene.poses) pose.track = fragment(pose.track, pose.time_ns);
  const HumanResult result = scene.Score();
  EXPECT_NEAR(*result.tracked_m, 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(*result.idf1, 0.25);
  EXPECT_EQ(result.id_switch_count, 6);
}

TEST(HumanMetric, CountsPosesThatNoDetectionExplains) {
  Scene scene = PerfectScene();
  for (int stamp = 0; stamp < kStamps; ++stamp) {
    scene.poses.push_back({stamp * 200'000'000ll, 7, {50, 50, 1}});
  }
  const HumanResult result = scene.Score();
  EXPECT_EQ(result.unexplained_pose_count, kStamps);
  EXPECT_NEAR(*result.tracked_m, 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(*result.idf1, 80.0 / 100.0);
  EXPECT_DOUBLE_EQ(*result.mota, 0.5);
}

TEST(HumanMetric, AsksOnlyForPeopleWhoCouldBeSeen) {
  Scene scene = PerfectScene();
  for (auto& detection : scene.detections) {
    if (detection.human == 1) detection.visibility = 0.05;
  }
  std::erase_if(scene.poses, [](const auto& pose) { return pose.track == 1; });
  EXPECT_DOUBLE_EQ(*scene.Score().idf1, 1.0);
  // Nor is it wrong to track them.
  scene = PerfectScene();
  for (auto& detection : scene.detections) {
    if (detection.human == 1) detection.visibility = 0.05;
  }
  EXPECT_DOUBLE_EQ(*scene.Score().idf1, 1.0);
}

TEST(HumanMetric, MatchesByWhereTheDetectionWasWithoutTheRobotsDrift) {
  Scene scene = PerfectScene();
  for (auto& prior : scene.priors) prior.torso_map.y() += 2.0;
  for (auto& pose : scene.poses) pose.torso_map.y() += 2.0;
  const HumanResult result = scene.Score();
  EXPECT_NEAR(*result.tracked_m, 2.0, 1e-12);
  EXPECT_DOUBLE_EQ(*result.idf1, 1.0);
}

TEST(HumanMetric, TakesADetectionOfNobodyForAFalsePose) {
  Scene scene = PerfectScene();
  for (auto& detection : scene.detections) {
    if (detection.human == 1) detection.human = -1;
  }
  const HumanResult result = scene.Score();
  EXPECT_NEAR(*result.raw_m, 0.5, 1e-12);
  EXPECT_EQ(result.unexplained_pose_count, kStamps);
  EXPECT_NEAR(*result.idf1, 40.0 / 60.0, 1e-12);
}

TEST(HumanMetric, IsEmptyWithoutATracker) {
  Scene scene = PerfectScene();
  scene.priors.clear();
  scene.poses.clear();
  const HumanResult result = scene.Score();
  EXPECT_NEAR(*result.raw_m, 0.4, 1e-12);
  EXPECT_FALSE(result.filtered_m.has_value());
  EXPECT_FALSE(result.tracked_m.has_value());
  EXPECT_FALSE(result.idf1.has_value());
}

}  // namespace
}  // namespace dsg::evaluation
