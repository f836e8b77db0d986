// SPDX-License-Identifier: Apache-2.0
// Trajectories and stays: appended, corrected, asked at instants and in boxes.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <tuple>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "schema/codec/trajectory_codec.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr NodeId kBob('H', 2);
constexpr NodeId kRoom('R', 1);
constexpr NodeId kPlace('p', 1);

// A map with two people, a room and a place.
class Tracks {
 public:
  explicit Tracks(const std::string& backend, TrajectoryCodec codec = TrajectoryCodec::kLossless)
      : map_(backend, Spec(codec)) {
    GraphDelta delta = DeltaOfNodes({MakeHuman(1, "ann"), MakeHuman(2, "bob")});
    delta.nodes.push_back(MakeNode(kRoom, layers::kRooms, kinds::kRoom, "lab", Box3d()));
    delta.nodes.push_back(MakeNode(kPlace, layers::kPlaces, kinds::kPlace, "", Box3d()));
    map_.MustCommit(delta);
  }
  TestMap& map() { return map_; }
  Revision Append(NodeId agent, std::vector<TimedPose> poses) {
    return map_.MustCommit(DeltaOfPoses(agent, std::move(poses)));
  }
  absl::StatusOr<CommitResult> Correct(NodeId agent, TimeNs from_ns, TimeNs to_ns,
                                       std::vector<TimedPose> poses) {
    GraphDelta delta;
    delta.corrections.push_back({agent, from_ns, to_ns, std::move(poses)});
    return map_.Commit(std::move(delta));
  }
  Revision AddStays(std::vector<Stay> stays) {
    GraphDelta delta;
    delta.stays = std::move(stays);
    return map_.MustCommit(std::move(delta));
  }

 private:
  TestMap map_;
};

std::vector<TimedPose> Read(const Snapshot& snapshot, NodeId agent, TimeNs from_ns = kTimeMin,
                            TimeNs to_ns = kTimeMax) {
  std::vector<TimedPose> poses;
  const absl::Status read =
      snapshot.ReadPoses(agent, from_ns, to_ns, {}, [&](const TimedPose& pose) {
        poses.push_back(pose);
        return true;
      });
  EXPECT_TRUE(read.ok()) << read;
  return poses;
}

std::vector<TimeNs> Times(const Snapshot& snapshot, NodeId agent) {
  std::vector<TimeNs> times;
  for (const TimedPose& pose : Read(snapshot, agent)) times.push_back(pose.time_ns);
  return times;
}

// A walk with jitter in time, place and heading; every seventh step is long.
std::vector<TimedPose> RandomWalk(std::mt19937_64* random, int count, TimeNs begin_ns,
                                  TimeNs step_ns) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(*random);
  };
  std::vector<TimedPose> poses;
  TimeNs time_ns = begin_ns;
  Eigen::Vector3d at(uniform(0, 20), uniform(0, 20), 1.0);
  for (int i = 0; i < count; ++i) {
    time_ns += step_ns / 2 + static_cast<TimeNs>((*random)() % static_cast<uint64_t>(step_ns));
    at += Eigen::Vector3d(uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-0.02, 0.02));
    TimedPose pose = PoseAt(time_ns, at.x(), at.y(), at.z());
    pose.map_T_agent.orientation =
        Eigen::Quaterniond(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1))
            .normalized();
    pose.flags = static_cast<uint32_t>((*random)() % 8);
    poses.push_back(pose);
  }
  return poses;
}

class LosslessTrack : public OnEveryBackend {};
class QuantizedTrack : public OnEveryBackend {};
class Track : public OnEveryBackend {};
class Locate : public OnEveryBackend {};
class Covariance : public OnEveryBackend {};
class Correction : public OnEveryBackend {};
class VisitsToBox : public OnEveryBackend {};
class ObservedAgents : public OnEveryBackend {};
class Stays : public OnEveryBackend {};
DSG_ON_EVERY_BACKEND(LosslessTrack);
DSG_ON_EVERY_BACKEND(QuantizedTrack);
DSG_ON_EVERY_BACKEND(Track);
DSG_ON_EVERY_BACKEND(Locate);
DSG_ON_EVERY_BACKEND(Covariance);
DSG_ON_EVERY_BACKEND(Correction);
DSG_ON_EVERY_BACKEND(VisitsToBox);
DSG_ON_EVERY_BACKEND(ObservedAgents);
DSG_ON_EVERY_BACKEND(Stays);

TEST_P(LosslessTrack, GivesBackEveryBit) {
  Tracks tracks(GetParam(), TrajectoryCodec::kLossless);
  std::mt19937_64 random(RecordSeed());
  const auto poses = RandomWalk(&random, 1000, -500 * kSecond, kSecond);
  tracks.Append(kAnn, poses);
  const auto kept = Read(*tracks.map().Latest(), kAnn);
  ASSERT_EQ(kept.size(), poses.size());
  for (size_t i = 0; i < poses.size(); ++i) {
    ASSERT_EQ(kept[i].time_ns, poses[i].time_ns);
    ASSERT_EQ(kept[i].flags, poses[i].flags);
    ASSERT_EQ(kept[i].map_T_agent.position, poses[i].map_T_agent.position);
    ASSERT_EQ(kept[i].map_T_agent.orientation.coeffs(), poses[i].map_T_agent.orientation.coeffs());
  }
  EXPECT_EQ(tracks.map().Problems(), "");
}

TEST_P(QuantizedTrack, KeepsTimesExactlyAndPosesWithinTheBound) {
  Tracks tracks(GetParam(), TrajectoryCodec::kQuantized);
  std::mt19937_64 random(RecordSeed());
  const auto poses = RandomWalk(&random, 3000, 0, kSecond / 7);
  tracks.Append(kAnn, poses);
  const auto kept = Read(*tracks.map().Latest(), kAnn);
  ASSERT_EQ(kept.size(), poses.size());
  for (size_t i = 0; i < poses.size(); ++i) {
    ASSERT_EQ(kept[i].time_ns, poses[i].time_ns);
    ASSERT_EQ(kept[i].flags, poses[i].flags);
    ASSERT_LE((kept[i].map_T_agent.position - poses[i].map_T_agent.position).cwiseAbs().maxCoeff(),
              0.5 * kPositionStepM + 1e-12);
    ASSERT_LE(AngleBetween(kept[i].map_T_agent.orientation, poses[i].map_T_agent.orientation),
              6e-5);
  }
}

TEST_P(Track, IsTheSameHoweverItIsCutIntoCommits) {
  std::mt19937_64 random(RecordSeed());
  for (const auto codec : {TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless}) {
    const auto poses = RandomWalk(&random, 900, 0, kSecond);
    Tracks whole(GetParam(), codec);
    whole.Append(kAnn, poses);
    Tracks cut(GetParam(), codec);
    for (size_t i = 0; i < poses.size();) {
      const size_t n = std::min(poses.size() - i, size_t{1} + random() % 60);
      cut.Append(kAnn, {poses.begin() + static_cast<std::ptrdiff_t>(i),
                        poses.begin() + static_cast<std::ptrdiff_t>(i + n)});
      i += n;
      if (random() % 4 == 0) {
        cut.map().Close();
        cut.map().Reopen();
      }
    }
    const auto a = Read(*whole.map().Latest(), kAnn);
    const auto b = Read(*cut.map().Latest(), kAnn);
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(a[i].time_ns, b[i].time_ns);
      ASSERT_EQ(a[i].map_T_agent.position, b[i].map_T_agent.position);
    }
    EXPECT_EQ(cut.map().Problems(), "");
  }
}

TEST_P(Track, AtAPastRevisionEndsWhereItEndedThen) {
  Tracks tracks(GetParam());
  std::vector<Revision> revisions;
  for (int i = 0; i < 50; ++i) {
    revisions.push_back(tracks.Append(kAnn, {PoseAt(i * kSecond, i, 0, 0)}));
  }
  for (int i = 0; i < 50; ++i) {
    const auto then = tracks.map().At(revisions[static_cast<size_t>(i)]);
    EXPECT_EQ(Times(*then, kAnn).size(), static_cast<size_t>(i + 1));
    const TrackInfo track = OrDie(then->GetTrack(kAnn));
    EXPECT_EQ(track.pose_count, i + 1);
    EXPECT_EQ(track.first_ns, 0);
    EXPECT_EQ(track.last_ns, i * kSecond);
    EXPECT_EQ(ReasonOf(then->Locate(kAnn, i * kSecond + 1).status()), Reason::kTimeOutsideTrack);
  }
}

TEST_P(Track, IsReadBetweenHalfOpenEnds) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0), PoseAt(10, 1, 0, 0), PoseAt(20, 2, 0, 0)});
  const auto snapshot = tracks.map().Latest();
  EXPECT_EQ(Read(*snapshot, kAnn, 0, 20).size(), 2u);
  EXPECT_EQ(Read(*snapshot, kAnn, 1, 21).size(), 2u);
  EXPECT_EQ(Read(*snapshot, kAnn, 10, 10).size(), 0u);
  EXPECT_EQ(Read(*snapshot, kAnn, 21, kTimeMax).size(), 0u);
}

TEST_P(Track, OfAnUnknownAgentOrOfAThingIsRefused) {
  Tracks tracks(GetParam());
  tracks.map().MustCommit(DeltaOfNodes({MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1))}));
  const auto snapshot = tracks.map().Latest();
  for (const NodeId id : {NodeId('H', 99), NodeId('O', 1)}) {
    EXPECT_EQ(ReasonOf(snapshot->GetTrack(id).status()), Reason::kAgentUnknown);
    EXPECT_EQ(ReasonOf(snapshot->Locate(id, 0).status()), Reason::kAgentUnknown);
  }
}

TEST_P(Track, RefusesTimesTooFarFromTheEpoch) {
  Tracks tracks(GetParam());
  const TimeNs century_ns = 100LL * 365 * 86400 * kSecond;
  for (const TimeNs time_ns : {century_ns, -century_ns, kTimeMax, kTimeMin + 1}) {
    const auto refused = tracks.map().Commit(DeltaOfPoses(kAnn, {PoseAt(time_ns, 0, 0, 0)}));
    EXPECT_EQ(ReasonOf(refused.status()), Reason::kTimeOutsideMap) << time_ns;
  }
  EXPECT_EQ(Times(*tracks.map().Latest(), kAnn).size(), 0u);
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0)});
  EXPECT_EQ(tracks.map().Problems(), "");
}

TEST_P(Track, OfDecadesIsFoundInTimeAndPlace) {
  Tracks tracks(GetParam());
  constexpr TimeNs kYearNs = 365LL * 86400 * kSecond;
  // Steps of nine years: a pose further from all others is taken for a wrong clock.
  for (int year = -54; year <= 54; year += 9) {
    const TimeNs begin_ns = year * kYearNs;
    tracks.Append(kAnn, {PoseAt(begin_ns, year, 0, 1), PoseAt(begin_ns + kSecond, year + 1, 0, 1)});
  }
  const auto snapshot = tracks.map().Latest();
  for (int year = -54; year <= 54; year += 9) {
    const TimeNs at_ns = year * kYearNs + kSecond / 2;
    EXPECT_NEAR(OrDie(snapshot->Locate(kAnn, at_ns)).map_T_agent.position.x(), year + 0.5, 1e-3);
    const Box3d around = BoxOf(year - 0.5, -1, 0, year + 1.5, 1, 2);
    const auto visits = OrDie(snapshot->VisitsToBox(around, at_ns - 1, at_ns + 1, {}));
    ASSERT_EQ(visits.size(), 1u) << year;
    EXPECT_EQ(visits[0].enter_ns, at_ns - 1);
    EXPECT_EQ(visits[0].exit_ns, at_ns + 1);
  }
  ASSERT_TRUE(tracks.Correct(kAnn, 40 * kYearNs, 50 * kYearNs, {}).ok());
  EXPECT_EQ(Times(*tracks.map().Latest(), kAnn).size(), 24u);
  EXPECT_EQ(tracks.map().Problems(), "");
}

TEST_P(Locate, IsExactAtPosesAndStraightBetweenThem) {
  Tracks tracks(GetParam());
  TimedPose from = PoseAt(0, 0, 0, 1);
  TimedPose to = PoseAt(2 * kSecond, 4, -2, 1);
  to.map_T_agent.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()));
  tracks.Append(kAnn, {from, to});
  const auto snapshot = tracks.map().Latest();
  const LocatedPose exact = OrDie(snapshot->Locate(kAnn, 2 * kSecond));
  EXPECT_EQ(exact.quality, PoseQuality::kExact);
  EXPECT_EQ(exact.before_ns, 2 * kSecond);
  EXPECT_EQ(exact.after_ns, 2 * kSecond);
  EXPECT_EQ(exact.map_T_agent.position, to.map_T_agent.position);
  const LocatedPose between = OrDie(snapshot->Locate(kAnn, kSecond / 2));
  EXPECT_EQ(between.quality, PoseQuality::kInterpolated);
  EXPECT_EQ(between.before_ns, 0);
  EXPECT_EQ(between.after_ns, 2 * kSecond);
  EXPECT_TRUE(between.map_T_agent.position.isApprox(Eigen::Vector3d(1, -0.5, 1)));
  EXPECT_NEAR(AngleBetween(between.map_T_agent.orientation, Eigen::Quaterniond::Identity()), 0.25,
              1e-12);
}

TEST_P(Locate, SaysGapInsteadOfGuessing) {
  Tracks tracks(GetParam());
  tracks.Append(
      kAnn, {PoseAt(0, 0, 0, 0), PoseAt(2 * kSecond, 1, 0, 0), PoseAt(4 * kSecond + 1, 2, 0, 0)});
  const auto snapshot = tracks.map().Latest();
  EXPECT_EQ(OrDie(snapshot->Locate(kAnn, kSecond)).quality, PoseQuality::kInterpolated);
  const LocatedPose gap = OrDie(snapshot->Locate(kAnn, 3 * kSecond));
  EXPECT_EQ(gap.quality, PoseQuality::kInGap);
  EXPECT_EQ(gap.before_ns, 2 * kSecond);
  EXPECT_EQ(gap.after_ns, 4 * kSecond + 1);
  EXPECT_EQ(OrDie(snapshot->Locate(kAnn, 4 * kSecond + 1)).quality, PoseQuality::kExact);
}

TEST_P(Locate, OutsideTheTrackNamesBothEnds) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(100, 0, 0, 0), PoseAt(200, 1, 0, 0)});
  for (const TimeNs at_ns : {TimeNs{99}, TimeNs{201}, kTimeMin, kTimeMax}) {
    const auto refused = tracks.map().Latest()->Locate(kAnn, at_ns);
    EXPECT_EQ(ReasonOf(refused.status()), Reason::kTimeOutsideTrack);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kOutOfRange);
    EXPECT_EQ(MetadataOf(refused.status())["first_ns"], "100");
    EXPECT_EQ(MetadataOf(refused.status())["last_ns"], "200");
    EXPECT_TRUE(absl::StrContains(refused.status().message(), "ann")) << refused.status();
  }
}

TEST_P(Locate, OfAnAgentWithoutPosesSaysSo) {
  Tracks tracks(GetParam());
  const auto refused = tracks.map().Latest()->Locate(kBob, 0);
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kTimeOutsideTrack);
  EXPECT_TRUE(absl::StrContains(refused.status().message(), "no poses")) << refused.status();
}

TEST_P(Locate, TakesTheAgentsOwnGapLimit) {
  Tracks tracks(GetParam());
  Node patient = MakeHuman(1, "ann");
  patient.agent.emplace().gap_ns_max = 10 * kSecond;
  tracks.map().MustCommit(DeltaOfNodes({patient}));
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0), PoseAt(8 * kSecond, 8, 0, 0)});
  const LocatedPose located = OrDie(tracks.map().Latest()->Locate(kAnn, 2 * kSecond));
  EXPECT_EQ(located.quality, PoseQuality::kInterpolated);
  EXPECT_EQ(located.map_T_agent.position.x(), 2.0);
}

// Poses of one agent spread over many segments and blocks, asked at, before and after each.
TEST_P(Locate, EqualsInterpolationOfAllPosesAtEveryBorder) {
  std::mt19937_64 random(RecordSeed());
  for (const auto codec : {TrajectoryCodec::kLossless, TrajectoryCodec::kQuantized}) {
    Tracks tracks(GetParam(), codec);
    tracks.Append(kAnn, RandomWalk(&random, 1500, 0, 2 * kSecond));
    const auto snapshot = tracks.map().Latest();
    const auto poses = Read(*snapshot, kAnn);
    for (size_t i = 0; i + 1 < poses.size(); ++i) {
      const TimeNs span_ns = poses[i + 1].time_ns - poses[i].time_ns;
      for (const TimeNs offset_ns : {TimeNs{0}, TimeNs{1}, span_ns / 2, span_ns - 1}) {
        const LocatedPose located = OrDie(snapshot->Locate(kAnn, poses[i].time_ns + offset_ns));
        ASSERT_EQ(located.before_ns, poses[i].time_ns);
        if (offset_ns == 0) {
          ASSERT_EQ(located.quality, PoseQuality::kExact);
          ASSERT_EQ(located.map_T_agent.position, poses[i].map_T_agent.position);
          continue;
        }
        ASSERT_EQ(located.after_ns, poses[i + 1].time_ns);
        if (span_ns > 2 * kSecond) {
          ASSERT_EQ(located.quality, PoseQuality::kInGap);
          continue;
        }
        const Pose3d expected =
            Interpolate(poses[i].map_T_agent, poses[i + 1].map_T_agent,
                        static_cast<double>(offset_ns) / static_cast<double>(span_ns));
        ASSERT_EQ(located.quality, PoseQuality::kInterpolated);
        ASSERT_TRUE(located.map_T_agent.position.isApprox(expected.position, 1e-12));
        ASSERT_LE(AngleBetween(located.map_T_agent.orientation, expected.orientation), 1e-9);
      }
    }
  }
}

TEST_P(Covariance, ComesBackOfTheNearerPose) {
  for (const auto codec : {TrajectoryCodec::kLossless, TrajectoryCodec::kQuantized}) {
    Tracks tracks(GetParam(), codec);
    std::vector<TimedPose> poses;
    for (int i = 0; i < 200; ++i) {
      poses.push_back(PoseAt(i * kSecond, i, 0, 0));
      if (i % 3 == 0) continue;
      auto covariance = std::make_shared<Covariance6>();
      for (size_t c = 0; c < covariance->size(); ++c) {
        (*covariance)[c] = static_cast<float>(i) + 0.01f * static_cast<float>(c);
      }
      poses.back().covariance = std::move(covariance);
    }
    tracks.Append(kAnn, poses);
    const auto snapshot = tracks.map().Latest();
    const auto kept = Read(*snapshot, kAnn);
    ASSERT_EQ(kept.size(), poses.size());
    for (size_t i = 0; i < poses.size(); ++i) {
      ASSERT_EQ(kept[i].covariance == nullptr, poses[i].covariance == nullptr) << i;
      if (poses[i].covariance != nullptr) {
        ASSERT_EQ(*kept[i].covariance, *poses[i].covariance) << i;
      }
    }
    EXPECT_EQ(OrDie(snapshot->Locate(kAnn, kSecond * 3 / 4)).covariance->at(0), 1.0f);
    EXPECT_EQ(OrDie(snapshot->Locate(kAnn, kSecond / 4)).covariance, nullptr);
  }
}

TEST_P(Correction, IsNewInItsRevisionAndOldBefore) {
  for (const auto codec : {TrajectoryCodec::kLossless, TrajectoryCodec::kQuantized}) {
    Tracks tracks(GetParam(), codec);
    std::vector<TimedPose> poses;
    for (int i = 0; i < 2000; ++i) poses.push_back(PoseAt(i * kSecond / 10, i, 0, 0));
    const Revision before = tracks.Append(kAnn, poses);
    std::vector<TimedPose> moved(poses.begin() + 700, poses.begin() + 900);
    for (TimedPose& pose : moved) {
      pose.map_T_agent.position.y() = 5.0;
      pose.flags = pose_flags::kCorrected;
    }
    moved.erase(moved.begin() + 50);
    const Revision after =
        OrDie(tracks.Correct(kAnn, poses[700].time_ns, poses[900].time_ns, moved)).revision;
    const Revision later = tracks.Append(kAnn, {PoseAt(200 * kSecond, 0, 0, 9)});
    const auto old_poses = Read(*tracks.map().At(before), kAnn);
    ASSERT_EQ(old_poses.size(), 2000u);
    for (const TimedPose& pose : old_poses) ASSERT_EQ(pose.map_T_agent.position.y(), 0.0);
    for (const Revision revision : {after, later}) {
      const auto snapshot = tracks.map().At(revision);
      const auto now = Read(*snapshot, kAnn);
      ASSERT_EQ(now.size(), revision == after ? 1999u : 2000u);
      for (size_t i = 0; i < 1999; ++i) {
        const size_t source = i < 750 ? i : i + 1;
        const bool is_moved = source >= 700 && source < 900;
        ASSERT_EQ(now[i].time_ns, poses[source].time_ns);
        ASSERT_NEAR(now[i].map_T_agent.position.y(), is_moved ? 5.0 : 0.0, 1e-9);
        ASSERT_EQ(now[i].flags, is_moved ? pose_flags::kCorrected : 0u);
      }
      EXPECT_EQ(OrDie(snapshot->GetTrack(kAnn)).pose_count, static_cast<int64_t>(now.size()));
      EXPECT_NEAR(OrDie(snapshot->Locate(kAnn, poses[800].time_ns)).map_T_agent.position.y(), 5.0,
                  1e-9);
    }
    EXPECT_EQ(
        OrDie(tracks.map().At(before)->Locate(kAnn, poses[800].time_ns)).map_T_agent.position.y(),
        0.0);
    EXPECT_EQ(tracks.map().Problems(), "");
  }
}

TEST_P(Correction, MayEmptyAnIntervalTheTailOrTheTrack) {
  Tracks tracks(GetParam());
  std::vector<TimedPose> poses;
  for (int i = 0; i < 10; ++i) poses.push_back(PoseAt(i, i, 0, 0));
  tracks.Append(kAnn, poses);
  ASSERT_TRUE(tracks.Correct(kAnn, 3, 5, {}).ok());
  EXPECT_EQ(Times(*tracks.map().Latest(), kAnn), (std::vector<TimeNs>{0, 1, 2, 5, 6, 7, 8, 9}));
  ASSERT_TRUE(tracks.Correct(kAnn, 7, kTimeMax, {}).ok());
  EXPECT_EQ(OrDie(tracks.map().Latest()->GetTrack(kAnn)).last_ns, 6);
  ASSERT_TRUE(tracks.Correct(kAnn, kTimeMin, kTimeMax, {}).ok());
  EXPECT_EQ(OrDie(tracks.map().Latest()->GetTrack(kAnn)).pose_count, 0);
  EXPECT_EQ(OrDie(tracks.map().Latest()->Stats()).first_pose_ns, std::nullopt);
  tracks.Append(kAnn, {PoseAt(4, 0, 0, 0)});
  EXPECT_EQ(Times(*tracks.map().Latest(), kAnn), std::vector<TimeNs>{4});
  EXPECT_EQ(tracks.map().Problems(), "");
  EXPECT_EQ(Times(*tracks.map().At(2), kAnn).size(), 10u);
}

// A gap keeps the correction away from the first poses, which a backend may go on appending to.
TEST_P(Correction, ThatTookTheEndKeepsWhatIsAppendedThenOutOfThePast) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0), PoseAt(kSecond, 1, 0, 0)});
  const Revision whole = tracks.Append(kAnn, {PoseAt(10 * kSecond, 10, 0, 0)});
  const Revision cut = OrDie(tracks.Correct(kAnn, 9 * kSecond, kTimeMax, {})).revision;
  const Revision longer = tracks.Append(kAnn, {PoseAt(2 * kSecond, 2, 0, 0)});
  EXPECT_EQ(Times(*tracks.map().At(whole), kAnn), (std::vector<TimeNs>{0, kSecond, 10 * kSecond}));
  EXPECT_EQ(Times(*tracks.map().At(cut), kAnn), (std::vector<TimeNs>{0, kSecond}));
  EXPECT_EQ(Times(*tracks.map().At(longer), kAnn), (std::vector<TimeNs>{0, kSecond, 2 * kSecond}));
  EXPECT_EQ(tracks.map().Problems(), "");
}

// Of the ended segment only the tag shows some poses; a pose that was appended after the tag is
// still in it, and no mark reaches it any more.
TEST_P(Correction, ThatTookTheEndIsSoundWhenCompactedBesideATag) {
  Tracks tracks(GetParam());
  const Revision tagged = tracks.Append(kAnn, {PoseAt(0, 0, 0, 0), PoseAt(kSecond, 1, 0, 0)});
  tracks.Append(kAnn, {PoseAt(2 * kSecond, 2, 0, 0)});
  OrDie(tracks.Correct(kAnn, kSecond, kTimeMax, {}));
  tracks.Append(kBob, {PoseAt(0, 0, 0, 0)});
  const Revision newest = tracks.Append(kBob, {PoseAt(kSecond, 0, 0, 0)});
  OrDie(tracks.map().writer().SetTag("whole", tagged, ""));
  OrDie(tracks.map().writer().Compact(newest, {}, {}));
  EXPECT_EQ(tracks.map().Problems(), "");
  const TrackSpan span{kAnn, kSecond, kTimeMax};
  const absl::Status erased = tracks.map().writer().Erase({.tracks = {span}}, {}, {}).status();
  EXPECT_TRUE(erased.ok()) << erased;
  tracks.map().Close();
  tracks.map().Reopen();
  EXPECT_EQ(tracks.map().Problems(), "");
  EXPECT_EQ(Times(*tracks.map().At(tagged), kAnn), (std::vector<TimeNs>{0}));
  EXPECT_EQ(Times(*tracks.map().At(newest), kAnn), (std::vector<TimeNs>{0}));
}

TEST_P(Correction, BesideAnAppendOfTheSameDeltaAppliesFirst) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0), PoseAt(10, 1, 0, 0)});
  GraphDelta delta;
  delta.corrections.push_back({kAnn, 5, 15, {PoseAt(9, 7, 0, 0)}});
  delta.appends.push_back({kAnn, {PoseAt(20, 2, 0, 0)}});
  tracks.map().MustCommit(delta);
  EXPECT_EQ(Times(*tracks.map().Latest(), kAnn), (std::vector<TimeNs>{0, 9, 20}));
  EXPECT_EQ(tracks.map().Problems(), "");
}

TEST_P(Correction, AfterTheTracksEndOrOfAnEmptyTrackIsRefused) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0)});
  EXPECT_EQ(ReasonOf(tracks.Correct(kAnn, 0, 100, {PoseAt(50, 0, 0, 0)}).status()),
            Reason::kDeltaInvalid);
  EXPECT_EQ(ReasonOf(tracks.Correct(kBob, 0, 100, {PoseAt(50, 0, 0, 0)}).status()),
            Reason::kDeltaInvalid);
  EXPECT_EQ(ReasonOf(tracks.Correct(kAnn, 100, 100, {}).status()), Reason::kDeltaInvalid);
}

// Random appends and corrections against a plain map of poses per revision.
TEST_P(Correction, InAnyOrderLeavesEveryRevisionAsItWas) {
  Tracks tracks(GetParam());
  std::mt19937_64 random(RecordSeed());
  std::map<TimeNs, double> believed;
  std::vector<std::pair<Revision, std::map<TimeNs, double>>> history;
  TimeNs end_ns = 0;
  for (int round = 0; round < 60; ++round) {
    const bool append = believed.empty() || random() % 2 == 0;
    std::vector<TimedPose> poses;
    Revision revision = 0;
    if (append) {
      for (uint64_t i = 0, n = 1 + random() % 150; i < n; ++i) {
        end_ns += 1 + static_cast<TimeNs>(random() % (random() % 20 == 0 ? 5 * kSecond : kSecond));
        poses.push_back(PoseAt(end_ns, round, 0, 0));
      }
      revision = tracks.Append(kAnn, poses);
    } else {
      const TimeNs from_ns = static_cast<TimeNs>(random() % static_cast<uint64_t>(end_ns));
      const TimeNs to_ns = from_ns + 1 + static_cast<TimeNs>(random() % (40 * kSecond));
      const TimeNs last_ns = std::min(to_ns - 1, believed.rbegin()->first);
      for (TimeNs t = from_ns; t <= last_ns; t += 1 + static_cast<TimeNs>(random() % kSecond)) {
        poses.push_back(PoseAt(t, round, 0, 0));
      }
      believed.erase(believed.lower_bound(from_ns), believed.lower_bound(to_ns));
      revision = OrDie(tracks.Correct(kAnn, from_ns, to_ns, poses)).revision;
    }
    for (const TimedPose& pose : poses) believed[pose.time_ns] = round;
    history.emplace_back(revision, believed);
    if (random() % 10 == 0) {
      tracks.map().Close();
      tracks.map().Reopen();
    }
  }
  for (const auto& [revision, expected] : history) {
    std::map<TimeNs, double> kept;
    for (const TimedPose& pose : Read(*tracks.map().At(revision), kAnn)) {
      kept[pose.time_ns] = pose.map_T_agent.position.x();
    }
    ASSERT_EQ(kept, expected) << "revision " << revision;
  }
  EXPECT_EQ(tracks.map().Problems(), "");
}

// When was the agent in the box, by asking where it was, densely.
std::vector<bool> DenselyInside(const Snapshot& snapshot, NodeId agent, const Box3d& box,
                                TimeNs from_ns, TimeNs to_ns, TimeNs step_ns) {
  std::vector<bool> inside;
  for (TimeNs t = from_ns; t < to_ns; t += step_ns) {
    const auto located = snapshot.Locate(agent, t);
    inside.push_back(located.ok() && located->quality != PoseQuality::kInGap &&
                     box.contains(located->map_T_agent.position));
  }
  return inside;
}

void ExpectVisitsEqualSamples(const Snapshot& snapshot, const Box3d& box, TimeNs from_ns,
                              TimeNs to_ns, TimeNs step_ns) {
  const auto visits = OrDie(snapshot.VisitsToBox(box, from_ns, to_ns, {}));
  for (const BoxVisit& visit : visits) {
    ASSERT_LT(visit.enter_ns, visit.exit_ns);
    ASSERT_GE(visit.enter_ns, from_ns);
    ASSERT_LE(visit.exit_ns, to_ns);
  }
  for (const NodeId agent : {kAnn, kBob}) {
    const auto sampled = DenselyInside(snapshot, agent, box, from_ns, to_ns, step_ns);
    for (size_t i = 0; i < sampled.size(); ++i) {
      const TimeNs t = from_ns + static_cast<TimeNs>(i) * step_ns;
      const bool visited = std::any_of(visits.begin(), visits.end(), [&](const BoxVisit& visit) {
        return visit.agent == agent && visit.enter_ns <= t && t < visit.exit_ns;
      });
      // Rounding may move a border by a nanosecond; so close to one, either answer is right.
      const bool at_border = std::any_of(visits.begin(), visits.end(), [&](const BoxVisit& visit) {
        return visit.agent == agent &&
               (std::abs(visit.enter_ns - t) <= 2 || std::abs(visit.exit_ns - t) <= 2);
      });
      ASSERT_TRUE(visited == sampled[i] || at_border)
          << ToString(agent) << " at " << t << " ns is " << (sampled[i] ? "in" : "out of")
          << " the box at revision " << snapshot.revision();
    }
  }
}

TEST_P(VisitsToBox, EqualDenseSamplingAtAllRevisionsAlsoCorrectedOnes) {
  std::mt19937_64 random(RecordSeed());
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (const auto codec : {TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless}) {
    Tracks tracks(GetParam(), codec);
    TimeNs end_ns = 0;
    for (int round = 0; round < 6; ++round) {
      const auto walk = RandomWalk(&random, 120, end_ns, kSecond * 3 / 2);
      tracks.Append(kAnn, walk);
      tracks.Append(kBob, RandomWalk(&random, 100, end_ns, kSecond));
      end_ns = walk.back().time_ns + (round % 2 == 0 ? 0 : 3 * kSecond);
      if (round == 3) {
        ASSERT_TRUE(
            tracks
                .Correct(kAnn, end_ns / 4, end_ns / 2, RandomWalk(&random, 20, end_ns / 4, kSecond))
                .ok());
      }
      end_ns += 100 * kSecond;
    }
    const Revision head = OrDie(tracks.map().reader().Head()).revision;
    for (int i = 0; i < 30; ++i) {
      const auto snapshot = tracks.map().At(
          i % 2 == 0 ? head
                     : static_cast<Revision>(2 + random() % static_cast<uint64_t>(head - 1)));
      const Eigen::Vector3d low(uniform(-5, 20), uniform(-5, 20), uniform(0.5, 1.0));
      const Box3d box(low, low + Eigen::Vector3d(uniform(0.1, 8), uniform(0.1, 8), 1.0));
      const TimeNs from_ns = static_cast<TimeNs>(uniform(-0.1, 0.9) * static_cast<double>(end_ns));
      const TimeNs to_ns = from_ns + static_cast<TimeNs>(uniform(10, 300) * 1e9);
      ExpectVisitsEqualSamples(*snapshot, box, from_ns, to_ns, 137'000'011);
    }
  }
}

TEST_P(VisitsToBox, SeesACrossingBetweenTwoPosesAndASinglePose) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, -5, 0, 0), PoseAt(kSecond, 5, 0, 0)});
  tracks.Append(kBob, {PoseAt(7 * kSecond, 0, 0, 0)});
  const auto visits =
      OrDie(tracks.map().Latest()->VisitsToBox(BoxOf(-1, -1, -1, 1, 1, 1), kTimeMin, kTimeMax, {}));
  ASSERT_EQ(visits.size(), 2u);
  EXPECT_EQ(visits[0].agent, kAnn);
  EXPECT_NEAR(static_cast<double>(visits[0].enter_ns), 0.4e9, 2.0);
  EXPECT_NEAR(static_cast<double>(visits[0].exit_ns), 0.6e9, 2.0);
  EXPECT_EQ(visits[1].agent, kBob);
  EXPECT_EQ(visits[1].enter_ns, 7 * kSecond);
  EXPECT_EQ(visits[1].exit_ns, 7 * kSecond + 1);
}

TEST_P(VisitsToBox, SeesACrossingFromOneSegmentToTheNext) {
  Tracks tracks(GetParam());
  std::vector<TimedPose> poses;
  // Far on one side, then far on the other; where segments end is the codec's secret, so the
  // crossing comes at every place in turn.
  for (int i = 0; i < 500; ++i) poses.push_back(PoseAt(i * kSecond, i % 2 == 0 ? -5 : 5, 0, 0));
  tracks.Append(kAnn, poses);
  const auto visits =
      OrDie(tracks.map().Latest()->VisitsToBox(BoxOf(-1, -1, -1, 1, 1, 1), kTimeMin, kTimeMax, {}));
  EXPECT_EQ(visits.size(), 499u);
}

TEST_P(VisitsToBox, TakesTheAgentsOwnGapLimit) {
  Tracks tracks(GetParam());
  Node patient = MakeHuman(1, "ann");
  patient.agent.emplace().gap_ns_max = 10 * kSecond;
  tracks.map().MustCommit(DeltaOfNodes({patient}));
  tracks.Append(kAnn, {PoseAt(0, -5, 0, 0), PoseAt(8 * kSecond, 5, 0, 0)});
  ExpectVisitsEqualSamples(*tracks.map().Latest(), BoxOf(-1, -1, -1, 1, 1, 1), 0, 9 * kSecond,
                           50'000'007);
}

TEST_P(VisitsToBox, DoesNotJoinAcrossAGap) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, -5, 0, 0), PoseAt(3 * kSecond, 5, 0, 0)});
  EXPECT_TRUE(
      OrDie(tracks.map().Latest()->VisitsToBox(BoxOf(-1, -1, -1, 1, 1, 1), kTimeMin, kTimeMax, {}))
          .empty());
}

TEST_P(ObservedAgents, AreThoseSeenOrInterpolatedInTheInterval) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0), PoseAt(kSecond, 0, 0, 0)});
  tracks.Append(kBob, {PoseAt(0, 0, 0, 0), PoseAt(5 * kSecond, 0, 0, 0)});
  const auto snapshot = tracks.map().Latest();
  EXPECT_EQ(OrDie(snapshot->CountObservedAgents(10, 20, {})), 1);
  EXPECT_EQ(OrDie(snapshot->CountObservedAgents(0, 1, {})), 2);
  EXPECT_EQ(OrDie(snapshot->CountObservedAgents(kSecond + 1, 5 * kSecond, {})), 0);
  EXPECT_EQ(OrDie(snapshot->CountObservedAgents(5 * kSecond, 6 * kSecond, {})), 1);
}

TEST_P(Stays, AreFoundByAgentByInstantAndByRoom) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0), PoseAt(50, 0, 0, 0)});
  tracks.AddStays({{kAnn, kPlace, kRoom, 0, 10}, {kAnn, NodeId(), kRoom, 20, kTimeMax}});
  const auto snapshot = tracks.map().Latest();
  EXPECT_EQ(OrDie(snapshot->StayAt(kAnn, 9))->place, kPlace);
  EXPECT_FALSE(OrDie(snapshot->StayAt(kAnn, 10)).has_value());
  EXPECT_FALSE(OrDie(snapshot->StayAt(kAnn, -1)).has_value());
  EXPECT_EQ(OrDie(snapshot->StayAt(kAnn, 50))->room, kRoom);
  // An open stay ends with the track, one nanosecond past its last pose.
  EXPECT_FALSE(OrDie(snapshot->StayAt(kAnn, 51)).has_value());
  const std::vector<Stay> clipped = {{kAnn, kPlace, kRoom, 0, 10}, {kAnn, NodeId(), kRoom, 20, 51}};
  EXPECT_EQ(OrDie(snapshot->StaysOfAgent(kAnn, kTimeMin, kTimeMax)), clipped);
  EXPECT_EQ(OrDie(snapshot->StaysOfAgent(kAnn, 10, 20)), std::vector<Stay>());
  EXPECT_EQ(OrDie(snapshot->StaysInNode(kRoom, kTimeMin, kTimeMax, {})), clipped);
  EXPECT_EQ(OrDie(snapshot->StaysInNode(kRoom, 9, 20, {})), std::vector<Stay>{clipped[0]});
  EXPECT_EQ(OrDie(snapshot->StaysInNode(kRoom, 10, 21, {})), std::vector<Stay>{clipped[1]});
  EXPECT_EQ(OrDie(snapshot->StaysInNode(kRoom, 51, kTimeMax, {})), std::vector<Stay>());
  EXPECT_EQ(OrDie(snapshot->StaysInNode(kPlace, kTimeMin, kTimeMax, {})),
            std::vector<Stay>{clipped[0]});
}

TEST_P(Stays, OfAnHourAreFoundFromTheirLastNanosecond) {
  Tracks tracks(GetParam());
  tracks.AddStays({{kAnn, kPlace, kRoom, 0, kStayNsMax}});
  const auto snapshot = tracks.map().Latest();
  EXPECT_EQ(OrDie(snapshot->StaysInNode(kRoom, kStayNsMax - 1, kTimeMax, {})).size(), 1u);
  EXPECT_EQ(OrDie(snapshot->StaysInNode(kRoom, kStayNsMax, kTimeMax, {})).size(), 0u);
}

TEST_P(Stays, NowhereOrEmptyOrOfNobodyAreRefused) {
  Tracks tracks(GetParam());
  for (const Stay& stay :
       {Stay{kAnn, NodeId(), NodeId(), 0, 10}, Stay{kAnn, kPlace, kRoom, 5, 5},
        Stay{kRoom, kPlace, kRoom, 0, 10}, Stay{kAnn, NodeId('p', 9), kRoom, 0, 10}}) {
    GraphDelta delta;
    delta.stays = {stay};
    EXPECT_EQ(ReasonOf(tracks.map().Commit(delta).status()), Reason::kDeltaInvalid);
  }
}

// Times from all over 64 bits, close together and far apart.
TimeNs AnyTime(Random* random) {
  constexpr TimeNs kHour = 3600 * kNsPerSecond;
  switch (random->Index(5)) {
    case 0:
      return kTimeMin + static_cast<TimeNs>(random->Index(5));
    case 1:
      return kTimeMax - 1 - static_cast<TimeNs>(random->Index(5));
    case 2:
      return static_cast<TimeNs>(random->Index(1000)) * kHour / 10;
    case 3:
      return kHour + static_cast<TimeNs>(random->Index(5)) - 2;
    default:
      return static_cast<TimeNs>(random->Uniform(-9.2e18, 9.2e18));
  }
}

// Who was in the room, and where each was, say the same, whatever the lengths of the stays.
TEST_P(Stays, OfEveryLengthAreFoundByRoomAndByAgent) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 0);
    Tracks tracks(GetParam());
    std::map<std::pair<NodeId, TimeNs>, Stay> stored;
    for (int round = 0; round < 3; ++round) {
      std::map<std::pair<NodeId, TimeNs>, Stay> added;
      for (int i = 0; i < 12; ++i) {
        Stay stay{random.Index(2) == 0 ? kAnn : kBob, kPlace, kRoom, AnyTime(&random),
                  AnyTime(&random)};
        if (stay.exit_ns < stay.enter_ns) std::swap(stay.enter_ns, stay.exit_ns);
        if (stay.exit_ns == stay.enter_ns) continue;
        added[{stay.agent, stay.enter_ns}] = stay;
      }
      std::vector<Stay> delta;
      for (const auto& [key, stay] : added) delta.push_back(stored[key] = stay);
      const Revision revision = tracks.AddStays(delta);
      const auto snapshot = tracks.map().At(revision);
      for (int i = 0; i < 50; ++i) {
        TimeNs from_ns = AnyTime(&random);
        TimeNs to_ns = AnyTime(&random);
        if (to_ns < from_ns) std::swap(from_ns, to_ns);
        std::vector<Stay> expected;
        std::map<NodeId, Stay> at;
        for (const auto& [key, stay] : stored) {
          if (stay.enter_ns < to_ns && stay.exit_ns > from_ns) expected.push_back(stay);
          if (stay.enter_ns <= from_ns && from_ns < stay.exit_ns) at[stay.agent] = stay;
        }
        std::sort(expected.begin(), expected.end(), [](const Stay& a, const Stay& b) {
          return std::tie(a.enter_ns, a.agent) < std::tie(b.enter_ns, b.agent);
        });
        for (const NodeId node : {kRoom, kPlace}) {
          EXPECT_EQ(OrDie(snapshot->StaysInNode(node, from_ns, to_ns, {})), expected);
        }
        for (const NodeId agent : {kAnn, kBob}) {
          const auto found = OrDie(snapshot->StayAt(agent, from_ns));
          ASSERT_EQ(found.has_value(), at.contains(agent)) << from_ns;
          if (found.has_value()) {
            EXPECT_EQ(*found, at[agent]);
          }
        }
      }
    }
  }
}

TEST_P(Stays, OfPastRevisionsAreAsTheyWereBelieved) {
  Tracks tracks(GetParam());
  tracks.Append(kAnn, {PoseAt(0, 0, 0, 0), PoseAt(5, 0, 0, 0)});
  const Revision open = tracks.AddStays({{kAnn, kPlace, kRoom, 0, kTimeMax}});
  const Revision grown = tracks.Append(kAnn, {PoseAt(100, 0, 0, 0)});
  const Revision closed = tracks.AddStays({{kAnn, kPlace, kRoom, 0, 40}});
  const auto exit_at = [&](Revision revision) {
    const auto stays = OrDie(tracks.map().At(revision)->StaysInNode(kRoom, kTimeMin, kTimeMax, {}));
    EXPECT_EQ(stays, OrDie(tracks.map().At(revision)->StaysOfAgent(kAnn, kTimeMin, kTimeMax)));
    return stays.size() == 1 ? stays[0].exit_ns : -1;
  };
  EXPECT_EQ(exit_at(open), 6);
  EXPECT_EQ(exit_at(grown), 101);
  EXPECT_EQ(exit_at(closed), 40);
  EXPECT_EQ(OrDie(tracks.map().reader().Head()).stay_count, 1);
  EXPECT_EQ(tracks.map().Problems(), "");
}

}  // namespace
}  // namespace dsg::test
