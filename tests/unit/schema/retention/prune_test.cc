// SPDX-License-Identifier: Apache-2.0
// What each policy takes from a small house, and what it leaves.
#include <gtest/gtest.h>

#include "tests/unit/schema/retention/prune_test_util.h"

namespace dsg::test {
namespace {

using P = PrunePolicy;

class PruneTest : public ::testing::Test {
 protected:
  PruneTest() { FillHouse(&map_); }
  ~PruneTest() override { EXPECT_EQ(map_.Problems(), ""); }

  int64_t PoseCount(NodeId agent) { return OrDie(map_.Latest()->GetTrack(agent)).pose_count; }

  TestMap map_;
};

TEST_F(PruneTest, BranchTakesWhatOnlyItContainsAndTheMeshOfItsRooms) {
  const PrunePlan plan = Prune(&map_, {PolicyOf(P::Branch{"R1"})});
  const auto now = map_.Latest();
  // O3 is in p3 too; people are in no branch.
  EXPECT_EQ(NodesOf(*now), "B1 H1 H2 O2 O3 O5 R2 p3");
  EXPECT_EQ(plan.total.node_count, 5);
  EXPECT_EQ(plan.total.asset_count, 1);
  EXPECT_EQ(plan.total.pose_count, 0);
  EXPECT_EQ(PoseCount(kWalker), 381);
  for (const BlockIndex& index : OrDie(now->MeshBlocks())) EXPECT_GE(index.x, 5);
  EXPECT_EQ(plan.total.mesh_block_count, 30);
  // Its stays were in nothing else.
  const auto stays = OrDie(now->StaysOfAgent(kWalker, kTimeMin, kTimeMax));
  ASSERT_EQ(stays.size(), 1u);
  EXPECT_EQ(stays[0].room, NodeId('R', 2));
  EXPECT_EQ(plan.total.stay_count, 3);
  EXPECT_EQ(plan.total.stay_edit_count, 0);
  // Older revisions know it still.
  EXPECT_EQ(NodesOf(*map_.At(1)), "B1 H1 H2 O1 O2 O3 O4 O5 R1 R2 p1 p2 p3");
}

TEST_F(PruneTest, BranchOfAPlaceLeavesTheRoomInTheStay) {
  const PrunePlan plan = Prune(&map_, {PolicyOf(P::Branch{"p1"})});
  // They are no rows that go.
  EXPECT_EQ(plan.total.stay_count, 0);
  EXPECT_EQ(plan.total.stay_edit_count, 2);
  const auto stays = OrDie(map_.Latest()->StaysOfAgent(kStander, kTimeMin, kTimeMax));
  ASSERT_EQ(stays.size(), 1u);
  EXPECT_EQ(stays[0].room, NodeId('R', 1));
  EXPECT_TRUE(stays[0].place.empty());
  // It is open still: when the track goes on, so does the stay.
  map_.MustCommit(DeltaOfPoses(kStander, {PoseAt(5 * kSecond, 2, 5, 1)}));
  EXPECT_TRUE(OrDie(map_.Latest()->StayAt(kStander, 5 * kSecond)).has_value());
}

TEST_F(PruneTest, TheBranchOfTheOnlyBuildingIsEverythingWhateverStandsOutsideOfIt) {
  map_.MustCommit(DeltaOfNodes({MakeObject(90, "stray", BoxOf(50, 0, 0, 51, 1, 1))}));
  EXPECT_EQ(PlanOf(&map_, {PolicyOf(P::Branch{"B1"})}).all_matching_policy, "test");
  EXPECT_EQ(PlanOf(&map_, {PolicyOf(P::Branch{"R1"})}).all_matching_policy, "");
  EXPECT_EQ(PlanOf(&map_, {PolicyOf(P::Branch{"B1"}, {"objects"})}).all_matching_policy, "");
  map_.MustCommit(DeltaOfNodes({MakeNode({'B', 2}, layers::kBuildings, kinds::kBuilding, "shed",
                                         BoxOf(50, 0, 0, 60, 9, 3))}));
  EXPECT_EQ(PlanOf(&map_, {PolicyOf(P::Branch{"B1"})}).all_matching_policy, "");
}

TEST_F(PruneTest, BranchOfOnlySomeLayersLeavesTheOthers) {
  Prune(&map_, {PolicyOf(P::Branch{"house"}, {"objects"})});
  EXPECT_EQ(NodesOf(*map_.Latest()), "B1 H1 H2 R1 R2 p1 p2 p3");
}

TEST_F(PruneTest, UnknownNodesAndLayersAreErrors) {
  const auto ask = [&](const P& policy) {
    return ReasonOf(PlanPrune(&map_.reader(), *map_.Latest(), {policy}, {}, StopCheck()).status());
  };
  EXPECT_EQ(ask(PolicyOf(P::Branch{"R77"})), Reason::kNodeUnknown);
  EXPECT_EQ(ask(PolicyOf(P::WholeLayer{"attics"})), Reason::kLayerUnknown);
  EXPECT_EQ(ask(PolicyOf(P::Before{0}, {"attics"})), Reason::kLayerUnknown);
  EXPECT_EQ(ask(PolicyOf(P::HistoryBefore{99})), Reason::kRevisionInFuture);
  P erased = PolicyOf(P::Branch{"R77"});
  erased.strength = PruneStrength::kErase;
  EXPECT_EQ(ask(erased), Reason::kNodeUnknown);
}

TEST_F(PruneTest, UnknownBranchAmongOthersMatchesNothing) {
  const PrunePlan plan =
      Prune(&map_, {PolicyOf(P::Branch{"R77"}), PolicyOf(P::WholeLayer{"mesh"})});
  ASSERT_EQ(plan.policies.size(), 2u);
  EXPECT_EQ(plan.policies[0].matched, Amount());
  EXPECT_TRUE(OrDie(map_.Latest()->MeshBlocks()).empty());
}

TEST_F(PruneTest, AgentGoesWithATrackOfSeveralBatches) {
  constexpr NodeId kRunner('H', 3);
  constexpr int64_t kPoseCount = 11'000;
  GraphDelta delta;
  delta.nodes.push_back(OrDie(map_.Latest()->GetNode(kStander)));
  delta.nodes.back().id = kRunner;
  delta.nodes.back().name = "runner";
  TrajectoryAppend run{kRunner, {}};
  for (int64_t i = 0; i < kPoseCount; ++i) {
    TimedPose pose;
    pose.time_ns = i * (kNsPerSecond / 1000);
    run.poses.push_back(pose);
  }
  delta.appends.push_back(std::move(run));
  map_.MustCommit(std::move(delta));
  Prune(&map_, {PolicyOf(P::Before{20 * kSecond})});
  EXPECT_EQ(NodesOf(*map_.Latest()), "B1 H1 O1 O2 O3 O4 R1 R2 p1 p2 p3");
}

TEST_F(PruneTest, RegionTakesNodesPosesShapesAndMeshInside) {
  const Box3d box = BoxOf(0, 0, -1, 4.5, 10, 3);
  const PrunePlan plan = Prune(&map_, {PolicyOf(P::Region{box})});
  const auto now = map_.Latest();
  EXPECT_EQ(NodesOf(*now), "B1 H1 H2 O2 O3 O5 R1 R2 p2 p3");
  // Poses at x <= 4.5: 0.5 + 0.05 i.
  EXPECT_EQ(plan.total.pose_count, 81 + 41);
  EXPECT_EQ(PoseCount(kWalker), 300);
  EXPECT_EQ(PoseCount(kStander), 0);
  EXPECT_TRUE(OrDie(now->VisitsToBox(box, kTimeMin, kTimeMax, StopCheck())).empty());
  EXPECT_EQ(OrDie(now->Shapes(kWalker, kTimeMin, kTimeMax)).size(), 29u);
  // The square from x = 4 to 5 has one triangle with its centre inside.
  const MeshBlock astride = OrDie(now->ReadMeshBlock({2, 0, 0}));
  EXPECT_GT(astride.faces.size(), 0u);
  EXPECT_LT(astride.faces.size(), 8u);
  EXPECT_FALSE(now->ReadMeshBlock({1, 0, 0}).ok());
}

TEST_F(PruneTest, TimeTakesTracksStaysAndWhatEnded) {
  const PrunePlan plan = Prune(&map_, {PolicyOf(P::Before{10 * kSecond})});
  const auto now = map_.Latest();
  // The stander was never seen later; O5 left at 5 s.
  EXPECT_EQ(NodesOf(*now), "B1 H1 O1 O2 O3 O4 R1 R2 p1 p2 p3");
  EXPECT_EQ(PoseCount(kWalker), 281);
  EXPECT_EQ(OrDie(now->GetTrack(kWalker)).first_ns, 10 * kSecond);
  EXPECT_EQ(OrDie(now->Shapes(kWalker, kTimeMin, kTimeMax)).size(), 28u);
  // The one from 9 s to 10 s goes: one of its poses does.
  EXPECT_EQ(OrDie(now->Factors(kWalker, kTimeMin, kTimeMax)).size(), 28u);
  EXPECT_EQ(OrDie(now->StaysOfAgent(kWalker, kTimeMin, kTimeMax)).size(), 2u);
  EXPECT_EQ(plan.total.shape_count, 10);
  EXPECT_EQ(plan.total.factor_count, 10);
  EXPECT_EQ(plan.total.mesh_block_count, 0);
  // Before: all as it was.
  EXPECT_EQ(OrDie(map_.At(1)->Shapes(kWalker, kTimeMin, kTimeMax)).size(), 38u);
  EXPECT_EQ(OrDie(map_.At(1)->Factors(kWalker, kTimeMin, kTimeMax)).size(), 38u);
}

TEST_F(PruneTest, TimeCutsStaysThatBeganBefore) {
  const PrunePlan plan = Prune(&map_, {PolicyOf(P::Before{12 * kSecond})});
  // Of the stander with its stay nothing is left.
  EXPECT_EQ(plan.total.stay_count, 2);
  EXPECT_EQ(plan.total.stay_edit_count, 1);
  const auto stays = OrDie(map_.Latest()->StaysOfAgent(kWalker, kTimeMin, kTimeMax));
  ASSERT_EQ(stays.size(), 2u);
  EXPECT_EQ(stays[0], (Stay{kWalker, NodeId('p', 2), NodeId('R', 1), 12 * kSecond, 19 * kSecond}));
  EXPECT_EQ(stays[1].enter_ns, 19 * kSecond);
  EXPECT_FALSE(OrDie(map_.Latest()->StayAt(kWalker, 12 * kSecond - 1)).has_value());
  EXPECT_EQ(OrDie(map_.At(1)->StaysOfAgent(kWalker, kTimeMin, kTimeMax)).size(), 3u);
  EXPECT_TRUE(PlanOf(&map_, {PolicyOf(P::Before{12 * kSecond})}).IsEmpty());
}

TEST_F(PruneTest, ErasedTimeHasNoStaysInAnyRevision) {
  P policy = PolicyOf(P::Before{12 * kSecond});
  policy.strength = PruneStrength::kErase;
  const PrunePlan plan = Prune(&map_, {policy});
  ASSERT_TRUE(plan.erasure.has_value());
  const auto erased = map_.writer().Erase(*plan.erasure, StopCheck(), Progress());
  ASSERT_TRUE(erased.ok()) << erased.status();
  map_.Close();
  map_.Reopen();
  for (Revision revision = 1; revision <= map_.Latest()->revision(); ++revision) {
    EXPECT_TRUE(OrDie(map_.At(revision)->StaysOfAgent(kWalker, kTimeMin, 12 * kSecond)).empty());
  }
  EXPECT_EQ(OrDie(map_.Latest()->StaysOfAgent(kWalker, kTimeMin, kTimeMax)).size(), 2u);
}

TEST_F(PruneTest, StayThatIsCutLosesARoomThatGoesToo) {
  Prune(&map_, {PolicyOf(P::Before{12 * kSecond}), PolicyOf(P::Branch{"p2"})});
  const auto stays = OrDie(map_.Latest()->StaysOfAgent(kWalker, kTimeMin, kTimeMax));
  ASSERT_EQ(stays.size(), 2u);
  EXPECT_EQ(stays[0], (Stay{kWalker, NodeId(), NodeId('R', 1), 12 * kSecond, 19 * kSecond}));
}

TEST_F(PruneTest, ThinningLeavesStaysWhole) {
  PrunePolicy policy = PolicyOf(P::Before{12 * kSecond});
  policy.simplify_m = 0.05;
  const PrunePlan plan = Prune(&map_, {policy});
  EXPECT_EQ(plan.total.stay_count + plan.total.stay_edit_count, 0);
  EXPECT_EQ(OrDie(map_.Latest()->StaysOfAgent(kWalker, kTimeMin, kTimeMax)).size(), 3u);
}

TEST_F(PruneTest, AgeCountsBackFromTheNewestObservation) {
  const PrunePlan by_age = PlanOf(&map_, {PolicyOf(P::OlderThan{28 * kSecond})});
  const PrunePlan by_time = PlanOf(&map_, {PolicyOf(P::Before{10 * kSecond})});
  EXPECT_EQ(by_age.total, by_time.total);
}

TEST_F(PruneTest, KeepingTheObjectsAndDroppingTheMesh) {
  const std::string nodes = NodesOf(*map_.Latest());
  const PrunePlan plan = Prune(&map_, {PolicyOf(P::WholeLayer{"mesh"})});
  EXPECT_EQ(plan.total.mesh_block_count, std::ssize(OrDie(map_.At(1)->MeshBlocks())));
  EXPECT_TRUE(OrDie(map_.Latest()->MeshBlocks()).empty());
  EXPECT_EQ(NodesOf(*map_.Latest()), nodes);
  EXPECT_TRUE(plan.all_matching_policy.empty());
}

TEST_F(PruneTest, UnseenNodesGoWithWhatTheyContainUnlessThatWasSeen) {
  GraphDelta delta;
  for (const auto& [id, seen_s] : {std::pair(NodeId('p', 1), 1),
                                   {NodeId('p', 2), 2},
                                   {NodeId('p', 3), 3},
                                   {NodeId('O', 4), 4}}) {
    delta.nodes.push_back(OrDie(map_.Latest()->GetNode(id)));
    delta.nodes.back().last_observed_ns = seen_s * kSecond;
  }
  map_.MustCommit(std::move(delta));
  Prune(&map_, {PolicyOf(P::UnseenSince{10 * kSecond}, {"objects", "places"})});
  // p1 and p3 contain chairs seen at 30 s; O3 was in p2 and p3, of which p3 stays.
  EXPECT_EQ(NodesOf(*map_.Latest()), "B1 H1 H2 O1 O2 O3 O5 R1 R2 p1 p3");
}

TEST_F(PruneTest, UnseenThingsDoNotTakeAlongARoomThatHoldsWhatWasNeverLookedFor) {
  // Chairs were seen at 30 s; O3, rooms and places were never looked for.
  Prune(&map_, {PolicyOf(P::UnseenSince{35 * kSecond})});
  EXPECT_EQ(NodesOf(*map_.Latest()), "B1 H1 O3 R1 R2 p2 p3");
}

TEST_F(PruneTest, ThinnedTracksAnswerWithinTheBoundAtDroppedInstants) {
  P policy = PolicyOf(std::monostate());
  policy.simplify_m = 0.05;
  const PrunePlan plan = Prune(&map_, {policy});
  const auto now = map_.Latest();
  EXPECT_LT(PoseCount(kWalker), 30);
  EXPECT_EQ(plan.total.pose_count, 381 + 41 - PoseCount(kWalker) - PoseCount(kStander));
  OrDie(map_.At(1)->ReadPoses(kWalker, kTimeMin, kTimeMax, StopCheck(), [&](const TimedPose& pose) {
    const LocatedPose located = OrDie(now->Locate(kWalker, pose.time_ns));
    EXPECT_NE(located.quality, PoseQuality::kInGap);
    EXPECT_LE((located.map_T_agent.position - pose.map_T_agent.position).norm(), 0.05);
    return true;
  }));
  EXPECT_TRUE(PlanOf(&map_, {policy}).IsEmpty());
}

TEST_F(PruneTest, OverlappingPoliciesCountOnce) {
  const P branch = PolicyOf(P::Branch{"R1"});
  const P region = PolicyOf(P::Region{BoxOf(0, 0, -1, 10, 10, 3)});
  const P time = PolicyOf(P::Before{10 * kSecond});
  const PrunePlan plan = PlanOf(&map_, {branch, region, time});
  ASSERT_EQ(plan.policies.size(), 3u);
  // O3 and the building are inside of the region too.
  EXPECT_EQ(plan.total.node_count, plan.policies[1].matched.node_count + 2);
  EXPECT_EQ(plan.total.pose_count, plan.policies[1].matched.pose_count);
  Prune(&map_, {branch, region, time});
  EXPECT_TRUE(PlanOf(&map_, {region, time}).IsEmpty());
}

TEST_F(PruneTest, SaysWhenAPolicyMatchesEverything) {
  EXPECT_EQ(PlanOf(&map_, {PolicyOf(P::Region{BoxOf(-9, -9, -9, 99, 99, 99)})}).all_matching_policy,
            "test");
  EXPECT_EQ(PlanOf(&map_, {PolicyOf(P::Before{99 * kSecond})}).all_matching_policy, "test");
  EXPECT_EQ(PlanOf(&map_, {PolicyOf(P::Branch{"R1"})}).all_matching_policy, "");
}

TEST_F(PruneTest, CutOffAfterAnyBatchTheSameAgainDoesTheRest) {
  std::vector<P> policies = {PolicyOf(P::Branch{"R1"}), PolicyOf(P::Before{10 * kSecond}),
                             PolicyOf(P::Region{BoxOf(11, 0, -1, 13, 10, 3)})};
  Prune(&map_, policies);
  const std::string whole = ContentOf(*map_.Latest());
  for (int count = 0; count < 4; ++count) {
    TestMap other;
    FillHouse(&other);
    Prune(&other, policies, count);
    // A branch that is gone whole is not known any more.
    const bool is_gone = !other.Latest()->GetNode(NodeId('R', 1)).ok();
    Prune(&other, is_gone ? std::vector<P>(policies.begin() + 1, policies.end()) : policies);
    EXPECT_TRUE(ContentOf(*other.Latest()) == whole) << count << NodesOf(*other.Latest());
  }
}

TEST_F(PruneTest, LeavesAloneWhatOthersChangedMeanwhile) {
  const auto at_plan = map_.Latest();
  const PrunePlan plan = PlanOf(&map_, {PolicyOf(P::Region{BoxOf(0, 0, -1, 9, 10, 3)})});
  PruneBatches batches(at_plan, plan, {kMap, "prune-late", "test", "prune"});
  GraphDelta delta;
  delta.nodes = {OrDie(at_plan->GetNode(NodeId('O', 1)))};
  delta.nodes[0].name = "moved";
  delta.corrections = {{kStander, 0, kSecond, {PoseAt(0, 3, 5, 1)}}};
  map_.MustCommit(std::move(delta));
  batches.Avoid(OrDie(map_.reader().TouchedBetween(1, 2, StopCheck())));
  while (auto next = OrDie(batches.Next(*map_.Latest(), StopCheck()))) {
    OrDie(map_.writer().Commit(*std::move(next)));
  }
  EXPECT_TRUE(map_.Latest()->GetNode(NodeId('O', 1)).ok());
  EXPECT_EQ(PoseCount(kStander), 32);
  EXPECT_FALSE(map_.Latest()->GetNode(NodeId('O', 4)).ok());
  EXPECT_LT(PoseCount(kWalker), 300);
}

TEST_F(PruneTest, EraseFindsWhatIsGoneAlready) {
  Prune(&map_, {PolicyOf(P::Branch{"R1"})});
  P policy = PolicyOf(P::Branch{"R1"});
  policy.strength = PruneStrength::kErase;
  const PrunePlan plan = PlanOf(&map_, {policy});
  EXPECT_TRUE(plan.IsEmpty());
  ASSERT_TRUE(plan.erasure.has_value());
  EXPECT_EQ(plan.erasure->nodes,
            (std::vector<NodeId>{{'O', 1}, {'O', 4}, {'R', 1}, {'p', 1}, {'p', 2}}));
  EXPECT_GE(plan.erasure->mesh_blocks.size(), 30u);
}

TEST_F(PruneTest, HistoryCountsFromTheWallClockAndKeepsTags) {
  for (int i = 0; i < 5; ++i) {
    map_.MustCommit(DeltaOfPoses(kStander, {PoseAt((5 + i) * kSecond, 2, 5, 1)}));
  }
  OrDie(map_.writer().SetTag("keep", 2, ""));
  const PrunePlan by_number = PlanOf(&map_, {PolicyOf(P::HistoryBefore{5})});
  EXPECT_EQ(by_number.keep_from, 5);
  EXPECT_EQ(by_number.total.revision_count, 3);
  const auto plan_at = [&](int64_t wall_now_ns) {
    return OrDie(PlanPrune(&map_.reader(), *map_.Latest(),
                           {PolicyOf(P::HistoryOlderThan{kNsPerSecond})}, {wall_now_ns},
                           StopCheck()));
  };
  EXPECT_EQ(plan_at(WallClockNs() + 3600 * kSecond).keep_from, 6);
  EXPECT_EQ(plan_at(WallClockNs() - 3600 * kSecond).total.revision_count, 0);
}

}  // namespace
}  // namespace dsg::test
