// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/held_edges.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

constexpr int32_t kCup = 20;

TimeNs At(double seconds) { return static_cast<TimeNs>(seconds * kNsPerSecond); }

Node Cup(uint64_t index, const Eigen::Vector3d& position_map, double first_s, double last_s,
         TimeNs gone_ns = kTimeMax) {
  Node node;
  node.id = NodeId('O', index);
  node.layer = layers::kObjects;
  node.kind = kinds::kObject;
  node.class_id = kCup;
  node.map_T_node.position = position_map;
  node.box_node = Box3d(Eigen::Vector3d(-0.04, -0.04, -0.05), Eigen::Vector3d(0.04, 0.04, 0.05));
  node.valid = {At(first_s), gone_ns};
  node.first_observed_ns = At(first_s);
  node.last_observed_ns = At(last_s);
  return node;
}

// Walks along y = 0 at 1 m/s, and is at x = t.
AgentPath Walker(uint64_t index, double y = 0.0) {
  AgentPath path;
  path.agent = NodeId('H', index);
  for (int i = 0; i <= 100; ++i) path.torso.push_back({At(0.2 * i), {0.2 * i, y, 1.2}});
  return path;
}

Carry Between(double begin_s, double end_s) {
  Carry carry{kCup, {}};
  for (double t = begin_s; t <= end_s; t += 0.2) carry.way.push_back({At(t), {t, 0.3, 1.0}});
  return carry;
}

std::vector<Edge> FindHeldEdges(const std::vector<AgentPath>& people,
                                const std::vector<Carry>& carries,
                                const std::vector<Node>& objects) {
  return ingest::FindHeldEdges(people, carries, objects, HeldOptions());
}

TEST(HeldEdges, NameThePersonThePlaceAndTheTime) {
  const auto edges =
      FindHeldEdges({Walker(1), Walker(2, 4.0)}, {Between(8, 10)}, {Cup(1, {5, 0.6, 0.8}, 0, 2)});
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].source, NodeId('O', 1));
  EXPECT_EQ(edges[0].relation, relations::kHeldBy);
  EXPECT_EQ(edges[0].target, NodeId('H', 1));
  EXPECT_EQ(edges[0].valid.from_ns, At(5));
  EXPECT_GT(edges[0].valid.to_ns, At(9.5));
  EXPECT_GT(edges[0].weight, 0.8);
}

TEST(HeldEdges, PreferWhatThePersonCameBy) {
  const auto edges = FindHeldEdges({Walker(1)}, {Between(8, 10)},
                                   {Cup(1, {5, 0.6, 0.8}, 0, 2), Cup(2, {5, 4, 0.8}, 0, 2)});
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].source, NodeId('O', 1));
  EXPECT_LT(edges[0].weight, 1.0);
}

TEST(HeldEdges, AbstainBetweenTwoAlike) {
  EXPECT_TRUE(FindHeldEdges({Walker(1)}, {Between(8, 10)},
                            {Cup(1, {5, 0.6, 0.8}, 0, 2), Cup(2, {5, 0.6, 0.9}, 0, 2)})
                  .empty());
}

TEST(HeldEdges, PassOverWhatWasSeenStandingAfterwards) {
  EXPECT_TRUE(FindHeldEdges({Walker(1)}, {Between(8, 10)}, {Cup(1, {5, 0.6, 0.8}, 0, 12)}).empty());
}

TEST(HeldEdges, DoNotBlameWhoCameWhenItWasGone) {
  const Node gone = Cup(1, {5, 0.6, 0.8}, 0, 1, At(3));
  const Node there = Cup(2, {5, 0.6, 0.9}, 0, 1);
  const auto edges = FindHeldEdges({Walker(1)}, {Between(8, 10)}, {gone, there});
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].source, NodeId('O', 2));
}

TEST(HeldEdges, NeedSomebodyBesideTheThing) {
  EXPECT_TRUE(
      FindHeldEdges({Walker(1, 3.0)}, {Between(8, 10)}, {Cup(1, {5, 0.6, 0.8}, 0, 2)}).empty());
}

TEST(HeldEdges, FollowTheThingToWhereItWasPut) {
  const auto edges = FindHeldEdges(
      {Walker(1)}, {Between(8, 10)},
      {Cup(1, {5, 0.6, 0.8}, 0, 2), Cup(2, {15, 0.6, 0.8}, 18, 19), Cup(3, {15, 6, 0.8}, 18, 19)});
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_EQ(edges[1].relation, relations::kSameAs);
  EXPECT_EQ(edges[1].source, NodeId('O', 2));
  EXPECT_EQ(edges[1].target, NodeId('O', 1));
}

}  // namespace
}  // namespace dsg::ingest
