// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class Trajectory : public testing::Test {
 protected:
  Trajectory() {
    MakeOffice(folder_.path());
    request_.set_map(kMap);
    request_.set_agent("12");
  }

  // The messages of the stream.
  absl::StatusOr<std::vector<v1::GetTrajectoryResponse>> Get() {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    std::vector<v1::GetTrajectoryResponse> messages;
    const absl::Status status = query::ReadStream(
        query::CallContext(), core_->GetTrajectory(query::CallContext(), request_),
        [&](const auto& message) {
          messages.push_back(message);
          return true;
        });
    if (!status.ok()) return status;
    return messages;
  }

  std::vector<TimeNs> Times() {
    std::vector<TimeNs> times;
    const auto messages = Get();
    EXPECT_TRUE(messages.ok()) << messages.status();
    if (!messages.ok()) return times;
    for (const auto& message : *messages) {
      for (const auto& pose : message.poses()) times.push_back(pose.time_ns());
    }
    return times;
  }

  // H12 gets poses every 10 ms from 70 s on.
  void AddDensePoses(int count) {
    GraphDelta delta;
    delta.appends = {{NodeId('H', 12), {}}};
    for (int i = 0; i < count; ++i) {
      delta.appends[0].poses.push_back(
          PoseAt(70 * kSecond + i * kSecond / 100, 1 + 0.001 * i, 5, 1));
    }
    CommitToOffice(folder_.path(), std::move(delta));
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  v1::GetTrajectoryRequest request_;
};

TEST_F(Trajectory, GivesAllPosesToAndWithTheLastWhenNoIntervalIsAsked) {
  const std::vector<TimeNs> times = Times();
  ASSERT_EQ(times.size(), 22u);
  EXPECT_EQ(times.front(), 0);
  EXPECT_EQ(times.back(), 62 * kSecond);
}

TEST_F(Trajectory, TakesTheIntervalAsHalfOpen) {
  request_.set_from_ns(3 * kSecond);
  request_.set_to_ns(6 * kSecond);
  EXPECT_EQ(Times(), (std::vector<TimeNs>{3 * kSecond, 4 * kSecond, 5 * kSecond}));
}

TEST_F(Trajectory, RefusesAnInvertedInterval) {
  request_.set_from_ns(6);
  request_.set_to_ns(6);
  EXPECT_EQ(ReasonOf(Get().status()), Reason::kTimeRangeInverted);
}

TEST_F(Trajectory, SendsAHeaderEvenWhenThereIsNoPose) {
  request_.set_from_ns(30 * kSecond);
  request_.set_to_ns(31 * kSecond);
  const auto messages = Get();
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 1u);
  EXPECT_EQ(messages->front().header().read_revision(), 1);
  EXPECT_EQ(messages->front().agent_id(), "H12");
  EXPECT_EQ(messages->front().poses_size(), 0);
}

TEST_F(Trajectory, SendsAtMostAThousandPosesAMessageAndEachOnce) {
  AddDensePoses(2000);
  request_.set_from_ns(70 * kSecond);
  const auto messages = Get();
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 2u);
  EXPECT_EQ((*messages)[0].poses_size(), 1000);
  EXPECT_EQ((*messages)[1].poses_size(), 1000);
  EXPECT_TRUE((*messages)[0].has_header());
  EXPECT_FALSE((*messages)[1].has_header());
  const std::vector<TimeNs> times = Times();
  for (size_t i = 0; i < times.size(); ++i) {
    ASSERT_EQ(times[i], 70 * kSecond + static_cast<TimeNs>(i) * kSecond / 100);
  }
}

TEST_F(Trajectory, StopsWhenTheReaderHasEnough) {
  AddDensePoses(2500);
  core_ = OpenCore(folder_.path());
  int count = 0;
  const absl::Status status = query::ReadStream(
      query::CallContext(), core_->GetTrajectory(query::CallContext(), request_), [&](const auto&) {
        ++count;
        return false;
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(count, 1);
}

TEST_F(Trajectory, ReadsOneRevisionToTheEndThoughOthersCommit) {
  AddDensePoses(1500);
  core_ = OpenCore(folder_.path());
  const auto cursor = core_->GetTrajectory(query::CallContext(), request_);
  ASSERT_TRUE(cursor.ok()) << cursor.status();
  v1::GetTrajectoryResponse message;
  ASSERT_TRUE((*cursor)->Next(query::CallContext(), &message).ok());
  EXPECT_FALSE((*cursor)->done());
  EXPECT_EQ(message.header().read_revision(), 2);

  GraphDelta late;
  late.appends = {{NodeId('H', 12), {PoseAt(1000 * kSecond, 0, 0, 0)}}};
  CommitToOffice(folder_.path(), std::move(late));
  message.Clear();
  ASSERT_TRUE((*cursor)->Next(query::CallContext(), &message).ok());
  EXPECT_TRUE((*cursor)->done());
  EXPECT_EQ(message.poses_size(), 522);
  EXPECT_LT(message.poses().rbegin()->time_ns(), 1000 * kSecond);
}

TEST_F(Trajectory, ResamplesOnTheGridThatBeginsAtFrom) {
  request_.set_from_ns(kSecond / 2);
  request_.set_to_ns(3 * kSecond);
  request_.set_resample_period_ns(kSecond);
  const auto messages = Get();
  ASSERT_TRUE(messages.ok()) << messages.status();
  const v1::GetTrajectoryResponse& message = messages->front();
  ASSERT_EQ(message.poses_size(), 3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(message.poses(i).time_ns(), kSecond / 2 + i * kSecond);
    EXPECT_NEAR(message.poses(i).pose().position().x(), 1.5 + i, 1e-12);
  }
}

TEST_F(Trajectory, ResamplesNothingInsideGapsAndStaysOnTheGridBehindThem) {
  request_.set_resample_period_ns(700'000'000);
  for (const TimeNs t : Times()) {
    EXPECT_EQ(t % 700'000'000, 0);
    EXPECT_TRUE(t <= 18 * kSecond || t >= 60 * kSecond) << t;
    EXPECT_LE(t, 62 * kSecond);
  }
  // 0 to 17.5 s, and 60.2 to 61.6 s.
  EXPECT_EQ(Times().size(), 26u + 3u);
}

TEST_F(Trajectory, ResamplesFromLongBeforeTheTrackWithoutWalkingThere) {
  request_.set_from_ns(kTimeMin);
  request_.set_resample_period_ns(1'000'000);
  const std::vector<TimeNs> times = Times();
  ASSERT_EQ(times.size(), 18'000u + 2'000u);
  EXPECT_GE(times.front(), 0);
  EXPECT_LT(times.front(), 1'000'000);
}

TEST_F(Trajectory, RefusesPeriodsBelowAMillisecond) {
  for (const int64_t period_ns : {int64_t{-1}, int64_t{999'999}}) {
    request_.set_resample_period_ns(period_ns);
    EXPECT_EQ(ReasonOf(Get().status()), Reason::kFieldInvalid);
  }
}

TEST_F(Trajectory, StopsWhenCancelled) {
  core_ = OpenCore(folder_.path());
  query::CallContext call;
  request_.set_resample_period_ns(1'000'000);
  int count = 0;
  const absl::Status status =
      query::ReadStream(call, core_->GetTrajectory(call, request_), [&](const auto&) {
        ++count;
        call.Cancel();
        return true;
      });
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace dsg::test
