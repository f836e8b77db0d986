// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/person_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/unit/ingest/agents/tracking/people_util.h"

namespace dsg::ingest {
namespace {

constexpr double kSeenSigmaM = 0.1;

struct Walker {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  ShapeVector shape = ShapeVector::Zero();
  /// Seconds of absence.
  double gone_s = 0.0;
  double back_s = 0.0;
};

void AddFalse(double t_s, Random* random, PeopleLog* log) {
  const Eigen::Vector3d at(random->Uniform(-8.0, 8.0), random->Uniform(-8.0, 8.0), 0.95);
  AddDetection(AtS(t_s), -1, at, ObservationAt(at, kSeenSigmaM), log);
}

// 5 Hz; people without a shape of their own (all zero) have none.
PeopleLog Walk(const std::vector<Walker>& walkers, double from_s, double to_s, Random* random) {
  PeopleLog log;
  for (double t_s = from_s; t_s < to_s - 1e-6; t_s += 0.2) {
    log.images[AtS(t_s)];
    for (size_t i = 0; i < walkers.size(); ++i) {
      const Walker& walker = walkers[i];
      if (t_s >= walker.gone_s && t_s < walker.back_s) continue;
      const Eigen::Vector3d torso = walker.from + t_s * walker.velocity;
      const Eigen::Vector3d noise(kSeenSigmaM * random->Normal(), kSeenSigmaM * random->Normal(),
                                  0.0);
      PersonObservation observation = ObservationAt(torso + noise, kSeenSigmaM);
      if (!walker.shape.isZero()) {
        observation.shape_coefficients = NoisyShape(walker.shape, 0.4, random);
      }
      AddDetection(AtS(t_s), static_cast<int>(i), torso, std::move(observation), &log);
    }
  }
  return log;
}

TEST(PersonTracker, FollowsPeopleWhoCross) {
  constexpr uint64_t kSeed = 1;
  Random random(kSeed, 0);
  const PeopleLog log = Walk({{{-4.0, 0.0, 0.95}, {1.0, 0.0, 0.0}},
                              {{4.0, 0.7, 0.95}, {-1.0, 0.0, 0.0}},
                              {{0.0, -6.0, 0.95}, {0.0, 1.0, 0.0}}},
                             0.0, 8.0, &random);
  const evaluation::HumanResult result = TrackAndScore(log, {});
  EXPECT_DOUBLE_EQ(*result.idf1, 1.0) << "seed " << kSeed;
  EXPECT_EQ(result.id_switch_count, 0);
  EXPECT_LT(*result.tracked_m, *result.raw_m);
}

TEST(PersonTracker, CoastsThroughAnOcclusion) {
  Random random(2, 0);
  const PeopleLog log = Walk({{{0.0, 0.0, 0.95}, {1.0, 0.0, 0.0}, ShapeVector::Zero(), 4.0, 5.2}},
                             0.0, 10.0, &random);
  PersonTracker tracker({});
  const std::vector<TrackChange> changes = RunAll(log, &tracker);
  EXPECT_EQ(ConfirmedTracks(changes).size(), 1u);
  // Nothing is made up meanwhile.
  EXPECT_EQ(tracker.track(1).observations.size(), log.truth.size());
  const auto is_lost = [](const TrackChange& change) { return change.state == TrackState::kLost; };
  EXPECT_EQ(std::count_if(changes.begin(), changes.end(), is_lost), 1);
}

TEST(PersonTracker, IsToldFromTheFirstObservationOnWhenConfirmed) {
  Random random(3, 0);
  const PeopleLog log = Walk({{{0.0, 0.0, 0.95}, {0.5, 0.0, 0.0}}}, 0.0, 1.0, &random);
  PersonTracker tracker({});
  int image = 0;
  for (const auto& [time_ns, observations] : log.images) {
    ASSERT_TRUE(tracker.Observe(time_ns, observations));
    const std::vector<TrackChange> changes = tracker.TakeChanges();
    ++image;
    if (image < 3) {
      EXPECT_TRUE(changes.empty());
      continue;
    }
    ASSERT_EQ(changes.size(), 1u);
    EXPECT_EQ(changes[0].state, TrackState::kConfirmed);
    EXPECT_EQ(changes[0].first_observation, image == 3 ? 0u : static_cast<size_t>(image) - 1);
    EXPECT_LE(changes[0].first_estimate, changes[0].first_observation);
  }
  EXPECT_TRUE(tracker.TakeChanges().empty());
}

TEST(PersonTracker, GoesThroughItsStates) {
  Random random(4, 0);
  const PeopleLog log = Walk({{{0.0, 0.0, 0.95}, Eigen::Vector3d::Zero()}}, 0.0, 1.0, &random);
  PersonTracker tracker({});
  for (const auto& [time_ns, observations] : log.images) tracker.Observe(time_ns, observations);
  tracker.TakeChanges();
  const auto state_at = [&](double t_s) {
    EXPECT_TRUE(tracker.Observe(AtS(t_s), {}));
    const std::vector<TrackChange> changes = tracker.TakeChanges();
    return changes.empty() ? std::string_view("nothing") : ToString(changes.front().state);
  };
  EXPECT_EQ(state_at(1.7), "nothing");
  EXPECT_EQ(state_at(1.9), "lost");
  EXPECT_EQ(state_at(5.7), "nothing");
  EXPECT_EQ(state_at(5.9), "closed");
  EXPECT_EQ(state_at(6.1), "nothing");
  tracker.Finish();
  EXPECT_TRUE(tracker.TakeChanges().empty());
}

TEST(PersonTracker, DropsFalseTracksAndKeepsTheirEvidence) {
  PersonTracker tracker({});
  tracker.Observe(AtS(0.0), {ObservationAt({1.0, 2.0, 0.95}, kSeenSigmaM)});
  EXPECT_TRUE(tracker.TakeChanges().empty());
  tracker.Observe(AtS(2.0), {});
  const std::vector<TrackChange> changes = tracker.TakeChanges();
  ASSERT_EQ(changes.size(), 1u);
  EXPECT_EQ(changes[0].state, TrackState::kDropped);
  EXPECT_EQ(changes[0].first_observation, 0u);
  EXPECT_EQ(tracker.track(changes[0].track).observations.size(), 1u);
  EXPECT_EQ(tracker.counts().dropped_track_count, 1);
  EXPECT_EQ(tracker.counts().track_count, 0);
  tracker.Finish();
  EXPECT_TRUE(tracker.TakeChanges().empty());
}

TEST(PersonTracker, RandomFalseDetectionsRarelyBecomePeople) {
  constexpr uint64_t kSeed = 5;
  Random random(kSeed, 0);
  PeopleLog log = Walk({{{0.0, 0.0, 0.95}, {0.3, 0.0, 0.0}}}, 0.0, 30.0, &random);
  for (double t_s = 0.0; t_s < 30.0; t_s += 0.2) {
    if (random.Chance(0.3)) AddFalse(t_s, &random, &log);
  }
  const evaluation::HumanResult result = TrackAndScore(log, {});
  EXPECT_GT(*result.idf1, 0.97) << "seed " << kSeed;
}

TEST(PersonTracker, RefusesImagesOutOfOrder) {
  PersonTracker tracker({});
  const PersonObservation observation = ObservationAt({0.0, 0.0, 0.95}, kSeenSigmaM);
  EXPECT_TRUE(tracker.Observe(AtS(1.0), {observation}));
  EXPECT_FALSE(tracker.Observe(AtS(0.8), {observation}));
  EXPECT_EQ(tracker.counts().refused_image_count, 1);
  EXPECT_EQ(tracker.counts().observation_count, 1);
  EXPECT_TRUE(tracker.Observe(AtS(1.2), {observation}));
}

TEST(PersonTracker, SurvivesNumbersThatAreNone) {
  PersonTracker tracker({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  PersonObservation broken = ObservationAt({0.0, nan, 0.95}, kSeenSigmaM);
  PersonObservation flat = ObservationAt({0.0, 0.0, 0.95}, 0.0);
  PersonObservation limp = ObservationAt({0.0, 0.0, 0.95}, kSeenSigmaM);
  limp.has_joints = true;
  for (Eigen::Vector3d& joint : limp.joints_torso) joint.setZero();
  limp.joints_torso[3].x() = nan;
  // As a lens of absurd focal lengths places people.
  const PersonObservation far = ObservationAt({0.0, 1e12, 0.95}, kSeenSigmaM);
  const PersonObservation vague = ObservationAt({0.0, 0.0, 0.95}, 1e6);
  EXPECT_TRUE(tracker.Observe(AtS(0.0), {broken, flat, limp, far, vague}));
  EXPECT_EQ(tracker.counts().unusable_count, 5);
  tracker.Finish();
  EXPECT_TRUE(tracker.TakeChanges().empty());
}

TEST(PersonTracker, TwoCamerasAtOneStampAreTwoImages) {
  PersonTracker tracker({});
  for (int i = 0; i < 4; ++i) {
    const double t_s = 0.2 * i;
    EXPECT_TRUE(tracker.Observe(AtS(t_s), {ObservationAt({0.0, 0.0, 0.95}, kSeenSigmaM)}));
    EXPECT_TRUE(tracker.Observe(AtS(t_s), {ObservationAt({3.5, 0.0, 0.95}, kSeenSigmaM)}));
  }
  EXPECT_EQ(tracker.counts().track_count, 2);
}

class FoundAgain : public testing::Test {
 protected:
  // Somebody for 3 s, and somebody (else) after a gap.
  TrackerCounts Leave(const ShapeVector& first, const ShapeVector& second, double gap_s) {
    PeopleLog log = Walk({{{0.0, 0.0, 0.95}, {0.5, 0.0, 0.0}, first}}, 0.0, 3.0, &random_);
    const PeopleLog later =
        Walk({{{4.0, 3.0, 0.95}, {0.0, 0.0, 0.0}, second}}, 3.0 + gap_s, 5.0 + gap_s, &random_);
    for (const auto& image : later.images) log.images.insert(image);
    PersonTracker tracker({});
    tracks_ = ConfirmedTracks(RunAll(log, &tracker));
    return tracker.counts();
  }

  Random random_{31, 0};
  std::vector<int64_t> tracks_;
};

TEST_F(FoundAgain, ByTheRightShape) {
  const ShapeVector shape = DrawShape(&random_);
  const TrackerCounts counts = Leave(shape, shape, 20.0);
  EXPECT_EQ(tracks_.size(), 1u);
  EXPECT_GE(counts.found_again_count, 1);
}

TEST_F(FoundAgain, NotByAWrongShape) {
  const TrackerCounts counts = Leave(DrawShape(&random_), DrawShape(&random_), 20.0);
  EXPECT_EQ(tracks_.size(), 2u);
  EXPECT_EQ(counts.found_again_count, 0);
  EXPECT_EQ(counts.same_as_count, 0);
}

TEST_F(FoundAgain, NotWithoutShapes) {
  Leave(ShapeVector::Zero(), ShapeVector::Zero(), 20.0);
  EXPECT_EQ(tracks_.size(), 2u);
}

TEST(PersonTracker, LinksTheUnsureAndMergesTheSure) {
  TrackerOptions options;
  options.again_probability_min = 1.1;
  options.again_at_once_probability_min = 1.1;
  Random random(8, 0);
  const ShapeVector shape = DrawShape(&random);
  const PeopleLog log =
      Walk({{{0.0, 0.0, 0.95}, Eigen::Vector3d::Zero(), shape, 3.0, 20.0}}, 0.0, 23.0, &random);
  PersonTracker tracker(options);
  const std::vector<int64_t> tracks = ConfirmedTracks(RunAll(log, &tracker));
  ASSERT_EQ(tracks.size(), 2u);
  const PersonTracker::Track& second = tracker.track(tracks[1]);
  ASSERT_EQ(second.same_as.size(), 1u);
  EXPECT_EQ(second.same_as[0].earlier_track, tracks[0]);
  EXPECT_GT(second.same_as[0].probability, 0.99);
  EXPECT_EQ(tracker.counts().same_as_count, 1);
}

TEST(PersonTracker, AReopenedTrackIsToldOnlyWhatIsNew) {
  Random random(9, 0);
  const ShapeVector shape = DrawShape(&random);
  const PeopleLog log =
      Walk({{{0.0, 0.0, 0.95}, Eigen::Vector3d::Zero(), shape, 2.0, 30.0}}, 0.0, 31.0, &random);
  PersonTracker tracker({});
  std::vector<TrackState> states;
  size_t told_count = 0;
  for (const TrackChange& change : RunAll(log, &tracker)) {
    if (change.track != 1) continue;
    if (states.empty() || states.back() != change.state) states.push_back(change.state);
    EXPECT_LE(change.first_observation, log.truth.size());
    EXPECT_GE(change.first_observation, told_count);
    told_count = change.first_observation;
  }
  EXPECT_EQ(states,
            (std::vector<TrackState>{TrackState::kConfirmed, TrackState::kLost, TrackState::kClosed,
                                     TrackState::kConfirmed, TrackState::kClosed}));
}

TEST(PersonTracker, WeakObservationsCarryOnButOpenNothing) {
  PersonTracker tracker({});
  PersonObservation weak = ObservationAt({0.0, 0.0, 0.95}, kSeenSigmaM);
  weak.is_weak = true;
  tracker.Observe(AtS(0.0), {weak});
  EXPECT_EQ(tracker.counts().weak_unused_count, 1);
  PersonObservation strong = weak;
  strong.is_weak = false;
  tracker.Observe(AtS(0.2), {strong});
  tracker.Observe(AtS(0.4), {weak});
  tracker.Observe(AtS(0.6), {weak});
  EXPECT_EQ(tracker.counts().track_count, 1);
  EXPECT_EQ(tracker.track(1).observations.size(), 3u);
}

TEST(PersonTracker, ASecondBoxOpensNoSecondTrack) {
  Random random(10, 0);
  const ShapeVector shape = DrawShape(&random);
  PeopleLog log = Walk({{{0.0, 0.0, 0.95}, {0.5, 0.0, 0.0}, shape}}, 0.0, 6.0, &random);
  for (auto& [time_ns, image] : log.images) {
    PersonObservation second = image.front();
    second.detection_id += 1000;
    second.map_T_torso.position.y() += 0.2;
    second.shape_coefficients = NoisyShape(shape, 0.4, &random);
    image.push_back(second);
  }
  PersonTracker tracker({});
  EXPECT_EQ(ConfirmedTracks(RunAll(log, &tracker)).size(), 1u);
  EXPECT_GT(tracker.counts().duplicate_count, 25);
}

TEST(PersonTracker, TheOrderWithinAnImageDoesNotMatter) {
  constexpr uint64_t kSeed = 12;
  Random random(kSeed, 0);
  std::vector<Walker> walkers;
  for (int i = 0; i < 8; ++i) {
    walkers.push_back({{random.Uniform(-4.0, 4.0), random.Uniform(-4.0, 4.0), 0.95},
                       {random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0), 0.0},
                       DrawShape(&random)});
  }
  PeopleLog log = Walk(walkers, 0.0, 8.0, &random);
  for (double t_s = 0.0; t_s < 8.0; t_s += 0.2) AddFalse(t_s, &random, &log);
  PersonTracker in_order({});
  const std::vector<TrackChange> expected = RunAll(log, &in_order);
  for (auto& [time_ns, image] : log.images) {
    for (size_t i = image.size(); i > 1; --i) {
      std::swap(image[i - 1], image[static_cast<size_t>(random.Index(static_cast<int>(i)))]);
    }
  }
  PersonTracker shuffled({});
  const std::vector<TrackChange> changes = RunAll(log, &shuffled);
  ASSERT_EQ(changes.size(), expected.size()) << "seed " << kSeed;
  for (size_t i = 0; i < changes.size(); ++i) {
    EXPECT_EQ(changes[i].track, expected[i].track);
    EXPECT_EQ(changes[i].first_estimate, expected[i].first_estimate);
  }
  for (const int64_t id : ConfirmedTracks(expected)) {
    const auto& a = in_order.track(id).graph.estimates();
    const auto& b = shuffled.track(id).graph.estimates();
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].map_T_torso.position, b[i].map_T_torso.position);
    }
  }
}

TEST(PersonTracker, InThePapersModeTheFirstConsistentTrackWins) {
  PersonTracker tracker(PaperTrackerOptions());
  tracker.Observe(AtS(0.0), {ObservationAt({0.0, 0.0, 0.95}, kSeenSigmaM)});
  EXPECT_EQ(tracker.counts().track_count, 1) << "a graph of one node";
  tracker.Observe(AtS(0.2), {ObservationAt({2.9, 0.0, 0.95}, kSeenSigmaM)});
  EXPECT_EQ(tracker.counts().track_count, 1);
  tracker.Observe(AtS(0.4), {ObservationAt({-4.0, 0.0, 0.95}, kSeenSigmaM)});
  EXPECT_EQ(tracker.counts().track_count, 2) << "6.9 m away: another track begins";
  tracker.Observe(AtS(0.6), {ObservationAt({-4.0, 0.0, 0.95}, kSeenSigmaM)});
  EXPECT_EQ(tracker.counts().track_count, 2);
}

// Moving what was seen, and seeing it where it is, are the same; whether a track is open, closed or
// so old that nothing but its estimates is kept.
TEST(PersonTracker, MovesWithThePathThatItWasSeenFrom) {
  Random random(11, 0);
  const PeopleLog log = Walk({{{-2.0, 0.0, 0.95}, {0.5, 0.0, 0.0}, ShapeVector::Zero(), 6.0, 1e9}},
                             0.0, 30.0, &random);
  Pose3d astray;
  astray.position = {0.4, -0.2, 0.0};
  astray.orientation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ());
  PeopleLog moved_log;
  for (const auto& [time_ns, observations] : log.images) {
    std::vector<PersonObservation>& moved = moved_log.images[time_ns];
    for (PersonObservation observation : observations) {
      const Eigen::Matrix3d turn = astray.orientation.toRotationMatrix();
      observation.map_T_torso = astray * observation.map_T_torso;
      observation.position_covariance_map =
          turn * observation.position_covariance_map * turn.transpose();
      observation.camera_map = astray * observation.camera_map;
      moved.push_back(observation);
    }
  }
  TrackerOptions options;
  options.again_ns = 10 * kNsPerSecond;
  PersonTracker right(options);
  RunAll(log, &right);
  for (const double move_s : {3.0, 12.0, 29.0}) {
    PersonTracker tracker(options);
    for (const auto& [time_ns, observations] : moved_log.images) {
      // From then on seen right.
      const bool is_before = time_ns <= AtS(move_s);
      tracker.Observe(time_ns, is_before ? observations : log.images.at(time_ns));
      tracker.TakeChanges();
      if (time_ns != AtS(move_s)) continue;
      tracker.Move(TrajectoryChange({time_ns}, {astray.Inverse()}));
      EXPECT_EQ(tracker.TakeChanges().size(), 1u) << move_s;
    }
    tracker.Finish();
    const std::vector<TorsoEstimate>& estimates = tracker.track(1).graph.estimates();
    const std::vector<TorsoEstimate>& expected = right.track(1).graph.estimates();
    ASSERT_EQ(estimates.size(), expected.size()) << move_s;
    for (size_t i = 0; i < expected.size(); ++i) {
      const Eigen::Vector3d apart =
          estimates[i].map_T_torso.position - expected[i].map_T_torso.position;
      EXPECT_LT(apart.norm(), 0.05) << move_s << " " << i;
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
