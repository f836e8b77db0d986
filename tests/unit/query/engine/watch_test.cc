// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "dsg/v1/map_service.pb.h"
#include "query/engine/engine.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

using query::CallContext;
using WatchCursor = query::StreamCursor<v1::WatchMapResponse>;

GraphDelta DeltaOfObjects(uint64_t first, uint64_t count) {
  GraphDelta delta;
  const Box3d box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  for (uint64_t i = first; i < first + count; ++i) {
    delta.nodes.push_back(MakeNode(NodeId('O', i), layers::kObjects, kinds::kObject, "thing", box));
  }
  return delta;
}

class WatchTest : public testing::Test {
 protected:
  WatchTest() {
    MakeOffice(folder_.path());
    auto store = GraphStore::Open(folder_.path(), {});
    EXPECT_TRUE(store.ok()) << store.status();
    engine_ = std::make_unique<query::Engine>(*std::move(store));
    request_.set_map(kMap);
  }

  void Commit(uint64_t first, uint64_t count = 1) {
    CommitToOffice(folder_.path(), DeltaOfObjects(first, count));
  }

  void Work(const std::function<absl::Status(MapWriter&)>& work) {
    auto store = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    auto writer = (*store)->OpenWriter(kMap);
    ASSERT_TRUE(writer.ok()) << writer.status();
    const absl::Status done = work(**writer);
    ASSERT_TRUE(done.ok()) << done;
  }

  void Compact(Revision keep_from) {
    Work([&](MapWriter& writer) { return writer.Compact(keep_from, {}, {}).status(); });
  }

  std::unique_ptr<WatchCursor> Open() {
    auto cursor = WatchMap(engine_.get(), call_, request_);
    EXPECT_TRUE(cursor.ok()) << cursor.status();
    return *std::move(cursor);
  }

  v1::WatchMapResponse Next(WatchCursor* cursor) {
    v1::WatchMapResponse message;
    EXPECT_EQ(cursor->Wait().count(), 0);
    const absl::Status status = cursor->Next(call_, &message).status();
    EXPECT_TRUE(status.ok()) << status;
    EXPECT_FALSE(cursor->done());
    return message;
  }

  TempFolder folder_;
  std::unique_ptr<query::Engine> engine_;
  CallContext call_;
  v1::WatchMapRequest request_;
};

TEST_F(WatchTest, SaysAtOnceWhereItBeginsThenWaits) {
  const auto cursor = Open();
  const auto first = Next(cursor.get());
  EXPECT_EQ(first.header().read_revision(), 1);
  EXPECT_EQ(first.header().head_revision(), 1);
  EXPECT_FALSE(first.has_revision());
  EXPECT_FALSE(first.complete());
  const auto wait = cursor->Wait();
  EXPECT_GT(wait.count(), 0);
  EXPECT_LE(wait, std::chrono::milliseconds(100));
}

TEST_F(WatchTest, TellsEachRevisionOnceInOrder) {
  const auto cursor = Open();
  Next(cursor.get());
  for (uint64_t i = 0; i < 100; ++i) Commit(100 + i);
  for (Revision r = 2; r <= 101; ++r) {
    const auto message = Next(cursor.get());
    EXPECT_EQ(message.revision().revision(), r);
    EXPECT_EQ(message.revision().digest().size(), 32u);
    EXPECT_EQ(message.header().read_revision(), r);
    EXPECT_EQ(message.header().head_revision(), 101);
    EXPECT_TRUE(message.complete());
    EXPECT_FALSE(message.has_changes());
  }
  EXPECT_GT(cursor->Wait().count(), 0);
}

TEST_F(WatchTest, GoesOnFromTheRevisionThatTheCallerKnows) {
  for (uint64_t i = 0; i < 5; ++i) Commit(100 + i);
  request_.set_after_revision(3);
  const auto cursor = Open();
  EXPECT_EQ(Next(cursor.get()).revision().revision(), 4);
  EXPECT_EQ(Next(cursor.get()).revision().revision(), 5);
  EXPECT_EQ(Next(cursor.get()).revision().revision(), 6);
  EXPECT_GT(cursor->Wait().count(), 0);
}

TEST_F(WatchTest, SendsALargeRevisionInPiecesThatCanBeBegunAgain) {
  request_.set_changes(true);
  request_.set_view(v1::NODE_VIEW_BASIC);
  const auto cursor = Open();
  Next(cursor.get());
  Commit(1000, 2500);
  int node_count = 0;
  v1::WatchMapResponse message;
  int piece_count = 0;
  do {
    message = Next(cursor.get());
    ++piece_count;
    node_count += message.changes().nodes_size();
    EXPECT_EQ(message.revision().revision(), 2);
    EXPECT_EQ(message.changes().from_revision(), 1);
    EXPECT_EQ(message.changes().to_revision(), 2);
    EXPECT_EQ(message.header().read_revision(), message.complete() ? 2 : 1);
  } while (!message.complete() && piece_count < 10);
  EXPECT_EQ(piece_count, 3);
  EXPECT_EQ(node_count, 2500);
  EXPECT_FALSE(message.changes().nodes(0).after().has_bounding_box());
}

TEST_F(WatchTest, SaysWhereToBeginAgainWhenItsStartWasCompacted) {
  for (uint64_t i = 0; i < 8; ++i) Commit(100 + i);
  Compact(5);
  request_.set_after_revision(3);
  const auto refused = WatchMap(engine_.get(), call_, request_);
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kRevisionCompacted);
  EXPECT_EQ(MetadataOf(refused.status())["oldest"], "5");
  EXPECT_EQ(MetadataOf(refused.status())["newest"], "9");
  // Revision 5 can be read, so what follows it can be told.
  request_.set_after_revision(5);
  EXPECT_EQ(Next(Open().get()).revision().revision(), 6);
}

TEST_F(WatchTest, SaysWhereToBeginAgainWhenCompactionOvertakesIt) {
  const auto cursor = Open();
  Next(cursor.get());
  for (uint64_t i = 0; i < 8; ++i) Commit(100 + i);
  Compact(6);
  v1::WatchMapResponse message;
  const absl::Status status = cursor->Next(call_, &message).status();
  EXPECT_EQ(ReasonOf(status), Reason::kRevisionCompacted);
  EXPECT_EQ(MetadataOf(status)["newest"], "9");
}

TEST_F(WatchTest, TellsATaggedRevisionThatIsLeftThenWhereToBeginAgain) {
  const auto cursor = Open();
  Next(cursor.get());
  for (uint64_t i = 0; i < 8; ++i) Commit(100 + i);
  Work([](MapWriter& writer) { return writer.SetTag("two", 2, "").status(); });
  Compact(6);
  EXPECT_EQ(Next(cursor.get()).revision().revision(), 2);
  v1::WatchMapResponse message;
  EXPECT_EQ(ReasonOf(cursor->Next(call_, &message).status()), Reason::kRevisionCompacted);
}

TEST_F(WatchTest, EndsWhenThePastIsErased) {
  const auto cursor = Open();
  Next(cursor.get());
  Commit(100);
  GraphDelta gone;
  gone.retirements = {{NodeId('O', 100), std::nullopt}};
  CommitToOffice(folder_.path(), gone);
  Work([](MapWriter& writer) {
    return writer.Erase({.nodes = {NodeId('O', 100)}}, {}, {}).status();
  });
  EXPECT_EQ(cursor->Wait().count(), 0);
  v1::WatchMapResponse message;
  EXPECT_EQ(ReasonOf(cursor->Next(call_, &message).status()), Reason::kMapReplaced);
}

TEST_F(WatchTest, RefusesFieldsOutOfRange) {
  request_.set_after_revision(-1);
  EXPECT_EQ(ReasonOf(WatchMap(engine_.get(), call_, request_).status()), Reason::kFieldInvalid);
  request_.set_after_revision(2);
  EXPECT_EQ(ReasonOf(WatchMap(engine_.get(), call_, request_).status()), Reason::kRevisionInFuture);
  request_.clear_after_revision();
  for (const int64_t idle_ns : {int64_t{-1}, int64_t{1}, int64_t{99'999'999}}) {
    request_.set_idle_period_ns(idle_ns);
    EXPECT_EQ(ReasonOf(WatchMap(engine_.get(), call_, request_).status()), Reason::kFieldInvalid);
  }
  request_.set_idle_period_ns(INT64_MAX);
  Next(Open().get());
  request_.set_map("attic");
  EXPECT_EQ(ReasonOf(WatchMap(engine_.get(), call_, request_).status()), Reason::kMapUnknown);
}

TEST_F(WatchTest, InProcessEndsWhenItsCallerHasEnough) {
  const auto core = OpenCore(folder_.path());
  int message_count = 0;
  request_.set_idle_period_ns(100'000'000);
  const absl::Status status = query::ReadStream(call_, core->WatchMap(call_, request_),
                                                [&](const v1::WatchMapResponse& message) {
                                                  EXPECT_TRUE(message.has_header());
                                                  return ++message_count < 3;
                                                });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(message_count, 3);
}

TEST_F(WatchTest, InProcessEndsWhenCancelledWhileItWaits) {
  const auto core = OpenCore(folder_.path());
  std::thread canceller;
  const absl::Status status =
      query::ReadStream(call_, core->WatchMap(call_, request_), [&](const v1::WatchMapResponse&) {
        // The next message would come in five seconds.
        canceller = std::thread([&] { call_.Cancel(); });
        return true;
      });
  canceller.join();
  EXPECT_TRUE(absl::IsCancelled(status));
}

}  // namespace
}  // namespace dsg::test
