// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/merge.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/merge/origins.h"
#include "schema/merge/refine.h"
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
using test::P;
using test::R;
using test::SmallMaps;

// Room R0 with place p0 at (1, 1), which holds the chair O0; cup O1 on table O2.
GraphDelta Home() {
  GraphDelta delta;
  delta.nodes = {MakeObject(0, "chair", {1, 1, 0.4}), MakeObject(1, "cup", {3, 3, 1.0}, 0.1),
                 MakeObject(2, "table", {3, 3, 0.4}, 0.8), MakePlace(0, {1, 2, 0}, 0.8),
                 MakeRoom(0, {0, 0, 0}, {5, 5, 3})};
  delta.nodes[3].box_node = Box3d(Eigen::Vector3d(-3, -3, 0), Eigen::Vector3d(3, 3, 2));
  delta.nodes[4].box_node.extend(Box3d(Eigen::Vector3d(-3, -2, 0), Eigen::Vector3d(6, 6, 3)));
  delta.edges = {MakeEdge(P(0), "CONTAINS", O(0)), MakeEdge(R(0), "CONTAINS", P(0)),
                 MakeEdge(O(1), "ON", O(2)), MakeEdge(O(0), "NEAREST_PLACE", P(0))};
  return delta;
}

// What another robot calls the same things, with a lamp and a room of its own.
GraphDelta HomeAgain() {
  GraphDelta delta;
  delta.nodes = {MakeObject(0, "lamp", {4, 1, 1.0}),
                 MakeObject(1, "chair", {1.05, 1, 0.4}),
                 MakeObject(2, "cup", {3, 3.04, 1.0}, 0.1),
                 MakeObject(7, "table", {3, 3, 0.4}, 0.8),
                 MakePlace(5, {1.1, 2, 0}, 0.8),
                 MakePlace(6, {2.2, 2, 0}, 0.8),
                 MakeRoom(3, {0.1, 0, 0}, {4.9, 5, 3})};
  for (Node& node : delta.nodes) node.observation_count = 7;
  delta.nodes[4].box_node = Box3d(Eigen::Vector3d(-4, -4, 0), Eigen::Vector3d(4, 4, 2));
  delta.nodes[6].box_node.extend(Box3d(Eigen::Vector3d(-4, -3, 0), Eigen::Vector3d(7, 7, 3)));
  delta.edges = {MakeEdge(P(5), "CONTAINS", O(1)),      MakeEdge(P(5), "CONTAINS", O(0)),
                 MakeEdge(R(3), "CONTAINS", P(5)),      MakeEdge(O(2), "ON", O(7)),
                 MakeEdge(P(5), "TRAVERSABLE", P(6)),   MakeEdge(O(1), "NEAREST_PLACE", P(5)),
                 MakeEdge(O(0), "NEAREST_PLACE", P(6)), MakeEdge(O(2), "NEAR", O(0))};
  return delta;
}

int64_t CountNodes(SmallMaps* maps, const std::string& map) {
  int64_t count = 0;
  EXPECT_TRUE(maps->Newest(map)
                  ->ScanNodes({}, {}, {},
                              [&](const Node&) {
                                ++count;
                                return true;
                              })
                  .ok());
  return count;
}

Revision HeadOf(SmallMaps* maps, const std::string& map) { return maps->Newest(map)->revision(); }

TEST(Merge, FusesWhatBothHaveAndAddsTheRestUnderFreshIds) {
  SmallMaps maps;
  maps.Commit("a", Home());
  maps.Commit("b", HomeAgain());
  const MergePlan plan = maps.Merge("a", "b");
  EXPECT_EQ(plan.counts.fused_object_count, 3);
  EXPECT_EQ(plan.counts.fused_place_count, 1);
  EXPECT_EQ(plan.counts.fused_room_count, 1);
  EXPECT_EQ(plan.counts.added_node_count, 2);
  EXPECT_EQ(plan.node_ids.at(O(1)), O(0));
  EXPECT_EQ(plan.node_ids.at(O(2)), O(1));
  EXPECT_EQ(plan.node_ids.at(O(7)), O(2));
  EXPECT_EQ(plan.node_ids.at(O(0)), O(3));
  EXPECT_EQ(plan.node_ids.at(P(5)), P(0));
  EXPECT_EQ(plan.node_ids.at(P(6)), P(1));
  EXPECT_EQ(plan.node_ids.at(R(3)), R(0));
  EXPECT_EQ(CountNodes(&maps, "a"), 7);
  EXPECT_EQ(maps.Get("a", O(3)).class_name, "lamp");
  EXPECT_EQ(maps.Problems("a"), std::vector<std::string>());
}

TEST(Merge, CarriesEdgesAndJoinsThoseOfBoth) {
  SmallMaps maps;
  maps.Commit("a", Home());
  maps.Commit("b", HomeAgain());
  maps.Merge("a", "b");
  EXPECT_TRUE(maps.Has("a", {P(0), "CONTAINS", O(3)}));
  EXPECT_TRUE(maps.Has("a", {P(0), "TRAVERSABLE", P(1)}));
  EXPECT_TRUE(maps.Has("a", {O(3), "NEAREST_PLACE", P(1)}));
  EXPECT_TRUE(maps.Has("a", {O(1), "NEAR", O(3)}));
  int64_t edge_count = 0;
  ASSERT_TRUE(maps.Newest("a")->ReadAllEdges({}, [&](const Edge&) { ++edge_count; }).ok());
  EXPECT_EQ(edge_count, 8);
}

TEST(Merge, AddsUpObservationsAndNamesTheOrigin) {
  SmallMaps maps;
  maps.Commit("a", Home());
  maps.Commit("b", HomeAgain());
  maps.Merge("a", "b");
  const Node chair = maps.Get("a", O(0));
  EXPECT_EQ(chair.observation_count, 17);
  EXPECT_EQ(std::get<std::string>(chair.attributes.at("merged_from")), "b/O1");
  EXPECT_FALSE(CopiedFrom(chair).has_value());
  const auto lamp = CopiedFrom(maps.Get("a", O(3)));
  ASSERT_TRUE(lamp.has_value());
  EXPECT_EQ(lamp->id, O(0));
  EXPECT_EQ(lamp->observation_count, 7);
}

TEST(Merge, OfTheSameMapAgainChangesNothing) {
  SmallMaps maps;
  maps.Commit("a", Home());
  GraphDelta again = HomeAgain();
  again.nodes.push_back(MakeAgent(NodeId('r', 0), "spot"));
  again.appends = {MakeTrack(NodeId('r', 0), 0, 10)};
  again.stays = {{NodeId('r', 0), P(5), R(3), 0, 5 * kNsPerSecond}};
  again.factors = {{NodeId('r', 0), {{"odometry", 0, kNsPerSecond, {}, {}, {}}}}};
  maps.Commit("b", std::move(again));
  const Pose3d transform{{0.01, 0.02, 0.0},
                         Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitZ()))};
  maps.Merge("a", "b", transform);
  const Revision head = HeadOf(&maps, "a");
  const auto found = FindTransform(*maps.Newest("a"), *maps.Newest("b"), {}, {});
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT((found->map_T_other.position - transform.position).norm(), 1e-9);
  const MergePlan plan = maps.Merge("a", "b", found->map_T_other);
  EXPECT_EQ(plan.counts.added_node_count, 0);
  EXPECT_EQ(HeadOf(&maps, "a"), head);
}

TEST(Merge, OfALaterRevisionUpdatesRatherThanDoubles) {
  SmallMaps maps;
  maps.Commit("a", Home());
  maps.Commit("b", HomeAgain());
  maps.Merge("a", "b");
  GraphDelta later;
  later.nodes = {MakeObject(0, "lamp", {4.3, 1, 1.0}), MakeObject(1, "chair", {1.05, 1, 0.4}),
                 MakeObject(8, "plant", {2, 4, 0.5})};
  later.nodes[0].observation_count = 9;
  later.nodes[1].observation_count = 12;
  maps.Commit("b", std::move(later));
  const MergePlan plan = maps.Merge("a", "b");
  EXPECT_EQ(plan.counts.added_node_count, 1);
  EXPECT_EQ(maps.Get("a", O(0)).observation_count, 22);
  EXPECT_EQ(maps.Get("a", O(3)).observation_count, 9);
  EXPECT_NEAR(maps.Get("a", O(3)).map_T_node.position.x(), 4.3, 1e-9);
  EXPECT_EQ(maps.Get("a", O(4)).class_name, "plant");
  EXPECT_EQ(CountNodes(&maps, "a"), 8);
}

TEST(Merge, NeverUsesAnIdThatThePastHas) {
  SmallMaps maps;
  GraphDelta delta = Home();
  delta.nodes.push_back(MakeObject(90, "ghost", {4, 4, 0.5}));
  maps.Commit("a", std::move(delta));
  GraphDelta retire;
  retire.retirements = {{O(90), std::nullopt}};
  maps.Commit("a", std::move(retire));
  maps.Commit("b", HomeAgain());
  EXPECT_EQ(maps.Merge("a", "b").node_ids.at(O(0)), O(91));
}

TEST(Merge, CutShortGoesOnWithANewPlan) {
  for (const int cut : {1, 2, 3, 5, 7, 9}) {
    SCOPED_TRACE(cut);
    SmallMaps maps;
    maps.Commit("a", Home());
    GraphDelta delta = HomeAgain();
    delta.nodes.push_back(MakeAgent(NodeId('r', 0), "spot"));
    delta.appends = {MakeTrack(NodeId('r', 0), 0, 10)};
    delta.stays = {{NodeId('r', 0), P(5), R(3), 0, 5 * kNsPerSecond}};
    maps.Commit("b", std::move(delta));
    MergeOptions options;
    options.batch_row_count = 3;
    auto plan = maps.Plan("a", "b", {}, options);
    ASSERT_TRUE(plan.ok()) << plan.status();
    maps.Write("a", "b", *plan, cut);
    maps.Merge("a", "b", {}, options);
    EXPECT_EQ(CountNodes(&maps, "a"), 8);
    EXPECT_EQ(maps.Get("a", O(0)).observation_count, 17);
    EXPECT_TRUE(maps.Has("a", {O(1), "NEAR", O(3)}));
    const auto track = maps.Newest("a")->GetTrack(NodeId('r', 0));
    ASSERT_TRUE(track.ok()) << track.status();
    EXPECT_EQ(track->pose_count, 10);
    EXPECT_EQ(maps.Newest("a")->StaysOfAgent(NodeId('r', 0), kTimeMin, kTimeMax)->size(), 1u);
    EXPECT_EQ(maps.Problems("a"), std::vector<std::string>());
  }
}

TEST(Merge, KeepsAgentsOfOneNameApartUnlessOneIsLaterAndHasAGivenName) {
  SmallMaps maps;
  GraphDelta a;
  a.nodes = {MakeAgent(NodeId('H', 0), "alice"), MakeAgent(NodeId('H', 1), "bob"),
             MakeAgent(NodeId('H', 2), "person 3")};
  a.appends = {MakeTrack(NodeId('H', 0), 0, 10), MakeTrack(NodeId('H', 1), 0, 10),
               MakeTrack(NodeId('H', 2), 0, 10)};
  maps.Commit("a", std::move(a));
  GraphDelta b;
  b.nodes = {MakeAgent(NodeId('H', 0), "bob"), MakeAgent(NodeId('H', 1), "alice"),
             MakeAgent(NodeId('H', 2), "person 3")};
  b.appends = {MakeTrack(NodeId('H', 0), 100 * kNsPerSecond, 5),
               MakeTrack(NodeId('H', 1), 5 * kNsPerSecond, 5),
               MakeTrack(NodeId('H', 2), 100 * kNsPerSecond, 5)};
  maps.Commit("b", std::move(b));
  const MergePlan plan = maps.Merge("a", "b");
  EXPECT_EQ(plan.node_ids.at(NodeId('H', 0)), NodeId('H', 1));
  EXPECT_EQ(maps.Newest("a")->GetTrack(NodeId('H', 1))->pose_count, 15);
  EXPECT_EQ(maps.Get("a", plan.node_ids.at(NodeId('H', 1))).name, "alice@b");
  EXPECT_EQ(maps.Get("a", plan.node_ids.at(NodeId('H', 2))).name, "person 3@b");
  EXPECT_EQ(maps.Problems("a"), std::vector<std::string>());
}

TEST(Merge, PutsAnAgentWhereItsLaterTrackEnds) {
  const auto session = [](TimeNs from_ns, double x) {
    GraphDelta delta;
    Node robot = MakeAgent(NodeId('r', 0), "spot");
    robot.map_T_node.position = {x, 0, 0};
    robot.last_observed_ns = from_ns + 4 * kNsPerSecond;
    Asset places;
    places.content = std::to_string(x);
    places.sha256 = ComputeSha256(places.content);
    places.media_type = "application/x-dsg-places";
    robot.agent.emplace().place_memory = {places.sha256};
    delta.assets = {places};
    delta.nodes = {robot};
    delta.appends = {MakeTrack(NodeId('r', 0), from_ns, 5)};
    return delta;
  };
  for (const bool is_later : {true, false}) {
    SmallMaps maps;
    maps.Commit("a", session(is_later ? 0 : 100 * kNsPerSecond, 3.0));
    maps.Commit("b", session(is_later ? 100 * kNsPerSecond : 0, 7.0));
    maps.Merge("a", "b", Pose3d{{0, 1, 0}, Eigen::Quaterniond::Identity()});
    const Node robot = maps.Get("a", NodeId('r', 0));
    const Eigen::Vector3d expected = is_later ? Eigen::Vector3d(7, 1, 0) : Eigen::Vector3d(3, 0, 0);
    EXPECT_LT((robot.map_T_node.position - expected).norm(), 1e-9) << is_later;
    // A later session is the same robot's, and what it saw in both is known.
    ASSERT_EQ(robot.agent->place_memory.size(), is_later ? 2u : 1u);
    for (const Sha256& part : robot.agent->place_memory) {
      EXPECT_TRUE(maps.Newest("a")->ReadAsset(part).ok());
    }
  }
}

TEST(Merge, CarriesTracksIntoTheFrameOfTheMap) {
  SmallMaps maps;
  maps.Commit("a", Home());
  GraphDelta b;
  b.nodes = {MakeAgent(NodeId('r', 0), "spot")};
  b.appends = {MakeTrack(NodeId('r', 0), 0, 10)};
  maps.Commit("b", std::move(b));
  const Pose3d turn{{1, 2, 0.5},
                    Eigen::Quaterniond(Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitZ()))};
  maps.Merge("a", "b", turn);
  const auto pose = maps.Newest("a")->Locate(NodeId('r', 0), 9 * kNsPerSecond);
  ASSERT_TRUE(pose.ok()) << pose.status();
  EXPECT_LT((pose->map_T_agent.position - Eigen::Vector3d(1, 2.9, 0.5)).norm(), 1e-9);
}

TEST(Merge, NumbersLayersAndClassesAsTheMapDoes) {
  SmallMaps maps;
  GraphDelta a = Home();
  a.labels = {{1, "chair"}, {2, "table"}};
  a.nodes[0].class_id = 1;
  maps.Commit("a", std::move(a));
  GraphDelta b = HomeAgain();
  b.labels = {{1, "lamp"}, {2, "chair"}};
  b.nodes[0].class_id = 1;
  b.layers = {{8, "level", 450}};
  maps.Commit("b", std::move(b));
  const MergePlan plan = maps.Merge("a", "b");
  EXPECT_EQ(maps.Get("a", plan.node_ids.at(O(0))).class_id, 3);
  EXPECT_TRUE(maps.Newest("a")->FindLayer("level").ok());
  EXPECT_EQ(plan.class_of.at(2), 1u);
}

// Of an agent that only the other map observes: x at each second.
std::vector<double> TrackOf(SmallMaps* maps, const std::string& map, NodeId agent) {
  std::vector<double> xs;
  EXPECT_TRUE(maps->Newest(map)
                  ->ReadPoses(agent, kTimeMin, kTimeMax, {},
                              [&](const TimedPose& pose) {
                                xs.push_back(pose.map_T_agent.position.x());
                                return true;
                              })
                  .ok());
  return xs;
}

TEST(Merge, CarriesCorrectionsOfATrackThatItCopied) {
  SmallMaps maps;
  maps.Commit("a", Home());
  GraphDelta b = HomeAgain();
  b.nodes.push_back(MakeAgent(kAnna, "anna"));
  b.appends = {MakeTrack(kAnna, 0, 12)};
  maps.Commit("b", std::move(b));
  MergeOptions in_small_parts;
  in_small_parts.batch_row_count = 5;
  const NodeId mine = maps.Merge("a", "b", {}, in_small_parts).node_ids.at(kAnna);
  // A loop closure moves three poses; two more are observed.
  GraphDelta change;
  TrajectoryAppend moved = MakeTrack(kAnna, 0, 14);
  for (TimedPose& pose : moved.poses) pose.map_T_agent.position.x() += 0.5;
  change.corrections = {{kAnna,
                         6 * kNsPerSecond,
                         9 * kNsPerSecond,
                         {moved.poses.begin() + 6, moved.poses.begin() + 9}}};
  change.appends = {{kAnna, {moved.poses.begin() + 12, moved.poses.end()}}};
  maps.Commit("b", std::move(change));
  maps.Merge("a", "b", {}, in_small_parts);
  EXPECT_EQ(TrackOf(&maps, "a", mine), TrackOf(&maps, "b", kAnna));
  EXPECT_EQ(maps.Write("a", "b", *maps.Plan("a", "b")), 0);
  // What the other map forgets stays.
  GraphDelta forgotten;
  forgotten.corrections = {{kAnna, 2 * kNsPerSecond, 7 * kNsPerSecond, {}}};
  maps.Commit("b", std::move(forgotten));
  // The agent notes the revision that it was compared with.
  EXPECT_EQ(maps.Write("a", "b", *maps.Plan("a", "b")), 1);
  EXPECT_EQ(maps.Write("a", "b", *maps.Plan("a", "b")), 0);
  EXPECT_EQ(TrackOf(&maps, "a", mine).size(), 14u);
  EXPECT_TRUE(maps.Problems("a").empty());
}

TEST(Merge, MovesACopyToTheParentAndPlaceThatTheOtherMapNamesNow) {
  SmallMaps maps;
  maps.Commit("a", Home());
  maps.Commit("b", HomeAgain());
  const NodeId lamp = maps.Merge("a", "b").node_ids.at(O(0));
  EXPECT_TRUE(maps.Has("a", {P(0), "CONTAINS", lamp}));
  GraphDelta change;
  Node parent = MakePlace(6, {2.2, 2, 0}, 0.8);
  parent.box_node = Box3d(Eigen::Vector3d(-4, -4, 0), Eigen::Vector3d(4, 4, 2));
  change.nodes = {parent};
  change.edges = {MakeEdge(P(6), "CONTAINS", O(0)), MakeEdge(O(0), "NEAREST_PLACE", P(5))};
  change.edge_removals = {{P(5), "CONTAINS", O(0)}, {O(0), "NEAREST_PLACE", P(6)}};
  maps.Commit("b", std::move(change));
  const NodeId place = maps.Merge("a", "b").node_ids.at(P(6));
  EXPECT_TRUE(maps.Has("a", {place, "CONTAINS", lamp}));
  EXPECT_FALSE(maps.Has("a", {P(0), "CONTAINS", lamp}));
  EXPECT_TRUE(maps.Has("a", {lamp, "NEAREST_PLACE", P(0)}));
  EXPECT_FALSE(maps.Has("a", {lamp, "NEAREST_PLACE", place}));
  // What this map had stays as it was.
  EXPECT_TRUE(maps.Has("a", {P(0), "CONTAINS", O(0)}));
  EXPECT_EQ(maps.Write("a", "b", *maps.Plan("a", "b")), 0);
  EXPECT_TRUE(maps.Problems("a").empty());
}

TEST(Merge, RefusesWhatCannotBeMerged) {
  SmallMaps maps;
  maps.Commit("a", Home());
  maps.Commit("b", HomeAgain());
  EXPECT_EQ(ReasonOf(maps.Plan("a", "a").status()), Reason::kFieldInvalid);
  const Pose3d tilted{{0, 0, 0},
                      Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitX()))};
  EXPECT_EQ(ReasonOf(maps.Plan("a", "b", tilted).status()), Reason::kFieldInvalid);
  Pose3d none;
  none.orientation.coeffs().setZero();
  EXPECT_EQ(ReasonOf(maps.Plan("a", "b", none).status()), Reason::kFieldInvalid);
  MapSpec unix_spec;
  unix_spec.name = "unix";
  unix_spec.clock = Clock::kUnix;
  ASSERT_TRUE(maps.store()->CreateMap(unix_spec).ok());
  maps.Commit("unix", HomeAgain());
  EXPECT_EQ(ReasonOf(maps.Plan("a", "unix").status()), Reason::kFramesIncompatible);
  GraphDelta level;
  level.layers = {{8, "level", 450}};
  maps.Commit("a", std::move(level));
  GraphDelta other_level;
  other_level.layers = {{8, "level", 470}};
  maps.Commit("b", std::move(other_level));
  EXPECT_EQ(ReasonOf(maps.Plan("a", "b").status()), Reason::kFramesIncompatible);
}

// x far beyond what a map may hold; the plan is what a dry run shows.
TEST(Merge, RefusesATransformThatLeadsBeyondTheCoordinatesOfAMap) {
  const Pose3d far{{1e9, 0, 0}, Eigen::Quaterniond::Identity()};
  GraphDelta of_nodes;
  of_nodes.nodes = {MakeObject(0, "chair", {1, 1, 0.4})};
  GraphDelta of_mesh;
  MeshBlock block;
  block.index = {1, 0, 0};
  block.positions_map = {{2.1f, 0, 0}, {2.2f, 0, 0}, {2.1f, 0.1f, 0}};
  block.faces = {{0, 1, 2}};
  of_mesh.mesh_blocks = {block};
  SmallMaps maps;
  maps.Commit("a", Home());
  maps.Commit("nodes", std::move(of_nodes));
  maps.Commit("mesh", std::move(of_mesh));
  for (const char* other : {"nodes", "mesh"}) {
    const absl::Status refused = maps.Plan("a", other, far).status();
    EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid) << other << refused;
    EXPECT_EQ(MetadataOf(refused)["field"], "map_t_other");
    EXPECT_EQ(MetadataOf(refused)["bound"], "2e+06") << refused;
    EXPECT_NE(std::string(refused.message()).find("2000000 m"), std::string::npos) << refused;
  }
}

TEST(Merge, RefusesTracksThatLeadBeyondTheCoordinatesOrTheTimesOfAMap) {
  SmallMaps maps;
  maps.Commit("a", Home());
  GraphDelta walk;
  walk.nodes = {MakeAgent(NodeId('H', 1), "anna")};
  walk.appends = {MakeTrack(NodeId('H', 1), 0, 10)};
  walk.appends[0].poses[7].map_T_agent.position.x() = 1.9e6;
  maps.Commit("b", std::move(walk));
  EXPECT_TRUE(maps.Plan("a", "b", {{9e4, 0, 0}, Eigen::Quaterniond::Identity()}).ok());
  const Pose3d far{{2e5, 0, 0}, Eigen::Quaterniond::Identity()};
  const absl::Status refused = maps.Plan("a", "b", far).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid) << refused;
  EXPECT_NE(std::string(refused.message()).find("a pose of agent H1"), std::string::npos);

  MapSpec late;
  late.name = "late";
  late.codec = TrajectoryCodec::kLossless;
  late.epoch_ns = int64_t{50} * 365 * 86'400 * kNsPerSecond;
  ASSERT_TRUE(maps.store()->CreateMap(late).ok());
  GraphDelta late_walk;
  late_walk.nodes = {MakeAgent(NodeId('H', 1), "bert")};
  late_walk.appends = {MakeTrack(NodeId('H', 1), late.epoch_ns, 10)};
  maps.Commit("late", std::move(late_walk));
  const absl::Status late_refused = maps.Plan("a", "late").status();
  EXPECT_EQ(ReasonOf(late_refused), Reason::kTimeOutsideMap) << late_refused;
  EXPECT_NE(std::string(late_refused.message()).find("H1"), std::string::npos) << late_refused;
  EXPECT_NE(late_refused.message().find("--epoch"), absl::string_view::npos) << late_refused;
}

TEST(Merge, RefusesNodesThatTheMapCouldNotHold) {
  SmallMaps maps;
  maps.Commit("a", Home());
  GraphDelta b = HomeAgain();
  for (int i = 0; i < 63; ++i) b.nodes[0].attributes["attribute" + std::to_string(i)] = 1.0;
  maps.Commit("b", std::move(b));
  const absl::Status refused = maps.Plan("a", "b").status();
  EXPECT_EQ(ReasonOf(refused), Reason::kDeltaInvalid) << refused;
  EXPECT_NE(std::string(refused.message()).find("65 attributes"), std::string::npos) << refused;
}

TEST(Merge, UnitesTheOutlinesOfARoomThatBothSawAPartOf) {
  SmallMaps maps;
  GraphDelta a;
  a.nodes = {MakeRoom(0, {0, 0, 0}, {6, 4, 3})};
  maps.Commit("a", std::move(a));
  GraphDelta b;
  b.nodes = {MakeRoom(0, {3, 0, 0}, {6, 4, 3}), MakeRoom(1, {9.2, 0, 0}, {4, 4, 3})};
  maps.Commit("b", std::move(b));
  const MergePlan plan = maps.Merge("a", "b");
  EXPECT_EQ(plan.counts.fused_room_count, 1);
  const Node room = maps.Get("a", R(0));
  double x_max = 0.0;
  for (const auto& corner : room.region->footprint_map) x_max = std::max(x_max, corner.x());
  EXPECT_NEAR(x_max, 9.0, 1e-6);
  EXPECT_NEAR(room.BoxMap().max().x(), 9.0, 1e-6);
}

}  // namespace
}  // namespace dsg::merge
