// SPDX-License-Identifier: Apache-2.0
// A merge whose map others write at the same time.
#include <gtest/gtest.h>

#include "schema/base/status.h"
#include "schema/merge/merge.h"
#include "schema/merge/merge_deltas.h"
#include "tests/unit/schema/merge/small_map.h"

namespace dsg::merge {
namespace {

using test::kAnna;
using test::MakeAgent;
using test::MakeObject;
using test::MakeTrack;
using test::O;
using test::OfNode;
using test::SmallMaps;

MeshBlock Triangle(float x) {
  MeshBlock block;
  block.positions_map = {{x, 0.1f, 0.1f}, {x + 0.1f, 0.1f, 0.1f}, {x, 0.2f, 0.1f}};
  block.faces = {{0, 1, 2}};
  return block;
}

// Map "a" has a chair, a walk of Anna and a triangle; map "b" the same chair, a lamp, more of
// Anna's walk and another triangle in the same block.
class MergeFollow : public testing::Test {
 protected:
  MergeFollow() {
    GraphDelta a;
    a.nodes = {MakeObject(0, "chair", {1, 1, 0.4}), MakeAgent(kAnna, "anna")};
    a.appends = {MakeTrack(kAnna, 0, 5)};
    a.mesh_blocks = {Triangle(0.1f)};
    maps_.Commit("a", std::move(a));
    GraphDelta b;
    b.nodes = {MakeObject(0, "chair", {1.05, 1, 0.4}), MakeObject(1, "lamp", {3, 1, 0.4}),
               MakeAgent(kAnna, "anna")};
    b.appends = {MakeTrack(kAnna, 100 * kNsPerSecond, 5)};
    b.mesh_blocks = {Triangle(0.7f)};
    maps_.Commit("b", std::move(b));
    const auto plan = maps_.Plan("a", "b");
    EXPECT_TRUE(plan.ok()) << plan.status();
    fresh_ = plan->node_ids.at(O(1));
    deltas_.emplace(maps_.Newest("a"), maps_.Newest("b"), *plan, "test");
  }

  /// Commits to "a" as somebody else, and tells the merge.
  absl::StatusOr<bool> Meanwhile(GraphDelta delta) {
    const Revision before = maps_.Newest("a")->revision();
    maps_.Commit("a", std::move(delta));
    const auto reader = *maps_.store()->OpenMap("a");
    const auto head = *reader->Latest();
    return deltas_->Follow(head, *reader->TouchedBetween(before, head->revision(), {}));
  }

  /// The next delta that has a mesh.
  MeshBlock NextMesh() {
    for (;;) {
      auto delta = deltas_->Next({});
      EXPECT_TRUE(delta.ok() && delta->has_value());
      if (!delta.ok() || !delta->has_value()) return {};
      if (!(*delta)->mesh_blocks.empty()) return (*delta)->mesh_blocks.front();
    }
  }

  SmallMaps maps_;
  NodeId fresh_;
  std::optional<MergeDeltas> deltas_;
};

TEST_F(MergeFollow, GoesOnWhenOthersWroteWhatItDoesNotTouch) {
  EXPECT_TRUE(*Meanwhile(OfNode(MakeObject(70, "cup", {1, 3, 0.4}))));
}

TEST_F(MergeFollow, NeedsANewPlanWhenOthersWroteWhatItIsToWrite) {
  EXPECT_FALSE(*Meanwhile(OfNode(MakeObject(0, "chair", {1, 1.1, 0.4}))));
}

TEST_F(MergeFollow, NeedsANewPlanWhenOthersTookAnIdThatItChose) {
  EXPECT_FALSE(*Meanwhile(OfNode(MakeObject(fresh_.index(), "cup", {1, 3, 0.4}))));
}

TEST_F(MergeFollow, DoesNotMindWhatItHasWritten) {
  ASSERT_TRUE(deltas_->Next({}).ok());
  EXPECT_TRUE(*Meanwhile(OfNode(MakeObject(0, "chair", {1, 1.1, 0.4}))));
}

TEST_F(MergeFollow, TakesMeshThatOthersWroteAsItIsNow) {
  GraphDelta delta;
  delta.mesh_blocks = {Triangle(0.4f)};
  ASSERT_TRUE(*Meanwhile(std::move(delta)));
  const MeshBlock block = NextMesh();
  ASSERT_EQ(block.positions_map.size(), 6u);
  EXPECT_FLOAT_EQ(block.positions_map[0].x(), 0.4f);
  EXPECT_FLOAT_EQ(block.positions_map[3].x(), 0.7f);
}

TEST_F(MergeFollow, LeavesMeshAwayThatOthersRemoved) {
  GraphDelta delta;
  delta.mesh_removals = {BlockIndex{0, 0, 0}};
  ASSERT_TRUE(*Meanwhile(std::move(delta)));
  EXPECT_EQ(NextMesh().positions_map.size(), 3u);
}

TEST_F(MergeFollow, RefusesToMixATrackThatIsBeingWritten) {
  ASSERT_TRUE(deltas_->Next({}).ok());
  GraphDelta delta;
  delta.appends = {MakeTrack(kAnna, 102 * kNsPerSecond, 1)};
  const auto follows = Meanwhile(std::move(delta));
  EXPECT_EQ(ReasonOf(follows.status()), Reason::kParentRevisionStale) << follows.status();
  EXPECT_NE(std::string(follows.status().message()).find("anna"), std::string::npos);
}

}  // namespace
}  // namespace dsg::merge
