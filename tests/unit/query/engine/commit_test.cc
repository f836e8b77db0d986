// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class CommitCall : public testing::Test {
 protected:
  CommitCall() {
    MakeOffice(folder_.path());
    core_ = OpenCore(folder_.path());
  }

  // A delta that adds one pose of the robot.
  static v1::CommitRequest OnePose(const std::string& session, int64_t sequence, TimeNs at_ns) {
    GraphDelta delta;
    delta.map = kMap;
    delta.session_id = session;
    delta.sequence = sequence;
    delta.appends = {{NodeId('r', 1), {PoseAt(at_ns, 1, 2, 0)}}};
    v1::CommitRequest request;
    ToProto(delta, LayerTable(), request.mutable_delta());
    return request;
  }

  absl::StatusOr<v1::CommitResponse> Commit(const v1::CommitRequest& request) {
    v1::CommitResponse reply;
    const absl::Status status = core_->Commit(call_, request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
};

TEST_F(CommitCall, AppliesADeltaAndAnswersARepeatWithTheFirstAnswer) {
  const v1::CommitRequest request = OnePose("s", 1, 10 * kSecond);
  const auto first = Commit(request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->revision(), 2);
  EXPECT_FALSE(first->replayed());
  const auto again = Commit(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision(), 2);
  EXPECT_TRUE(again->replayed());
}

TEST_F(CommitCall, DoesNotBelieveAClientThatSaysThatItForgets) {
  core_.reset();
  auto store = GraphStore::Open(folder_.path(), {.quota_bytes = 1});
  ASSERT_TRUE(store.ok()) << store.status();
  core_ = query::MakeServiceCore(*std::move(store));
  v1::CommitRequest request = OnePose("s", 1, 10 * kSecond);
  for (int64_t i = 0; i < 5'000; ++i) {
    auto* const pose = request.mutable_delta()->mutable_appends(0)->add_poses();
    pose->CopyFrom(request.delta().appends(0).poses(0));
    pose->set_time_ns((11 + i) * kSecond);
  }
  // What forgets may go past the quota.
  request.mutable_delta()->set_is_forgetting(true);
  EXPECT_EQ(ReasonOf(Commit(request).status()), Reason::kQuotaExceeded);
}

TEST_F(CommitCall, GoesToTheMapThatIsInTheFolderAlsoAfterARestore) {
  const std::string map = folder_.path() + "/" + kMap;
  TempFolder elsewhere;
  const std::string copy = elsewhere.path() + "/copy";
  std::filesystem::copy(map, copy);
  ASSERT_TRUE(Commit(OnePose("s", 1, 10 * kSecond)).ok());
  std::filesystem::remove_all(map);
  std::filesystem::copy(copy, map);
  const auto again = Commit(OnePose("s", 1, 10 * kSecond));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision(), 2);
  // The restored map had not seen it, and what was acknowledged is in the folder.
  EXPECT_FALSE(again->replayed());
  core_.reset();
  const auto store = GraphStore::Open(folder_.path(), {});
  ASSERT_TRUE(store.ok()) << store.status();
  const auto reader = (*store)->OpenMap(kMap);
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ((*reader)->Head()->revision, 2);
}

TEST_F(CommitCall, IsSeenByTheNextQuestion) {
  ASSERT_TRUE(Commit(OnePose("s", 1, 10 * kSecond)).ok());
  v1::LocateAgentRequest question;
  question.set_map(kMap);
  question.set_agent("spot");
  question.set_at_ns(10 * kSecond);
  v1::LocateAgentResponse reply;
  const absl::Status status = core_->LocateAgent(call_, question, &reply);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(reply.header().read_revision(), 2);
  EXPECT_EQ(reply.pose().position().y(), 2.0);
}

TEST_F(CommitCall, TellsHowFarASessionGot) {
  ASSERT_TRUE(Commit(OnePose("s", 1, 10 * kSecond)).ok());
  ASSERT_TRUE(Commit(OnePose("s", 2, 11 * kSecond)).ok());
  v1::GetSessionRequest request;
  request.set_map(kMap);
  request.set_session_id("s");
  v1::GetSessionResponse reply;
  ASSERT_TRUE(core_->GetSession(call_, request, &reply).ok());
  EXPECT_EQ(reply.last_sequence(), 2);
  EXPECT_EQ(reply.last_revision(), 3);
  request.set_session_id("unknown");
  ASSERT_TRUE(core_->GetSession(call_, request, &reply).ok());
  EXPECT_EQ(reply.last_sequence(), 0);
  request.clear_session_id();
  EXPECT_EQ(ReasonOf(core_->GetSession(call_, request, &reply)), Reason::kFieldInvalid);
}

TEST_F(CommitCall, RefusesDeltasWithoutIdentityOrOrder) {
  EXPECT_EQ(ReasonOf(Commit(OnePose("", 1, 10 * kSecond)).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(Commit(OnePose("s", 0, 10 * kSecond)).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(Commit(OnePose("s", 5, 10 * kSecond)).status()), Reason::kSequenceGap);
  v1::CommitRequest request = OnePose("s", 1, 10 * kSecond);
  request.mutable_delta()->set_parent_revision(0);
  EXPECT_EQ(ReasonOf(Commit(request).status()), Reason::kParentRevisionStale);
  request.mutable_delta()->set_map("../x");
  EXPECT_EQ(ReasonOf(Commit(request).status()), Reason::kMapNameInvalid);
}

TEST_F(CommitCall, IsRefusedWhileAnotherWriterHoldsTheMapAndWorksOnceItIsGone) {
  {
    const auto store = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    const auto writer = (*store)->OpenWriter(kMap);
    ASSERT_TRUE(writer.ok()) << writer.status();
    EXPECT_EQ(ReasonOf(Commit(OnePose("s", 1, 10 * kSecond)).status()), Reason::kWriterLocked);
  }
  EXPECT_TRUE(Commit(OnePose("s", 1, 10 * kSecond)).ok());
}

TEST_F(CommitCall, TakesCommitsOfManyThreadsOneAfterTheOther) {
  std::vector<std::thread> threads;
  std::vector<absl::Status> statuses(4);
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      for (int64_t sequence = 1; sequence <= 5; ++sequence) {
        v1::CommitRequest request;
        request.mutable_delta()->set_map(kMap);
        request.mutable_delta()->set_session_id("thread" + std::to_string(i));
        request.mutable_delta()->set_sequence(sequence);
        v1::SemanticLabel* label = request.mutable_delta()->add_labels();
        label->set_id(100 * i + static_cast<int>(sequence));
        label->set_name("label");
        v1::CommitResponse reply;
        const absl::Status status = core_->Commit(query::CallContext(), request, &reply);
        if (!status.ok()) statuses[static_cast<size_t>(i)] = status;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const absl::Status& status : statuses) EXPECT_TRUE(status.ok()) << status;
  v1::GetSessionRequest request;
  request.set_map(kMap);
  request.set_session_id("thread3");
  v1::GetSessionResponse reply;
  ASSERT_TRUE(core_->GetSession(call_, request, &reply).ok());
  EXPECT_EQ(reply.last_sequence(), 5);
}

}  // namespace
}  // namespace dsg::test
