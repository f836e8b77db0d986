// SPDX-License-Identifier: Apache-2.0
// Tags, compaction, reverts and archives as the service has them. What a revert restores is in
// tests/property/revert_test.cc.
#include <gtest/gtest.h>

#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/maps.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

using query::CallContext;

GraphDelta DeltaOfObject(uint64_t index) {
  GraphDelta delta;
  delta.nodes = {MakeNode(NodeId('O', index), layers::kObjects, kinds::kObject, "thing",
                          Box3d(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()))};
  return delta;
}

class MaintenanceTest : public testing::Test {
 protected:
  MaintenanceTest() {
    MakeOffice(folder_.path());
    for (uint64_t i = 0; i < 9; ++i) CommitToOffice(folder_.path(), DeltaOfObject(100 + i));
    core_ = OpenCore(folder_.path());
  }

  // No revision stands for the newest.
  absl::StatusOr<v1::Tag> SetTag(const std::string& name, std::optional<Revision> revision,
                                 const std::string& map = kMap,
                                 std::optional<std::string> note = std::nullopt) {
    v1::SetTagRequest request;
    request.set_map(map);
    request.set_name(name);
    if (revision.has_value()) request.set_revision(*revision);
    if (note.has_value()) request.set_note(*note);
    v1::SetTagResponse reply;
    DSG_RETURN_IF_ERROR(core_->SetTag(call_, request, &reply));
    return reply.tag();
  }

  absl::Status RemoveTag(const std::string& name) {
    v1::RemoveTagRequest request;
    request.set_map(kMap);
    request.set_name(name);
    v1::RemoveTagResponse reply;
    return core_->RemoveTag(call_, request, &reply);
  }

  absl::StatusOr<v1::CompactResponse> Compact(std::optional<Revision> keep_from) {
    v1::CompactRequest request;
    request.set_map(kMap);
    if (keep_from.has_value()) request.set_keep_from_revision(*keep_from);
    v1::CompactResponse last;
    DSG_RETURN_IF_ERROR(query::ReadStream(call_, core_->Compact(call_, request),
                                          [&](const v1::CompactResponse& message) {
                                            EXPECT_GE(message.progress(), last.progress());
                                            last = message;
                                            return true;
                                          }));
    return last;
  }

  // The read revision of a question.
  absl::StatusOr<Revision> ReadAtTag(const std::string& tag) {
    v1::GetNodeRequest request;
    request.set_map(kMap);
    request.set_id("R1");
    request.mutable_read_at()->set_tag(tag);
    v1::GetNodeResponse reply;
    DSG_RETURN_IF_ERROR(core_->GetNode(call_, request, &reply));
    return reply.header().read_revision();
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  CallContext call_;
};

TEST(MapTable, OpensAMapAgainOnceItsPastWasErased) {
  const TempFolder folder;
  MakeOffice(folder.path());
  GraphDelta gone;
  gone.retirements = {{NodeId('O', 2), std::nullopt}};
  CommitToOffice(folder.path(), gone);
  query::MapTable maps(*GraphStore::Open(folder.path(), {}));
  const auto before = maps.Reader(kMap);
  ASSERT_TRUE(before.ok());
  EXPECT_EQ(*maps.Reader(kMap), *before);
  const absl::Status erased = maps.WithWriter(kMap, {}, [](MapWriter& writer) {
    return writer.Erase({.nodes = {NodeId('O', 2)}}, {}, {}).status();
  });
  ASSERT_TRUE(erased.ok()) << erased;
  const auto after = maps.Reader(kMap);
  ASSERT_TRUE(after.ok());
  EXPECT_NE(*after, *before);
  const auto snapshot = (*after)->Latest();
  EXPECT_TRUE((*snapshot)->GetNode(NodeId('O', 1)).ok());
}

TEST_F(MaintenanceTest, ATagIsSetMovedListedAndTakenAway) {
  EXPECT_EQ(SetTag("start", 3)->revision(), 3);
  EXPECT_EQ(SetTag("now", std::nullopt)->revision(), 10);
  EXPECT_EQ(SetTag("start", 4)->revision(), 4);
  v1::ListTagsRequest request;
  request.set_map(kMap);
  v1::ListTagsResponse reply;
  ASSERT_TRUE(core_->ListTags(call_, request, &reply).ok());
  ASSERT_EQ(reply.tags_size(), 2);
  EXPECT_EQ(reply.tags(0).name(), "now");
  EXPECT_EQ(reply.tags(1).revision(), 4);
  EXPECT_TRUE(RemoveTag("now").ok());
  EXPECT_EQ(ReasonOf(RemoveTag("now")), Reason::kTagUnknown);
}

TEST_F(MaintenanceTest, ATagThatMovesKeepsItsNoteUnlessItGetsAnother) {
  EXPECT_EQ(SetTag("start", 3, kMap, "before moving")->note(), "before moving");
  EXPECT_EQ(SetTag("start", 4)->note(), "before moving");
  EXPECT_EQ(SetTag("start", 5, kMap, "")->note(), "");
}

// The empty map is a revision like others, and not "the newest".
TEST_F(MaintenanceTest, RevisionZeroIsTheFirst) {
  EXPECT_EQ(SetTag("empty", 0)->revision(), 0);
  const auto done = Compact(0);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->oldest_revision(), 0);
  EXPECT_EQ(done->revision_count(), 0);
}

TEST_F(MaintenanceTest, TagsThatCannotBeAreRefused) {
  EXPECT_EQ(ReasonOf(SetTag("7", 3).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(SetTag("", 3).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(SetTag("start", -1).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(SetTag("start", 11).status()), Reason::kRevisionInFuture);
  EXPECT_EQ(ReasonOf(SetTag("start", 1, "attic").status()), Reason::kMapUnknown);
  EXPECT_EQ(ReasonOf(SetTag("start", 1, "../x").status()), Reason::kMapNameInvalid);
}

TEST_F(MaintenanceTest, AQuestionIsAskedAtATag) {
  ASSERT_TRUE(SetTag("start", 3).ok());
  EXPECT_EQ(*ReadAtTag("start"), 3);
  EXPECT_EQ(ReasonOf(ReadAtTag("end").status()), Reason::kTagUnknown);
}

TEST_F(MaintenanceTest, CompactionKeepsTagsAndTheRest) {
  ASSERT_TRUE(SetTag("start", 3).ok());
  const auto done = Compact(8);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_TRUE(done->done());
  EXPECT_EQ(done->progress(), 1.0);
  EXPECT_EQ(done->oldest_revision(), 8);
  EXPECT_EQ(done->revision_count(), 6);
  EXPECT_EQ(*ReadAtTag("start"), 3);
  EXPECT_EQ(ReasonOf(SetTag("gone", 5).status()), Reason::kRevisionCompacted);
  EXPECT_EQ(ReasonOf(Compact(11).status()), Reason::kRevisionInFuture);
  EXPECT_EQ(ReasonOf(Compact(-1).status()), Reason::kFieldInvalid);
  // All but the newest, and again.
  EXPECT_EQ(Compact(std::nullopt)->oldest_revision(), 10);
  EXPECT_EQ(Compact(std::nullopt)->revision_count(), 0);
}

TEST_F(MaintenanceTest, CommitsGetBetweenTheSlicesOfACompaction) {
  v1::CompactRequest request;
  request.set_map(kMap);
  request.set_keep_from_revision(5);
  const auto cursor = core_->Compact(call_, request);
  ASSERT_TRUE(cursor.ok());
  ASSERT_TRUE(SetTag("between", std::nullopt).ok());
  v1::CompactResponse message;
  do {
    message.Clear();
    ASSERT_TRUE((*cursor)->Next(call_, &message).ok());
  } while (!(*cursor)->done());
  EXPECT_EQ(message.oldest_revision(), 5);
}

TEST_F(MaintenanceTest, WorkThatIsCancelledEnds) {
  call_.Cancel();
  EXPECT_TRUE(absl::IsCancelled(Compact(5).status()));
  EXPECT_TRUE(absl::IsCancelled(SetTag("start", 3).status()));
  v1::RevertRequest revert;
  revert.set_map(kMap);
  revert.set_revision(1);
  EXPECT_TRUE(absl::IsCancelled(query::ReadStream(call_, core_->Revert(call_, revert),
                                                  [](const v1::RevertResponse&) { return true; })));
}

TEST_F(MaintenanceTest, AnotherWriterIsNamed) {
  auto store = GraphStore::Open(folder_.path(), {.program = "the other"});
  const auto writer = (*store)->OpenWriter(kMap);
  ASSERT_TRUE(writer.ok());
  const absl::Status refused = Compact(5).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kWriterLocked);
  EXPECT_NE(std::string(refused.message()).find("the other"), std::string::npos);
  EXPECT_EQ(ReasonOf(SetTag("start", 3).status()), Reason::kWriterLocked);
}

TEST_F(MaintenanceTest, RevertTellsFirstWhatItWillDo) {
  v1::RevertRequest request;
  request.set_map(kMap);
  request.set_revision(4);
  request.set_dry_run(true);
  v1::RevertResponse message;
  ASSERT_TRUE(
      query::ReadStream(call_, core_->Revert(call_, request), [&](const v1::RevertResponse& reply) {
        message = reply;
        return true;
      }).ok());
  EXPECT_TRUE(message.done());
  EXPECT_EQ(message.revision(), 0);
  EXPECT_EQ(message.removed().node_count(), 6);
  EXPECT_EQ(message.added().node_count(), 0);
  request.set_tag("none");
  EXPECT_EQ(ReasonOf(query::ReadStream(call_, core_->Revert(call_, request),
                                       [](const auto&) { return true; })),
            Reason::kTagUnknown);
  request.clear_to();
  EXPECT_EQ(ReasonOf(query::ReadStream(call_, core_->Revert(call_, request),
                                       [](const auto&) { return true; })),
            Reason::kFieldInvalid);
  request.set_revision(11);
  EXPECT_EQ(ReasonOf(query::ReadStream(call_, core_->Revert(call_, request),
                                       [](const auto&) { return true; })),
            Reason::kRevisionInFuture);
}

TEST_F(MaintenanceTest, AnArchiveComesInPiecesThatFitAMessage) {
  v1::ReadArchiveRequest request;
  request.set_map(kMap);
  std::string bytes;
  double progress = 0.0;
  ASSERT_TRUE(query::ReadStream(call_, core_->ReadArchive(call_, request),
                                [&](const v1::ReadArchiveResponse& message) {
                                  EXPECT_LE(message.content().size(), size_t{1} << 20);
                                  bytes += message.content();
                                  progress = message.progress();
                                  return true;
                                })
                  .ok());
  EXPECT_EQ(progress, 1.0);
  EXPECT_EQ(bytes.substr(0, 4), "DSGZ");
  request.set_map("attic");
  EXPECT_EQ(ReasonOf(query::ReadStream(call_, core_->ReadArchive(call_, request),
                                       [](const auto&) { return true; })),
            Reason::kMapUnknown);
}

}  // namespace
}  // namespace dsg::test
