// SPDX-License-Identifier: Apache-2.0
// Merges of a map that was merged before, into one in which others have written since.
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "schema/base/status.h"
#include "schema/merge/merge.h"
#include "schema/merge/origins.h"
#include "tests/unit/schema/merge/small_map.h"

namespace dsg::merge {
namespace {

using test::kAnna;
using test::MakeAgent;
using test::MakeEdge;
using test::MakeObject;
using test::MakePlace;
using test::MakeRoom;
using test::MakeTrack;
using test::O;
using test::OfNode;
using test::P;
using test::R;
using test::SmallMaps;

Node Widely(Node place) {
  place.box_node = Box3d(Eigen::Vector3d(-9, -9, -2), Eigen::Vector3d(9, 9, 4));
  return place;
}

// Map "a" has a chair and two places; map "b" the same chair, a lamp in the first of two places,
// and Anna. Merged once.
class MergeAgain : public testing::Test {
 protected:
  MergeAgain() {
    GraphDelta a;
    a.nodes = {MakeObject(0, "chair", {1, 1, 0.4}), Widely(MakePlace(0, {1, 2, 0}, 0.8)),
               Widely(MakePlace(1, {4, 2, 0}, 0.8))};
    maps_.Commit("a", std::move(a));
    GraphDelta b;
    b.nodes = {MakeObject(5, "chair", {1.05, 1, 0.4}), MakeObject(6, "lamp", {3, 1, 0.4}),
               Widely(MakePlace(7, {1, 2, 0}, 0.8)), Widely(MakePlace(8, {4, 2, 0}, 0.8)),
               MakeAgent(kAnna, "anna")};
    b.edges = {MakeEdge(P(7), "CONTAINS", O(6)), MakeEdge(O(6), "NEAREST_PLACE", P(7))};
    b.appends = {MakeTrack(kAnna, 0, 12)};
    b.stays = {{kAnna, P(7), {}, 0, 5 * kNsPerSecond}};
    maps_.Commit("b", std::move(b));
    const MergePlan plan = maps_.Merge("a", "b");
    lamp_ = plan.node_ids.at(O(6));
    anna_ = plan.node_ids.at(kAnna);
  }

  void ExpectNothingNew() { EXPECT_EQ(maps_.Write("a", "b", *maps_.Plan("a", "b")), 0); }

  // As a robot that sees it again 2 m further on.
  Node SeenAgain(NodeId id) {
    Node node = maps_.Get("a", id);
    node.revision = 0;
    node.map_T_node.position.x() += 2.0;
    node.observation_count += 16;
    node.last_observed_ns = 5000;
    node.attributes["colour"] = std::string("red");
    return node;
  }

  double XOfAnna(int second) {
    return maps_.Newest("a")->Locate(anna_, second * kNsPerSecond)->map_T_agent.position.x();
  }

  static TrajectoryCorrection Moved(NodeId agent, int second, double x) {
    TrajectoryAppend one = MakeTrack(agent, second * kNsPerSecond, 1);
    one.poses[0].map_T_agent.position.x() = x;
    return {agent, second * kNsPerSecond, (second + 1) * kNsPerSecond, one.poses};
  }

  SmallMaps maps_;
  NodeId lamp_;
  NodeId anna_;
};

TEST_F(MergeAgain, OfTheSameMapChangesNothing) { ExpectNothingNew(); }

TEST_F(MergeAgain, OfTheSameMapChangesNothingOfACopyThatWasSeenAgainHere) {
  maps_.Commit("a", OfNode(SeenAgain(lamp_)));
  ExpectNothingNew();
  const Node lamp = maps_.Get("a", lamp_);
  EXPECT_EQ(lamp.observation_count, 26);
  EXPECT_EQ(lamp.last_observed_ns, 5000);
  EXPECT_TRUE(lamp.attributes.contains("colour"));
}

TEST_F(MergeAgain, OfTheSameMapChangesNothingOfAFusedNodeThatWasSeenAgainHere) {
  maps_.Commit("a", OfNode(SeenAgain(O(0))));
  ExpectNothingNew();
}

TEST_F(MergeAgain, OfALaterRevisionLeavesACopyThatOthersHaveChangedAndSaysSo) {
  maps_.Commit("a", OfNode(SeenAgain(lamp_)));
  maps_.Commit("b", OfNode(MakeObject(6, "lamp", {3.3, 1, 0.4})));
  const MergePlan plan = maps_.Merge("a", "b");
  EXPECT_EQ(plan.counts.kept_count, 1);
  EXPECT_NEAR(maps_.Get("a", lamp_).map_T_node.position.x(), 5.0, 1e-9);
}

TEST_F(MergeAgain, OfALaterRevisionMovesACopyThatOthersHaveOnlyNamed) {
  Node lamp = maps_.Get("a", lamp_);
  lamp.revision = 0;
  lamp.name = "my lamp";
  maps_.Commit("a", OfNode(lamp));
  maps_.Commit("b", OfNode(MakeObject(6, "lamp", {3.3, 1, 0.4})));
  maps_.Merge("a", "b");
  EXPECT_NEAR(maps_.Get("a", lamp_).map_T_node.position.x(), 3.3, 1e-9);
  EXPECT_EQ(maps_.Get("a", lamp_).name, "my lamp");
  ExpectNothingNew();
}

TEST_F(MergeAgain, LeavesTheParentThatOthersHaveGivenACopy) {
  GraphDelta mine;
  mine.edge_removals = {{P(0), "CONTAINS", lamp_}};
  mine.edges = {MakeEdge(P(1), "CONTAINS", lamp_)};
  maps_.Commit("a", std::move(mine));
  ExpectNothingNew();
  EXPECT_TRUE(maps_.Has("a", {P(1), "CONTAINS", lamp_}));
  EXPECT_FALSE(maps_.Has("a", {P(0), "CONTAINS", lamp_}));
}

TEST_F(MergeAgain, BringsNothingBackThatItWroteItselfAndOthersHaveRemoved) {
  const MergePlan plan = *maps_.Plan("a", "b");
  MergeOptions options;
  options.written.nodes = plan.node_ids;
  options.written.edges = {{lamp_, "NEAREST_PLACE", P(0)}};
  GraphDelta mine;
  mine.edge_removals = {{lamp_, "NEAREST_PLACE", P(0)}};
  maps_.Commit("a", std::move(mine));
  auto again = maps_.Plan("a", "b", {}, options);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->graph.empty());
  GraphDelta retire;
  retire.retirements = {{lamp_, std::nullopt}};
  maps_.Commit("a", std::move(retire));
  again = maps_.Plan("a", "b", {}, options);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->counts.added_node_count, 0);
  EXPECT_FALSE(again->node_ids.contains(O(6)));
  EXPECT_EQ(maps_.Write("a", "b", *again), 0);
}

TEST_F(MergeAgain, LeavesPosesThatOthersHaveCorrectedAndCarriesThoseOfTheOtherMap) {
  GraphDelta mine;
  mine.corrections = {Moved(anna_, 3, 33.0), Moved(anna_, 8, 88.0)};
  maps_.Commit("a", std::move(mine));
  ExpectNothingNew();
  GraphDelta theirs;
  theirs.corrections = {Moved(kAnna, 5, 55.0), Moved(kAnna, 8, 80.0)};
  maps_.Commit("b", std::move(theirs));
  maps_.Merge("a", "b");
  EXPECT_NEAR(XOfAnna(3), 33.0, 1e-6);
  EXPECT_NEAR(XOfAnna(5), 55.0, 1e-6);
  EXPECT_NEAR(XOfAnna(8), 88.0, 1e-6);
  EXPECT_EQ(maps_.Newest("a")->GetTrack(anna_)->pose_count, 12);
  ExpectNothingNew();
  // What came by a correction follows the next one.
  GraphDelta later;
  later.corrections = {Moved(kAnna, 5, 50.0)};
  maps_.Commit("b", std::move(later));
  maps_.Merge("a", "b");
  EXPECT_NEAR(XOfAnna(5), 50.0, 1e-6);
  EXPECT_NEAR(XOfAnna(8), 88.0, 1e-6);
}

TEST_F(MergeAgain, LeavesPosesAwayThatOthersHaveForgottenOrAppended) {
  GraphDelta mine;
  mine.corrections = {{anna_, 2 * kNsPerSecond, 6 * kNsPerSecond, {}}};
  mine.appends = {MakeTrack(anna_, 20 * kNsPerSecond, 3)};
  maps_.Commit("a", std::move(mine));
  ExpectNothingNew();
  GraphDelta theirs;
  theirs.appends = {MakeTrack(kAnna, 15 * kNsPerSecond, 3)};
  maps_.Commit("b", std::move(theirs));
  maps_.Merge("a", "b");
  EXPECT_EQ(maps_.Newest("a")->GetTrack(anna_)->pose_count, 12 - 4 + 3);
}

TEST_F(MergeAgain, LeavesStaysThatOthersHaveChanged) {
  GraphDelta mine;
  mine.stays = {{anna_, P(1), {}, 0, 4 * kNsPerSecond}};
  maps_.Commit("a", std::move(mine));
  ExpectNothingNew();
}

TEST_F(MergeAgain, TakesAMapThatWasMadeAnewUnderTheOldNameForAnother) {
  std::filesystem::remove_all(maps_.store()->folder() + "/b");
  GraphDelta b;
  b.nodes = {MakeObject(5, "bed", {50, 1, 0.4}), MakeObject(6, "bed", {60, 1, 0.4}),
             MakeObject(7, "chair", {1.05, 1, 0.4})};
  maps_.Commit("b", std::move(b));
  const MergePlan plan = maps_.Merge("a", "b");
  EXPECT_EQ(plan.counts.added_node_count, 2);
  EXPECT_EQ(maps_.Get("a", lamp_).class_name, "lamp");
  EXPECT_EQ(maps_.Get("a", O(0)).class_name, "chair");
  EXPECT_NEAR(maps_.Get("a", O(0)).map_T_node.position.x(), 1.0, 0.1);
  EXPECT_EQ(plan.node_ids.at(O(7)), O(0));
  // 10 of this map, and 10 of either map of that name.
  EXPECT_EQ(maps_.Get("a", O(0)).observation_count, 30);
  ExpectNothingNew();
}

// The same again where the nodes of the new map are younger than the revision that was merged.
TEST_F(MergeAgain, AsksThePastOfAMapThatMayHaveBeenMadeAnew) {
  std::filesystem::remove_all(maps_.store()->folder() + "/b");
  maps_.Commit("b", OfNode(Widely(MakePlace(40, {100, 2, 0}, 0.8))));
  maps_.Commit("b", OfNode(MakeObject(6, "bed", {50, 1, 0.4})));
  EXPECT_EQ(maps_.Merge("a", "b").counts.added_node_count, 2);
  EXPECT_EQ(maps_.Get("a", lamp_).class_name, "lamp");
}

TEST_F(MergeAgain, KnowsAMapWhosePastIsCompactedAway) {
  maps_.Commit("b", OfNode(MakeObject(6, "lamp", {3.3, 1, 0.4})));
  auto writer = *maps_.store()->OpenWriter("b");
  ASSERT_TRUE(writer->Compact(2, {}, {}).ok());
  writer.reset();
  EXPECT_EQ(maps_.Merge("a", "b").counts.added_node_count, 0);
  EXPECT_NEAR(maps_.Get("a", lamp_).map_T_node.position.x(), 3.3, 1e-9);
  ExpectNothingNew();
}

TEST(MergeBackAndForth, CountsNoObservationTwice) {
  SmallMaps maps;
  maps.Commit("p", OfNode(MakeObject(0, "chair", {0, 0, 0.4})));
  maps.Commit("q", OfNode(MakeObject(0, "lamp", {10, 0, 0.4})));
  for (int round = 0; round < 4; ++round) {
    maps.Merge("p", "q");
    maps.Merge("q", "p");
  }
  for (const char* map : {"p", "q"}) {
    EXPECT_EQ(maps.Get(map, O(0)).observation_count, 10) << map;
    EXPECT_EQ(maps.Get(map, O(1)).observation_count, 10) << map;
  }
}

TEST(MergeBackAndForth, CountsWhatOneThingWasSeenByBoth) {
  SmallMaps maps;
  maps.Commit("p", OfNode(MakeObject(0, "chair", {0, 0, 0.4})));
  maps.Commit("q", OfNode(MakeObject(3, "chair", {0, 0, 0.4})));
  for (int round = 0; round < 4; ++round) {
    maps.Merge("p", "q");
    maps.Merge("q", "p");
  }
  EXPECT_EQ(maps.Get("p", O(0)).observation_count, 20);
  EXPECT_EQ(maps.Get("q", O(3)).observation_count, 20);
}

TEST(MergeAtTheEnd, OfIdsIsRefusedAndNothingIsLost) {
  SmallMaps maps;
  maps.Commit("a", OfNode(MakeObject(NodeId::kIndexMax - 1, "chair", {0, 0, 0.4})));
  maps.Commit("one", OfNode(MakeObject(0, "lamp", {10, 0, 0.4})));
  GraphDelta two;
  two.nodes = {MakeObject(0, "lamp", {10, 0, 0.4}), MakeObject(1, "lamp", {20, 0, 0.4})};
  maps.Commit("two", std::move(two));
  EXPECT_TRUE(maps.Plan("a", "one").ok());
  const absl::Status refused = maps.Plan("a", "two").status();
  EXPECT_EQ(ReasonOf(refused), Reason::kLimitExceeded) << refused;
  EXPECT_EQ(MetadataOf(refused)["id"], ToString(O(NodeId::kIndexMax)));
}

TEST(MergeAtTheEnd, OfInstancesAndClassesTakesNumbersThatAreFree) {
  SmallMaps maps;
  GraphDelta a = OfNode(MakeObject(0, "chair", {0, 0, 0.4}));
  a.labels = {{std::numeric_limits<int32_t>::max(), "chair"}};
  a.nodes[0].class_id = std::numeric_limits<int32_t>::max();
  a.nodes[0].object->mesh_instance_id = std::numeric_limits<uint32_t>::max();
  maps.Commit("a", std::move(a));
  GraphDelta b;
  b.nodes = {MakeObject(0, "lamp", {10, 0, 0.4}), MakeObject(1, "sofa", {20, 0, 0.4})};
  b.labels = {{std::numeric_limits<int32_t>::max(), "lamp"}, {2, "sofa"}};
  b.nodes[0].class_id = std::numeric_limits<int32_t>::max();
  b.nodes[1].class_id = 2;
  b.nodes[0].object->mesh_instance_id = 3;
  b.nodes[1].object->mesh_instance_id = 4;
  maps.Commit("b", std::move(b));
  maps.Merge("a", "b");
  EXPECT_EQ(maps.Get("a", O(1)).object->mesh_instance_id, 1u);
  EXPECT_EQ(maps.Get("a", O(2)).object->mesh_instance_id, 2u);
  EXPECT_EQ(maps.Get("a", O(1)).class_id, 1);
  EXPECT_EQ(maps.Get("a", O(2)).class_id, 2);
}

}  // namespace
}  // namespace dsg::merge
