// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dsg/v1/map_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

const Box3d kUnitBox(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());

Node Lamp(const std::string& name) {
  return MakeNode(NodeId('O', 7), layers::kObjects, kinds::kObject, name, kUnitBox);
}

Edge LampIsOnCup() {
  Edge edge;
  edge.source = NodeId('O', 7);
  edge.relation = relations::kOn;
  edge.target = NodeId('O', 1);
  return edge;
}

MeshBlock Block(int32_t x, float at) {
  MeshBlock block;
  block.index = {x, 0, 0};
  block.positions_map = {{at, 0, 0}, {at, 1, 0}, {at, 0, 1}};
  block.faces = {{0, 1, 2}};
  return block;
}

// Revision 1 is the office; 2 adds the lamp, its edge and two mesh blocks; 3 changes all of them;
// 4 changes them back; 5 takes them away. 6 moves H13's pose at 5 s; 7 appends one to H12.
class Diff : public testing::Test {
 protected:
  Diff() {
    MakeOffice(folder_.path());
    GraphDelta add;
    add.nodes = {Lamp("lamp")};
    add.edges = {LampIsOnCup()};
    add.mesh_blocks = {Block(0, 0.5f), Block(1, 2.5f)};
    CommitToOffice(folder_.path(), add);
    GraphDelta change;
    change.nodes = {Lamp("light")};
    change.edges = {LampIsOnCup()};
    change.edges[0].weight = 0.5;
    change.mesh_blocks = {Block(0, 0.75f)};
    change.mesh_removals = {{1, 0, 0}};
    CommitToOffice(folder_.path(), change);
    CommitToOffice(folder_.path(), add);
    GraphDelta remove;
    remove.retirements = {{NodeId('O', 7), {}}};
    remove.mesh_removals = {{0, 0, 0}, {1, 0, 0}};
    CommitToOffice(folder_.path(), remove);
    GraphDelta correct;
    correct.corrections = {
        {NodeId('H', 13), 5 * kSecond, 6 * kSecond, {PoseAt(5 * kSecond, 3.5, 5, 1)}}};
    CommitToOffice(folder_.path(), correct);
    GraphDelta append;
    append.appends = {{NodeId('H', 12), {PoseAt(63 * kSecond, 19, 5, 1)}}};
    CommitToOffice(folder_.path(), append);
    core_ = OpenCore(folder_.path());
    request_.set_map(kMap);
  }

  // To the newest, unless it is said.
  v1::DiffRevisionsResponse Ask(int64_t from, std::optional<int64_t> to = std::nullopt) {
    request_.set_from_revision(from);
    request_.clear_to_revision();
    if (to.has_value()) request_.set_to_revision(*to);
    v1::DiffRevisionsResponse reply;
    const absl::Status status = core_->DiffRevisions(call_, request_, &reply);
    EXPECT_TRUE(status.ok()) << status;
    return reply;
  }

  absl::Status Fail() {
    v1::DiffRevisionsResponse reply;
    return core_->DiffRevisions(call_, request_, &reply);
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
  v1::DiffRevisionsRequest request_;
};

TEST_F(Diff, ShowsOldAndNew) {
  const auto reply = Ask(2, 3);
  EXPECT_EQ(reply.header().read_revision(), 3);
  EXPECT_EQ(reply.header().head_revision(), 7);
  ASSERT_EQ(reply.nodes_size(), 1);
  EXPECT_EQ(reply.nodes(0).type(), v1::CHANGED);
  EXPECT_EQ(reply.nodes(0).before().name(), "lamp");
  EXPECT_EQ(reply.nodes(0).after().name(), "light");
  ASSERT_EQ(reply.edges_size(), 1);
  EXPECT_EQ(reply.edges(0).before().weight(), 1.0);
  EXPECT_EQ(reply.edges(0).after().weight(), 0.5);
  ASSERT_EQ(reply.mesh_blocks_size(), 2);
  EXPECT_EQ(reply.mesh_blocks(0).type(), v1::CHANGED);
  EXPECT_EQ(reply.mesh_blocks(1).type(), v1::REMOVED);
  EXPECT_EQ(reply.mesh_blocks(1).index().x(), 1);
}

TEST_F(Diff, TurnsAddedAndRemovedRoundWithItsEnds) {
  const auto forward = Ask(1, 2);
  const auto back = Ask(2, 1);
  EXPECT_EQ(back.header().read_revision(), 2);
  ASSERT_EQ(forward.nodes_size(), 1);
  ASSERT_EQ(back.nodes_size(), 1);
  EXPECT_EQ(forward.nodes(0).type(), v1::ADDED);
  EXPECT_FALSE(forward.nodes(0).has_before());
  EXPECT_EQ(back.nodes(0).type(), v1::REMOVED);
  EXPECT_FALSE(back.nodes(0).has_after());
  EXPECT_EQ(back.edges(0).type(), v1::REMOVED);
  EXPECT_EQ(back.mesh_blocks(0).type(), v1::REMOVED);
}

TEST_F(Diff, DoesNotTellWhatCameAndWentOrChangedBack) {
  const auto back_again = Ask(2, 4);
  EXPECT_EQ(back_again.nodes_size() + back_again.edges_size() + back_again.mesh_blocks_size(), 0);
  const auto gone_again = Ask(1, 5);
  EXPECT_EQ(gone_again.nodes_size() + gone_again.edges_size() + gone_again.mesh_blocks_size(), 0);
  const auto nothing = Ask(3, 3);
  EXPECT_EQ(nothing.nodes_size(), 0);
  EXPECT_EQ(nothing.next_page_token(), "");
}

TEST_F(Diff, TellsAppendedFromCorrectedPoses) {
  auto reply = Ask(5, 7);
  ASSERT_EQ(reply.tracks_size(), 2);
  EXPECT_EQ(reply.tracks(0).agent_id(), "H12");
  EXPECT_EQ(reply.tracks(0).pose_count_before(), 22);
  EXPECT_EQ(reply.tracks(0).pose_count_after(), 23);
  EXPECT_EQ(reply.tracks(0).last_pose_ns_before(), 62 * kSecond);
  EXPECT_EQ(reply.tracks(0).last_pose_ns_after(), 63 * kSecond);
  EXPECT_FALSE(reply.tracks(0).corrected());
  EXPECT_EQ(reply.tracks(1).agent_id(), "H13");
  EXPECT_EQ(reply.tracks(1).pose_count_after(), 11);
  EXPECT_TRUE(reply.tracks(1).corrected());
  reply = Ask(6, 5);
  ASSERT_EQ(reply.tracks_size(), 1);
  EXPECT_TRUE(reply.tracks(0).corrected());
  // Before the agent was there, nothing had been told that could be corrected.
  reply = Ask(0, 7);
  ASSERT_EQ(reply.tracks_size(), 3);
  EXPECT_EQ(reply.tracks(1).pose_count_before(), 0);
  EXPECT_FALSE(reply.tracks(1).corrected());
}

TEST_F(Diff, TakesTheNewestRevisionForZero) {
  const auto reply = Ask(6);
  EXPECT_EQ(reply.to_revision(), 7);
  EXPECT_EQ(reply.tracks_size(), 1);
}

TEST_F(Diff, ShowsOnlyWhatTouchesALayer) {
  request_.set_layer("objects");
  auto reply = Ask(1, 2);
  EXPECT_EQ(reply.nodes_size(), 1);
  EXPECT_EQ(reply.edges_size(), 1);
  EXPECT_EQ(reply.mesh_blocks_size(), 0);
  request_.set_layer("rooms");
  reply = Ask(1, 2);
  EXPECT_EQ(reply.nodes_size() + reply.edges_size() + reply.mesh_blocks_size(), 0);
  EXPECT_EQ(Ask(5, 7).tracks_size(), 0);
  request_.set_layer("mesh");
  EXPECT_EQ(Ask(1, 2).mesh_blocks_size(), 2);
  request_.set_layer("agents");
  EXPECT_EQ(Ask(5, 7).tracks_size(), 2);
  EXPECT_EQ(Ask(0, 1).nodes_size(), 3);
}

TEST_F(Diff, ShowsAsMuchOfANodeAsTheViewAsksFor) {
  request_.set_view(v1::NODE_VIEW_BASIC);
  const auto reply = Ask(1, 2);
  ASSERT_EQ(reply.nodes_size(), 1);
  EXPECT_EQ(reply.nodes(0).after().name(), "lamp");
  EXPECT_FALSE(reply.nodes(0).after().has_bounding_box());
}

TEST_F(Diff, KeepsItsRevisionsOverItsPages) {
  request_.set_page_size(1);
  auto page = Ask(1);
  EXPECT_EQ(page.to_revision(), 7);
  ASSERT_NE(page.next_page_token(), "");
  GraphDelta later;
  later.nodes = {Lamp("later")};
  CommitToOffice(folder_.path(), later);
  request_.set_page_token(page.next_page_token());
  page = Ask(1);
  EXPECT_EQ(page.to_revision(), 7);
  EXPECT_EQ(page.header().head_revision(), 8);
  request_.set_from_revision(2);
  EXPECT_EQ(ReasonOf(Fail()), Reason::kPageTokenMismatch);
}

TEST_F(Diff, RefusesWhatItCannotRead) {
  request_.set_from_revision(-1);
  EXPECT_EQ(ReasonOf(Fail()), Reason::kFieldInvalid);
  request_.set_from_revision(1);
  request_.set_to_revision(-2);
  EXPECT_EQ(ReasonOf(Fail()), Reason::kFieldInvalid);
  request_.set_to_revision(99);
  EXPECT_EQ(ReasonOf(Fail()), Reason::kRevisionInFuture);
  EXPECT_EQ(MetadataOf(Fail())["newest"], "7");
  request_.set_to_revision(2);
  request_.set_from_revision(99);
  EXPECT_EQ(ReasonOf(Fail()), Reason::kRevisionInFuture);
  request_.set_from_revision(1);
  request_.set_layer("attics");
  EXPECT_EQ(ReasonOf(Fail()), Reason::kLayerUnknown);
  request_.clear_layer();
  request_.set_view(static_cast<v1::NodeView>(77));
  EXPECT_EQ(ReasonOf(Fail()), Reason::kFieldInvalid);
  request_.set_view(v1::NODE_VIEW_FULL);
  request_.set_page_size(-1);
  EXPECT_EQ(ReasonOf(Fail()), Reason::kFieldInvalid);
  request_.set_page_size(1);
  request_.set_page_token("x");
  EXPECT_EQ(ReasonOf(Fail()), Reason::kPageTokenMismatch);
  request_.clear_page_token();
  request_.set_map("attic");
  EXPECT_EQ(ReasonOf(Fail()), Reason::kMapUnknown);
}

TEST_F(Diff, StopsWhenCancelled) {
  call_.Cancel();
  request_.set_from_revision(1);
  EXPECT_TRUE(absl::IsCancelled(Fail()));
}

TEST_F(Diff, ToTheEmptyMapTellsAllAsGone) {
  const auto reply = Ask(7, 0);
  EXPECT_EQ(reply.to_revision(), 0);
  ASSERT_GT(reply.nodes_size(), 0);
  for (const v1::NodeChange& change : reply.nodes()) EXPECT_EQ(change.type(), v1::REMOVED);
}

}  // namespace
}  // namespace dsg::test
