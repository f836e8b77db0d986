// SPDX-License-Identifier: Apache-2.0
// Tracks in columns say what GetTrajectory says of each; a timeline counts what is in them.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/scene.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/columns.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

using query::CallContext;

struct DecodedTrack {
  std::vector<TimeNs> times;
  std::vector<double> x;
  std::vector<double> orientations;
  std::vector<uint32_t> gaps;
  std::vector<uint8_t> flags;
};

class TracksTest : public testing::Test {
 protected:
  TracksTest() {
    MakeOffice(folder_.path());
    request_.set_map(kMap);
  }

  absl::StatusOr<std::map<std::string, DecodedTrack>> Get() {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    std::vector<std::string> ids;
    std::map<std::string, DecodedTrack> tracks;
    const absl::Status status = query::ReadStream(
        CallContext(), core_->GetTracks(CallContext(), request_), [&](const auto& message) {
          for (const v1::TrackHead& head : message.tracks()) {
            ids.push_back(head.agent_id());
            tracks[head.agent_id()];
          }
          for (const v1::TrackPoses& poses : message.poses()) {
            Add(poses, &tracks[ids.at(static_cast<size_t>(poses.track()))]);
          }
          largest_ = std::max(largest_, message.ByteSizeLong());
          return true;
        });
    if (!status.ok()) return status;
    return tracks;
  }

  void Add(const v1::TrackPoses& in, DecodedTrack* out) {
    ASSERT_EQ(in.value_bytes(), 8);
    const size_t before = out->times.size();
    for (const TimeNs time_ns : ValuesOf<int64_t>(in.times_ns())) out->times.push_back(time_ns);
    const auto positions = ValuesOf<double>(in.positions());
    ASSERT_EQ(positions.size(), 3 * static_cast<size_t>(in.row_count()));
    for (size_t i = 0; i < positions.size(); i += 3) {
      out->x.push_back(in.origin_map().x() + positions[i]);
    }
    for (const double value : ValuesOf<double>(in.orientations())) {
      out->orientations.push_back(value);
    }
    for (const uint32_t row : ValuesOf<uint32_t>(in.gaps())) {
      out->gaps.push_back(static_cast<uint32_t>(before) + row);
    }
    for (const uint8_t flags : ValuesOf<uint8_t>(in.flags())) out->flags.push_back(flags);
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  v1::GetTracksRequest request_;
  size_t largest_ = 0;
};

TEST_F(TracksTest, OfAllAgentsHaveTheirPosesGapsAndFlags) {
  const auto tracks = Get();
  ASSERT_TRUE(tracks.ok()) << tracks.status();
  ASSERT_EQ(tracks->size(), 3u);
  const DecodedTrack& walker = tracks->at("H12");
  ASSERT_EQ(walker.times.size(), 22u);
  EXPECT_EQ(walker.times[18], 18 * kSecond);
  EXPECT_EQ(walker.x[4], 5.0);
  EXPECT_EQ(walker.gaps, (std::vector<uint32_t>{19u}));
  EXPECT_EQ(walker.orientations.size(), 4 * 22u);
  EXPECT_EQ(walker.orientations[3], 1.0);
  EXPECT_TRUE(walker.flags.empty());
  const DecodedTrack& stander = tracks->at("H13");
  EXPECT_TRUE(stander.orientations.empty()) << "the source gave none";
  ASSERT_EQ(stander.flags.size(), 11u);
  EXPECT_EQ(stander.flags[0], pose_flags::kNoOrientation);
  EXPECT_EQ(tracks->at("r1").times.size(), 1u);
}

TEST_F(TracksTest, OfSomeAgentsInAnIntervalByIdOrName) {
  request_.add_agents("12");
  request_.add_agents("H12");
  request_.add_agents("r1");
  request_.set_from_ns(2 * kSecond);
  request_.set_to_ns(5 * kSecond);
  request_.set_without_orientations(true);
  const auto tracks = Get();
  ASSERT_TRUE(tracks.ok()) << tracks.status();
  ASSERT_EQ(tracks->size(), 2u);
  EXPECT_EQ(tracks->at("H12").times, (std::vector<TimeNs>{2 * kSecond, 3 * kSecond, 4 * kSecond}));
  EXPECT_TRUE(tracks->at("H12").orientations.empty());
  EXPECT_TRUE(tracks->at("r1").times.empty());
  request_.add_agents("nobody");
  EXPECT_EQ(ReasonOf(Get().status()), Reason::kAgentUnknown);
}

TEST_F(TracksTest, ResampledAreTheTrajectories) {
  request_.set_resample_period_ns(1'500'000'000);
  const auto tracks = Get();
  ASSERT_TRUE(tracks.ok()) << tracks.status();
  v1::GetTrajectoryRequest one;
  one.set_map(kMap);
  one.set_agent("12");
  one.set_resample_period_ns(1'500'000'000);
  std::vector<TimeNs> times;
  ASSERT_TRUE(query::ReadStream(CallContext(), core_->GetTrajectory(CallContext(), one),
                                [&](const auto& message) {
                                  for (const auto& pose : message.poses()) {
                                    times.push_back(pose.time_ns());
                                  }
                                  return true;
                                })
                  .ok());
  EXPECT_EQ(tracks->at("H12").times, times);
  EXPECT_EQ(tracks->at("H12").gaps, (std::vector<uint32_t>{13u}));
}

TEST_F(TracksTest, ResampledTellOfGapsThatNoSampleLiesIn) {
  request_.add_agents("12");
  request_.set_resample_period_ns(60 * kSecond);
  const auto over = Get();
  ASSERT_TRUE(over.ok()) << over.status();
  EXPECT_EQ(over->at("H12").times, (std::vector<TimeNs>{0, 60 * kSecond}));
  EXPECT_EQ(over->at("H12").gaps, (std::vector<uint32_t>{1u}));
  request_.set_resample_period_ns(9 * kSecond);
  const auto within = Get();
  ASSERT_TRUE(within.ok()) << within.status();
  EXPECT_EQ(within->at("H12").times, (std::vector<TimeNs>{0, 9 * kSecond, 18 * kSecond}));
  EXPECT_TRUE(within->at("H12").gaps.empty());
}

TEST_F(TracksTest, ThinnedKeepTheEndsOfStretches) {
  request_.set_thin_period_ns(5 * kSecond);
  request_.add_agents("12");
  const auto tracks = Get();
  ASSERT_TRUE(tracks.ok()) << tracks.status();
  const DecodedTrack& walker = tracks->at("H12");
  std::vector<TimeNs> seconds;
  for (const TimeNs time_ns : walker.times) seconds.push_back(time_ns / kSecond);
  EXPECT_EQ(seconds, (std::vector<TimeNs>{0, 5, 10, 15, 18, 60, 62}));
  EXPECT_EQ(walker.gaps, (std::vector<uint32_t>{5u}));
  request_.set_resample_period_ns(kSecond);
  EXPECT_EQ(ReasonOf(Get().status()), Reason::kFieldInvalid);
  request_.set_resample_period_ns(0);
  request_.set_thin_period_ns(5);
  EXPECT_EQ(ReasonOf(Get().status()), Reason::kFieldInvalid);
}

TEST_F(TracksTest, InSinglePrecisionAreHalfAsLarge) {
  request_.add_agents("12");
  request_.set_single_precision(true);
  core_ = OpenCore(folder_.path());
  v1::GetTracksResponse first;
  ASSERT_TRUE(query::ReadStream(CallContext(), core_->GetTracks(CallContext(), request_),
                                [&](const auto& message) {
                                  first = message;
                                  return false;
                                })
                  .ok());
  ASSERT_EQ(first.poses_size(), 1);
  EXPECT_EQ(first.poses(0).value_bytes(), 4);
  EXPECT_EQ(first.poses(0).positions().size(), 22 * 3 * sizeof(float));
  const auto positions = ValuesOf<float>(first.poses(0).positions());
  EXPECT_NEAR(first.poses(0).origin_map().x() + positions[3 * 7], 8.0, 1e-6);
}

TEST_F(TracksTest, OfManyPosesComeInBoundedMessages) {
  GraphDelta delta;
  delta.appends = {{NodeId('H', 12), {}}};
  for (int i = 0; i < 50'000; ++i) {
    delta.appends[0].poses.push_back(PoseAt(70 * kSecond + i * kSecond / 100, 0.001 * i, 5, 1));
  }
  CommitToOffice(folder_.path(), std::move(delta));
  const auto tracks = Get();
  ASSERT_TRUE(tracks.ok()) << tracks.status();
  const DecodedTrack& walker = tracks->at("H12");
  EXPECT_EQ(walker.times.size(), 50'022u);
  EXPECT_TRUE(std::is_sorted(walker.times.begin(), walker.times.end()));
  EXPECT_NEAR(walker.x.back(), 49.999, 1e-9);
  EXPECT_EQ(walker.gaps, (std::vector<uint32_t>{19u, 22u}));
  EXPECT_LT(largest_, size_t{2} << 20);
}

// A field of a reply as a list.
template <typename Field>
std::vector<int64_t> ListOf(const Field& field) {
  return {field.begin(), field.end()};
}

class TimelineTest : public TracksTest {
 protected:
  TimelineTest() { timeline_.set_map(kMap); }

  absl::StatusOr<v1::GetTimelineResponse> Count() {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    v1::GetTimelineResponse reply;
    const absl::Status status = core_->GetTimeline(CallContext(), timeline_, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  v1::GetTimelineRequest timeline_;
};

TEST_F(TimelineTest, CountsAgentsAndPosesABin) {
  timeline_.set_from_ns(0);
  timeline_.set_to_ns(70 * kSecond);
  timeline_.set_bin_count(7);
  const auto reply = Count();
  ASSERT_TRUE(reply.ok()) << reply.status();
  // H12 from 0 to 18 s and from 60 s on, H13 from 2 to 12 s, r1 at 5 s.
  EXPECT_EQ(ListOf(reply->agent_counts()), (std::vector<int64_t>{3, 2, 0, 0, 0, 0, 1}));
  EXPECT_EQ(ListOf(reply->pose_counts()), (std::vector<int64_t>{19, 12, 0, 0, 0, 0, 3}));
}

TEST_F(TimelineTest, CountsWhoIsInterpolatedThroughABin) {
  timeline_.set_from_ns(3 * kSecond + 200'000'000);
  timeline_.set_to_ns(3 * kSecond + 800'000'000);
  timeline_.set_bin_count(2);
  const auto reply = Count();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(ListOf(reply->agent_counts()), (std::vector<int64_t>{2, 2}));
  EXPECT_EQ(ListOf(reply->pose_counts()), (std::vector<int64_t>{0, 0}));
}

TEST_F(TimelineTest, IsOfAllPosesUnlessAnIntervalIsAsked) {
  auto reply = Count();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->from_ns(), 0);
  EXPECT_EQ(reply->to_ns(), 62 * kSecond + 1);
  EXPECT_EQ(reply->agent_counts_size(), 200);
  int64_t poses = 0;
  for (const int64_t count : reply->pose_counts()) poses += count;
  EXPECT_EQ(poses, 34);
  timeline_.set_bin_count(2001);
  EXPECT_EQ(ReasonOf(Count().status()), Reason::kFieldInvalid);
  timeline_.set_bin_count(0);
  timeline_.set_from_ns(63 * kSecond);
  EXPECT_EQ(ReasonOf(Count().status()), Reason::kTimeRangeInverted);
  timeline_.mutable_read_at()->set_exact_revision(0);
  timeline_.clear_from_ns();
  reply = Count();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->pose_counts(0), 0);
  EXPECT_EQ(reply->from_ns(), reply->to_ns()) << "there are no poses";
}

}  // namespace
}  // namespace dsg::test
