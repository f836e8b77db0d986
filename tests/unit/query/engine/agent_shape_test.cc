// SPDX-License-Identifier: Apache-2.0
// Bodies arrive in order, in the parts that were asked for, in messages that every peer accepts.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/codec/topology.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

using query::CallContext;
using Messages = std::vector<v1::GetAgentShapeResponse>;

constexpr size_t kVertexCount = 5000;

Asset TopologyAsset(uint32_t last) {
  const std::string content = EncodeTopology({kVertexCount, {{0, 1, last}}});
  return {ComputeSha256(content), kTopologyMediaType, content};
}

BodyShape BodyAt(TimeNs time_ns) {
  BodyShape body;
  body.time_ns = time_ns;
  body.pose_coefficients.assign(72, 0.25f);
  body.shape_coefficients.assign(10, 0.5f);
  body.joints.assign(72, 0.75f);
  for (size_t i = 0; i < 3 * kVertexCount; ++i) {
    body.vertices.push_back(static_cast<float>(i % 1000) * 1e-3f);
  }
  return body;
}

// H12 has a body every half second from 0 s to 24.5 s, the last ten on another topology.
class AgentShape : public testing::Test {
 protected:
  AgentShape() {
    MakeOffice(folder_.path());
    GraphDelta delta;
    delta.assets = {TopologyAsset(2), TopologyAsset(3)};
    delta.shapes = {{NodeId('H', 12), delta.assets[0].sha256, {}},
                    {NodeId('H', 12), delta.assets[1].sha256, {}}};
    for (int i = 0; i < 50; ++i) {
      delta.shapes[i < 40 ? 0 : 1].shapes.push_back(BodyAt(i * kSecond / 2));
    }
    CommitToOffice(folder_.path(), delta);
    request_.set_map(kMap);
    request_.set_agent("12");
  }

  absl::StatusOr<Messages> Ask(const CallContext& call = CallContext()) {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    Messages messages;
    const absl::Status status =
        query::ReadStream(call, core_->GetAgentShape(call, request_), [&](const auto& message) {
          messages.push_back(message);
          return true;
        });
    if (!status.ok()) return status;
    return messages;
  }

  static std::vector<TimeNs> TimesOf(const Messages& messages) {
    std::vector<TimeNs> times;
    for (const auto& message : messages) {
      for (const auto& body : message.shapes()) times.push_back(body.shape().time_ns());
    }
    return times;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  v1::GetAgentShapeRequest request_;
};

TEST_F(AgentShape, StreamsEverythingOnceInOrderInBoundedMessages) {
  const auto messages = Ask();
  ASSERT_TRUE(messages.ok()) << messages.status();
  EXPECT_GT(messages->size(), 3u);
  std::set<std::string> topologies;
  for (const auto& message : *messages) {
    const bool is_first = &message == &messages->front();
    EXPECT_EQ(message.has_header(), is_first);
    EXPECT_EQ(message.agent_id(), is_first ? "H12" : "");
    EXPECT_LT(message.ByteSizeLong(), size_t{3} << 20);
    EXPECT_TRUE(message.topologies().empty() || message.shapes().empty());
    for (const v1::Asset& asset : message.topologies()) {
      EXPECT_TRUE(topologies.insert(asset.sha256()).second);
      Topology topology;
      EXPECT_TRUE(DecodeTopology(asset.content(), &topology));
    }
    for (const v1::AgentShape& body : message.shapes()) {
      EXPECT_TRUE(topologies.contains(body.topology_sha256()));
      EXPECT_EQ(body.vertex_count(), static_cast<int>(kVertexCount));
      EXPECT_EQ(body.shape().vertices_size(), static_cast<int>(3 * kVertexCount));
      EXPECT_EQ(body.shape().joints_size(), 72);
    }
  }
  EXPECT_EQ(messages->front().header().read_revision(), 2);
  EXPECT_EQ(topologies.size(), 2u);
  const std::vector<TimeNs> times = TimesOf(*messages);
  EXPECT_EQ(times.size(), 50u);
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
}

TEST_F(AgentShape, GivesThePoseOfTheAgentWhereTheTrackHasOne) {
  request_.add_parts(v1::SHAPE_PART_JOINTS);
  const auto messages = Ask();
  ASSERT_TRUE(messages.ok()) << messages.status();
  const auto& first = messages->front().shapes();
  EXPECT_EQ(first[0].quality(), v1::EXACT);
  EXPECT_EQ(first[0].pose().position().x(), 1.0);
  EXPECT_EQ(first[1].quality(), v1::INTERPOLATED);
  EXPECT_NEAR(first[1].pose().position().x(), 1.5, 1e-9);
  // After 18 s nothing was seen of H12 until 60 s.
  EXPECT_EQ(first[48].quality(), v1::IN_GAP);
  EXPECT_FALSE(first[48].has_pose());
}

TEST_F(AgentShape, SendsABodyOutsideTheTrackWithoutAPose) {
  GraphDelta delta;
  delta.shapes = {{NodeId('r', 1), std::nullopt, {BodyAt(9 * kSecond)}}};
  CommitToOffice(folder_.path(), delta);
  request_.set_agent("spot");
  const auto messages = Ask();
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->front().shapes_size(), 1);
  EXPECT_FALSE(messages->front().shapes(0).has_pose());
  EXPECT_EQ(messages->front().shapes(0).quality(), v1::POSE_QUALITY_UNSPECIFIED);
  EXPECT_EQ(messages->front().shapes(0).topology_sha256(), "");
}

TEST_F(AgentShape, SendsOnlyThePartsAskedFor) {
  request_.set_to_ns(kSecond);
  request_.add_parts(v1::SHAPE_PART_COEFFICIENTS);
  auto messages = Ask();
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 1u);
  const v1::AgentShape& body = messages->front().shapes(0);
  EXPECT_EQ(body.shape().pose_coefficients_size(), 72);
  EXPECT_EQ(body.shape().joints_size(), 0);
  EXPECT_EQ(body.shape().vertices_size(), 0);
  EXPECT_EQ(body.vertex_count(), static_cast<int>(kVertexCount));
  EXPECT_TRUE(messages->front().topologies().empty());

  request_.clear_parts();
  request_.add_parts(v1::SHAPE_PART_VERTICES);
  messages = Ask();
  ASSERT_TRUE(messages.ok()) << messages.status();
  EXPECT_EQ(messages->front().shapes(0).shape().pose_coefficients_size(), 0);
  EXPECT_EQ(messages->front().shapes(0).shape().vertices_size(),
            static_cast<int>(3 * kVertexCount));

  request_.add_parts(static_cast<v1::ShapePart>(77));
  EXPECT_EQ(ReasonOf(Ask().status()), Reason::kFieldInvalid);
}

TEST_F(AgentShape, AnswersWithAHeaderAloneWhereThereIsNoShape) {
  request_.set_from_ns(30 * kSecond);
  auto messages = Ask();
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 1u);
  EXPECT_EQ(messages->front().header().read_revision(), 2);
  EXPECT_EQ(messages->front().agent_id(), "H12");
  EXPECT_EQ(messages->front().shapes_size(), 0);
  request_.set_agent("13");
  messages = Ask();
  ASSERT_TRUE(messages.ok()) << messages.status();
  EXPECT_EQ(messages->front().shapes_size(), 0);
}

TEST_F(AgentShape, ReadsWhatWasBelievedAtARevision) {
  BodyShape corrected = BodyAt(kSecond);
  corrected.shape_coefficients.assign(10, 2.5f);
  GraphDelta delta;
  delta.shapes = {{NodeId('H', 12), std::nullopt, {corrected}}};
  CommitToOffice(folder_.path(), delta);
  request_.set_from_ns(kSecond);
  request_.set_to_ns(kSecond + 1);
  for (const auto& [revision, coefficient] : {std::pair(2, 0.5f), std::pair(3, 2.5f)}) {
    request_.mutable_read_at()->set_exact_revision(revision);
    const auto messages = Ask();
    ASSERT_TRUE(messages.ok()) << messages.status();
    const Messages& all = *messages;
    ASSERT_EQ(TimesOf(all), std::vector<TimeNs>{kSecond});
    EXPECT_EQ(all.back().shapes(0).shape().shape_coefficients(0), coefficient);
  }
  request_.mutable_read_at()->set_exact_revision(1);
  EXPECT_TRUE(TimesOf(*Ask()).empty());
}

TEST_F(AgentShape, RefusesUnknownAgentsAndInvertedIntervals) {
  request_.set_agent("nobody");
  const auto unknown = Ask();
  EXPECT_TRUE(absl::IsNotFound(unknown.status()));
  EXPECT_EQ(ReasonOf(unknown.status()), Reason::kAgentUnknown);
  request_.set_agent("12");
  request_.set_from_ns(5);
  request_.set_to_ns(5);
  EXPECT_EQ(ReasonOf(Ask().status()), Reason::kTimeRangeInverted);
}

TEST_F(AgentShape, StopsAtTheDeadlineAndWhenTheCallerHasEnough) {
  EXPECT_TRUE(
      absl::IsDeadlineExceeded(Ask(CallContext(CallContext::Clock::time_point::min())).status()));
  // Cancelled while the stream is under way.
  core_ = OpenCore(folder_.path());
  CallContext call;
  int count = 0;
  const absl::Status cancelled = query::ReadStream(call, core_->GetAgentShape(call, request_),
                                                   [&](const v1::GetAgentShapeResponse&) {
                                                     call.Cancel();
                                                     ++count;
                                                     return true;
                                                   });
  EXPECT_TRUE(absl::IsCancelled(cancelled)) << cancelled;
  EXPECT_EQ(count, 1);
  const absl::Status enough =
      query::ReadStream(CallContext(), core_->GetAgentShape(CallContext(), request_),
                        [&](const v1::GetAgentShapeResponse&) {
                          ++count;
                          return false;
                        });
  EXPECT_TRUE(enough.ok()) << enough;
  EXPECT_EQ(count, 2);
}

class ShapesAt : public AgentShape {
 protected:
  absl::StatusOr<std::vector<v1::BatchGetShapesResponse>> AskAt(TimeNs at_ns) {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    batch_.set_map(kMap);
    batch_.set_at_ns(at_ns);
    std::vector<v1::BatchGetShapesResponse> messages;
    const absl::Status status = query::ReadStream(
        CallContext(), core_->BatchGetShapes(CallContext(), batch_), [&](const auto& message) {
          messages.push_back(message);
          return true;
        });
    if (!status.ok()) return status;
    return messages;
  }

  v1::BatchGetShapesRequest batch_;
};

TEST_F(ShapesAt, AnInstantAreTheNearestInTimeWithTheFacesFirst) {
  const auto messages = AskAt(3 * kSecond + 200'000'000);
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 2u);
  EXPECT_TRUE(messages->front().has_header());
  ASSERT_EQ(messages->front().topologies_size(), 1);
  // H13 has no body, the robot was not there yet.
  ASSERT_EQ(messages->back().shapes_size(), 1);
  const v1::ShapeOfAgent& body = messages->back().shapes(0);
  EXPECT_EQ(body.agent_id(), "H12");
  EXPECT_EQ(body.shape().shape().time_ns(), 3 * kSecond);
  EXPECT_NEAR(body.shape().pose().position().x(), 4.2, 1e-9);
  EXPECT_EQ(body.shape().quality(), v1::INTERPOLATED);
  EXPECT_EQ(body.shape().topology_sha256(), messages->front().topologies(0).sha256());
  EXPECT_EQ(body.shape().vertex_count(), static_cast<int>(kVertexCount));
}

TEST_F(ShapesAt, AnInstantOfAGapOrWithoutABodyAreNone) {
  // Its track has a gap, though there are bodies; at the end of it there are none.
  for (const TimeNs at_ns : {20 * kSecond, 61 * kSecond}) {
    const auto messages = AskAt(at_ns);
    ASSERT_TRUE(messages.ok()) << messages.status();
    ASSERT_EQ(messages->size(), 1u);
    EXPECT_TRUE(messages->front().has_header());
    EXPECT_EQ(messages->front().shapes_size(), 0);
  }
  batch_.add_agents("nobody");
  EXPECT_EQ(ReasonOf(AskAt(kSecond).status()), Reason::kAgentUnknown);
}

TEST_F(ShapesAt, AnInstantHaveThePartsThatWereAskedFor) {
  batch_.add_agents("12");
  batch_.add_parts(v1::SHAPE_PART_JOINTS);
  const auto messages = AskAt(18 * kSecond);
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 1u);
  ASSERT_EQ(messages->front().shapes_size(), 1);
  EXPECT_EQ(messages->front().shapes(0).shape().shape().joints_size(), 72);
  EXPECT_EQ(messages->front().shapes(0).shape().shape().vertices_size(), 0);
}

}  // namespace
}  // namespace dsg::test
