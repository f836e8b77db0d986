// SPDX-License-Identifier: Apache-2.0
// Tracks that nobody can be found again in wait on disk: they are the same when they are asked for,
// and memory does not grow with them.
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <cmath>
#include <set>

#include "ingest/agents/tracking/track_bytes.h"
#include "schema/base/status.h"
#include "tests/support/full_disk.h"
#include "tests/support/open_files.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/agents/tracking/people_util.h"

namespace dsg::ingest {
namespace {

using test::TempFolder;

constexpr double kStepS = 0.2;

// Somebody without a shape, so that nobody is found again, passes by every ten seconds.
class PassersBy {
 public:
  // All images until `until_s`, and what is told of them every second.
  void Run(double until_s, PersonTracker* tracker) {
    for (; now_s_ < until_s; now_s_ += kStepS) {
      const double since_s = std::fmod(now_s_, 10.0);
      std::vector<PersonObservation> seen;
      if (since_s < 5.0) {
        PersonObservation observation = ObservationAt({since_s, 0.3 * std::sin(now_s_), 0.95}, 0.1);
        observation.time_ns = AtS(now_s_);
        observation.detection_id = ++next_id_;
        observation.has_joints = true;
        for (size_t joint = 0; joint < observation.joints_torso.size(); ++joint) {
          observation.joints_torso[joint] = {0.01 * static_cast<double>(joint), 0.1, 0.2};
        }
        observation.cues.push_back({PositionCue::Kind::kDepthImage,
                                    observation.map_T_torso.position, Eigen::Matrix3d::Identity()});
        seen.push_back(observation);
      }
      tracker->Observe(AtS(now_s_), seen);
      if (static_cast<int>(now_s_ / kStepS) % 5 == 0) Tell(tracker);
    }
  }

  void Tell(PersonTracker* tracker) {
    for (const TrackChange& change : tracker->TakeChanges()) {
      if (change.state == TrackState::kDropped) continue;
      tracks.insert(change.track);
      EXPECT_GT(tracker->track(change.track).observations.size(), 0u);
      tracker->ForgetShapes(change.track, change.first_observation);
    }
    const std::vector<int64_t> more = tracker->TakeClosed();
    closed.insert(closed.end(), more.begin(), more.end());
  }

  std::set<int64_t> tracks;
  std::vector<int64_t> closed;

 private:
  double now_s_ = 0.0;
  int64_t next_id_ = 0;
};

TrackerOptions AgainFor(double seconds) {
  TrackerOptions options;
  options.again_ns = static_cast<TimeNs>(seconds * 1e9);
  return options;
}

void ExpectSame(const PersonTracker& a, const PersonTracker& b, const std::set<int64_t>& tracks) {
  for (const int64_t id : tracks) {
    const PersonTracker::Track& track = a.track(id);
    const PersonTracker::Track& other = b.track(id);
    EXPECT_EQ(track.state, other.state);
    EXPECT_EQ(EncodeTrack(track.observations, track.graph.estimates()),
              EncodeTrack(other.observations, other.graph.estimates()))
        << "track " << id;
  }
}

TEST(ClosedTracks, AreTheSame) {
  const TempFolder folder;
  PersonTracker kept(AgainFor(1e6));
  PersonTracker put_away(AgainFor(20.0), folder.path());
  PassersBy in_kept, in_put_away;
  in_kept.Run(120.0, &kept);
  in_put_away.Run(120.0, &put_away);
  ASSERT_EQ(in_kept.tracks.size(), 12u);
  EXPECT_EQ(in_kept.tracks, in_put_away.tracks);
  EXPECT_TRUE(in_kept.closed.empty());
  EXPECT_GE(in_put_away.closed.size(), 8u);
  EXPECT_EQ(test::OpenFilesIn(folder.path()).size(), 1u);
  ExpectSame(kept, put_away, in_kept.tracks);
  // And after a correction, told once more.
  Pose3d moved;
  moved.position = {0.3, -0.1, 0.0};
  moved.orientation = Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitZ());
  const TrajectoryChange change({AtS(0.0), AtS(120.0)}, {Pose3d(), Pose3d()}, {moved, moved});
  for (PersonTracker* tracker : {&kept, &put_away}) tracker->Move(change);
  ExpectSame(kept, put_away, in_kept.tracks);
  EXPECT_EQ(put_away.TakeChanges().size(), 12u);
  in_kept.Run(180.0, &kept);
  in_put_away.Run(180.0, &put_away);
  ExpectSame(kept, put_away, in_kept.tracks);
  EXPECT_TRUE(put_away.status().ok()) << put_away.status();
}

// Two hours, 720 people; their observations would take 30 MB.
TEST(ClosedTracks, TakeNoMemoryForWhatWasSeen) {
  PersonTracker tracker(AgainFor(20.0));
  PassersBy people;
  people.Run(600.0, &tracker);
  const size_t before = mallinfo2().uordblks;
  people.Run(7200.0, &tracker);
  EXPECT_EQ(people.tracks.size(), 720u);
  EXPECT_LT(mallinfo2().uordblks, before + 660 * 4000);
  EXPECT_TRUE(tracker.status().ok()) << tracker.status();
}

TEST(ClosedTracks, TellThatTheDiskFails) {
  const TempFolder folder;
  PersonTracker full(AgainFor(20.0), folder.path());
  PassersBy people;
  {
    const test::FullDisk disk;
    people.Run(60.0, &full);
  }
  EXPECT_EQ(ReasonOf(full.status()), Reason::kDiskFull) << full.status();
  EXPECT_GT(full.track(1).observations.size(), 10u);

  PersonTracker changed(AgainFor(20.0), folder.path());
  PassersBy others;
  others.Run(60.0, &changed);
  ASSERT_FALSE(others.closed.empty());
  const std::vector<int> open = test::OpenFilesIn(folder.path());
  ASSERT_FALSE(open.empty());
  ASSERT_EQ(ftruncate(open.back(), 100), 0);
  EXPECT_GT(changed.track(others.closed.front()).observations.size(), 10u);
  EXPECT_TRUE(absl::IsDataLoss(changed.status())) << changed.status();
}

}  // namespace
}  // namespace dsg::ingest
