// SPDX-License-Identifier: Apache-2.0
// Nodes and edges over revisions: written, corrected, retired, searched.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

std::vector<NodeId> Ids(const Snapshot& snapshot, const NodeFilter& filter,
                        NodeId after = NodeId()) {
  std::vector<NodeId> ids;
  const absl::Status scanned = snapshot.ScanNodes(filter, after, {}, [&](const Node& node) {
    ids.push_back(node.id);
    return true;
  });
  EXPECT_TRUE(scanned.ok()) << scanned;
  return ids;
}

std::vector<EdgeKey> Keys(const Snapshot& snapshot, const EdgeFilter& filter,
                          const std::optional<EdgeKey>& after = std::nullopt) {
  std::vector<EdgeKey> keys;
  const absl::Status scanned = snapshot.ScanEdges(filter, after, {}, [&](const Edge& edge) {
    keys.push_back(edge.key());
    return true;
  });
  EXPECT_TRUE(scanned.ok()) << scanned;
  return keys;
}

GraphDelta Retire(NodeId id, std::optional<TimeNs> valid_to_ns) {
  GraphDelta delta;
  delta.retirements.push_back({id, valid_to_ns});
  return delta;
}

class Nodes : public OnEveryBackend {};
class Retiring : public OnEveryBackend {};
class Edges : public OnEveryBackend {};
class Ancestors : public OnEveryBackend {};
class Names : public OnEveryBackend {};
class Layers : public OnEveryBackend {};
class Labels : public OnEveryBackend {};
class Scan : public OnEveryBackend {};
class Stats : public OnEveryBackend {};
DSG_ON_EVERY_BACKEND(Nodes);
DSG_ON_EVERY_BACKEND(Retiring);
DSG_ON_EVERY_BACKEND(Edges);
DSG_ON_EVERY_BACKEND(Ancestors);
DSG_ON_EVERY_BACKEND(Names);
DSG_ON_EVERY_BACKEND(Layers);
DSG_ON_EVERY_BACKEND(Labels);
DSG_ON_EVERY_BACKEND(Scan);
DSG_ON_EVERY_BACKEND(Stats);

TEST_P(Nodes, ComeBackWithEveryField) {
  TestMap map(GetParam());
  Node node = MakeObject(7, "cup", BoxOf(1, 2, 3, 1.1, 2.1, 3.1));
  node.class_id = 41;
  node.class_name = "mug";
  node.map_T_node.orientation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  node.valid = {-5, 900};
  node.first_observed_ns = 1;
  node.last_observed_ns = 0;
  node.observation_count = 12;
  node.confidence = 0.0;
  node.provenance = Provenance::kPredicted;
  node.object.emplace();
  node.object->color = Color{1, 2, 3, 0};
  node.object->size = {0.1, 0.1, 0.2};
  node.object->mesh_instance_id = 4'000'000'000;
  node.attributes = {{"clean", false}, {"mass_kg", 0.3}, {"note", std::string("a\0b", 3)}};
  map.MustCommit(DeltaOfNodes({node}));
  const Node kept = OrDie(map.Latest()->GetNode(node.id));
  EXPECT_EQ(kept.id, node.id);
  EXPECT_EQ(kept.layer, layers::kObjects);
  EXPECT_EQ(kept.kind, "object");
  EXPECT_EQ(kept.name, "cup");
  EXPECT_EQ(kept.class_id, 41);
  EXPECT_EQ(kept.class_name, "mug");
  EXPECT_EQ(kept.map_T_node.position, node.map_T_node.position);
  EXPECT_EQ(kept.map_T_node.orientation.coeffs(), node.map_T_node.orientation.coeffs());
  EXPECT_EQ(kept.box_node.min(), node.box_node.min());
  EXPECT_EQ(kept.box_node.max(), node.box_node.max());
  EXPECT_EQ(kept.valid, node.valid);
  EXPECT_EQ(kept.first_observed_ns, 1);
  EXPECT_EQ(kept.last_observed_ns, 0);
  EXPECT_EQ(kept.observation_count, 12);
  EXPECT_EQ(kept.confidence, 0.0);
  EXPECT_EQ(kept.provenance, Provenance::kPredicted);
  ASSERT_TRUE(kept.object.has_value());
  EXPECT_EQ(kept.object->color, node.object->color);
  EXPECT_EQ(kept.object->size, node.object->size);
  EXPECT_EQ(kept.object->mesh_instance_id, 4'000'000'000);
  EXPECT_EQ(kept.attributes, node.attributes);
  EXPECT_EQ(kept.revision, 1);
}

TEST_P(Nodes, WithoutExtentOrClassComeBackWithout) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  const Node kept = OrDie(map.Latest()->GetNode(NodeId('H', 1)));
  EXPECT_TRUE(kept.box_node.isEmpty());
  EXPECT_EQ(kept.class_id, -1);
  EXPECT_EQ(kept.valid, Interval());
  EXPECT_FALSE(kept.confidence.has_value());
  EXPECT_FALSE(kept.first_observed_ns.has_value());
  EXPECT_FALSE(kept.object.has_value());
}

TEST_P(Nodes, KeepTheComponentsOfTheirKind) {
  TestMap map(GetParam());
  Node place =
      MakeNode(NodeId('p', 1), layers::kPlaces, kinds::kPlace, "", BoxOf(0, 0, 0, 1, 1, 1));
  place.place = PlaceInfo{0.7, BoxOf(-0.5, -0.5, -0.5, 0.5, 0.5, 0.5), 3};
  Node wall = MakeNode(NodeId('S', 1), layers::kStructures, kinds::kStructure, "", Box3d());
  wall.structure = StructureInfo{"wall", {0, 1, 0}, -4.0, 9};
  Node room = MakeNode(NodeId('R', 1), layers::kRooms, kinds::kRoom, "lab", Box3d());
  room.region = RegionInfo{{{0, 0}, {4, 0}, {0, 4}}, -0.1, 2.9, {{"lab", 0.8}, {"hall", 0.2}}};
  Node human = MakeHuman(1, "ann");
  human.agent = AgentInfo{std::nullopt, {0.5f, -1.5f}, "confirmed", 7 * kSecond};
  map.MustCommit(DeltaOfNodes({place, wall, room, human}));
  const auto snapshot = map.Latest();
  const Node kept_place = OrDie(snapshot->GetNode(place.id));
  EXPECT_EQ(kept_place.place->clearance_m, 0.7);
  EXPECT_EQ(kept_place.place->free_box.max(), place.place->free_box.max());
  EXPECT_EQ(kept_place.place->basis_point_count, 3);
  const Node kept_wall = OrDie(snapshot->GetNode(wall.id));
  EXPECT_EQ(kept_wall.structure->structure_type, "wall");
  EXPECT_EQ(kept_wall.structure->plane_normal_map, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(kept_wall.structure->plane_offset_m, -4.0);
  EXPECT_EQ(kept_wall.structure->mesh_instance_id, 9u);
  const Node kept_room = OrDie(snapshot->GetNode(room.id));
  EXPECT_EQ(kept_room.region->footprint_map, room.region->footprint_map);
  EXPECT_EQ(kept_room.region->z_min_m, -0.1);
  EXPECT_EQ(kept_room.region->class_probabilities, room.region->class_probabilities);
  const Node kept_human = OrDie(snapshot->GetNode(human.id));
  EXPECT_EQ(kept_human.agent->shape_coefficients, human.agent->shape_coefficients);
  EXPECT_EQ(kept_human.agent->track_state, "confirmed");
  EXPECT_EQ(kept_human.agent->gap_ns_max, 7 * kSecond);
}

TEST_P(Nodes, OfPastRevisionsAreAsTheyWereBelieved) {
  TestMap map(GetParam());
  for (int i = 1; i <= 4; ++i) {
    map.MustCommit(
        DeltaOfNodes({MakeObject(1, absl::StrCat("name ", i), BoxOf(i, 0, 0, i + 1, 1, 1))}));
  }
  for (int i = 1; i <= 4; ++i) {
    const Node node = OrDie(map.At(i)->GetNode(NodeId('O', 1)));
    EXPECT_EQ(node.name, absl::StrCat("name ", i));
    EXPECT_EQ(node.map_T_node.position.x(), i + 0.5);
    EXPECT_EQ(node.revision, i);
  }
  EXPECT_EQ(ReasonOf(map.At(0)->GetNode(NodeId('O', 1)).status()), Reason::kNodeUnknown);
}

TEST_P(Nodes, WrittenTwiceInOneDeltaAreWrittenOnceAsLastSaid) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeObject(1, "first", BoxOf(0, 0, 0, 1, 1, 1)),
                               MakeObject(1, "second", BoxOf(0, 0, 0, 1, 1, 1))}));
  EXPECT_EQ(OrDie(map.Latest()->GetNode(NodeId('O', 1))).name, "second");
  EXPECT_EQ(OrDie(map.reader().Head()).node_count, 1);
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(Retiring, OfWhatLeftTheWorldKeepsItsPast) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1))}));
  map.MustCommit(Retire(NodeId('O', 1), 50));
  const auto now = map.Latest();
  EXPECT_EQ(OrDie(now->GetNode(NodeId('O', 1))).valid, (Interval{kTimeMin, 50}));
  NodeFilter filter;
  filter.at_ns = 49;
  EXPECT_EQ(Ids(*now, filter).size(), 1u);
  filter.at_ns = 50;
  EXPECT_TRUE(Ids(*now, filter).empty());
  EXPECT_EQ(Ids(*map.At(1), filter).size(), 1u);
  EXPECT_EQ(OrDie(map.reader().Head()).node_count, 1);
}

TEST_P(Retiring, OfWhatNeverExistedTakesNodeEdgesTrackAndStays) {
  TestMap map(GetParam());
  GraphDelta delta = DeltaOfStream({}, 1);
  delta.edges.push_back(MakeEdge(NodeId('H', 1), relations::kNear, NodeId('O', 1)));
  delta.edges.push_back(MakeEdge(NodeId('O', 1), relations::kNear, NodeId('H', 1)));
  delta.edges.push_back(MakeEdge(NodeId('H', 2), relations::kNear, NodeId('H', 1)));
  ASSERT_TRUE(map.writer().Commit(delta).ok());
  const std::string before = OrDie(Dump(*map.Latest()));
  const RevisionInfo old = OrDie(map.reader().Head());
  map.MustCommit(Retire(NodeId('H', 1), std::nullopt));
  const auto now = map.Latest();
  EXPECT_EQ(ReasonOf(now->GetNode(NodeId('H', 1)).status()), Reason::kNodeUnknown);
  EXPECT_EQ(ReasonOf(now->Locate(NodeId('H', 1), kSecond).status()), Reason::kAgentUnknown);
  EXPECT_EQ(ReasonOf(now->ResolveAgent("person 1").status()), Reason::kAgentUnknown);
  for (const EdgeKey& key : Keys(*now, {})) {
    EXPECT_NE(key.source, NodeId('H', 1));
    EXPECT_NE(key.target, NodeId('H', 1));
  }
  for (const char letter : {'R', 'p'}) {
    for (uint64_t i = 0; i < 20; ++i) {
      for (const Stay& stay : OrDie(now->StaysInNode(NodeId(letter, i), kTimeMin, kTimeMax, {}))) {
        EXPECT_NE(stay.agent, NodeId('H', 1));
      }
    }
  }
  for (const BoxVisit& visit :
       OrDie(now->VisitsToBox(BoxOf(-100, -100, -9, 200, 200, 9), kTimeMin, kTimeMax, {}))) {
    EXPECT_NE(visit.agent, NodeId('H', 1));
  }
  const RevisionInfo head = OrDie(map.reader().Head());
  EXPECT_EQ(head.node_count, old.node_count - 1);
  EXPECT_EQ(head.agent_count, old.agent_count - 1);
  EXPECT_EQ(head.edge_count, old.edge_count - 3);
  EXPECT_EQ(head.pose_count, old.pose_count - 20);
  EXPECT_EQ(head.stay_count, old.stay_count - 2);
  EXPECT_TRUE(OrDie(Dump(*map.At(1))) == before);
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(Retiring, OfWhatDoesNotExistIsRefused) {
  TestMap map(GetParam());
  EXPECT_EQ(ReasonOf(map.Commit(Retire(NodeId('O', 1), std::nullopt)).status()),
            Reason::kDeltaInvalid);
}

TEST_P(Retiring, BeforeItsBeginIsRefused) {
  TestMap map(GetParam());
  Node node = MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1));
  node.valid.from_ns = 100;
  map.MustCommit(DeltaOfNodes({node}));
  EXPECT_EQ(ReasonOf(map.Commit(Retire(NodeId('O', 1), 100)).status()), Reason::kDeltaInvalid);
}

TEST_P(Edges, ComeBackWithEveryFieldAndInOrder) {
  TestMap map(GetParam());
  GraphDelta delta = DeltaOfNodes({MakeObject(1, "", BoxOf(0, 0, 0, 1, 1, 1)),
                                   MakeObject(2, "", BoxOf(2, 0, 0, 3, 1, 1)),
                                   MakeObject(300, "", BoxOf(4, 0, 0, 5, 1, 1))});
  Edge edge = MakeEdge(NodeId('O', 2), "BEHIND", NodeId('O', 300));
  edge.weight = -0.25;
  edge.valid = {10, 20};
  edge.attributes = {{"sure", true}};
  delta.edges = {MakeEdge(NodeId('O', 300), relations::kNear, NodeId('O', 1)), edge,
                 MakeEdge(NodeId('O', 2), relations::kOn, NodeId('O', 1)),
                 MakeEdge(NodeId('O', 1), relations::kOn, NodeId('O', 2))};
  map.MustCommit(delta);
  const auto snapshot = map.Latest();
  std::vector<EdgeKey> expected;
  for (const Edge& each : delta.edges) expected.push_back(each.key());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(Keys(*snapshot, {}), expected);
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(Keys(*snapshot, {}, expected[i]),
              std::vector<EdgeKey>(expected.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                                   expected.end()));
  }
  EdgeFilter filter;
  filter.relation = "BEHIND";
  ASSERT_TRUE(snapshot
                  ->ScanEdges(filter, std::nullopt, {},
                              [&](const Edge& kept) {
                                EXPECT_EQ(kept.weight, -0.25);
                                EXPECT_EQ(kept.valid, edge.valid);
                                EXPECT_EQ(kept.attributes, edge.attributes);
                                EXPECT_EQ(kept.revision, 1);
                                return true;
                              })
                  .ok());
  filter.at_ns = 20;
  EXPECT_TRUE(Keys(*snapshot, filter).empty());
  EdgeFilter to_one;
  to_one.target = NodeId('O', 1);
  EXPECT_EQ(Keys(*snapshot, to_one).size(), 2u);
  EdgeFilter from_two;
  from_two.source = NodeId('O', 2);
  EXPECT_EQ(Keys(*snapshot, from_two).size(), 2u);
  from_two.target = NodeId('O', 1);
  EXPECT_EQ(Keys(*snapshot, from_two).size(), 1u);
}

TEST_P(Edges, OfPastRevisionsAreAsTheyWereBelieved) {
  TestMap map(GetParam());
  const NodeId a('O', 1), b('O', 2);
  GraphDelta first = DeltaOfNodes(
      {MakeObject(1, "", BoxOf(0, 0, 0, 1, 1, 1)), MakeObject(2, "", BoxOf(2, 0, 0, 3, 1, 1))});
  Edge edge = MakeEdge(a, relations::kNear, b);
  first.edges = {edge};
  map.MustCommit(first);
  GraphDelta second;
  edge.weight = 5.0;
  second.edges = {edge};
  map.MustCommit(second);
  GraphDelta third;
  third.edge_removals = {edge.key()};
  map.MustCommit(third);
  const auto weight_at = [&](Revision revision) {
    std::vector<double> weights;
    EXPECT_TRUE(map.At(revision)
                    ->ScanEdges({}, std::nullopt, {},
                                [&](const Edge& kept) {
                                  weights.push_back(kept.weight);
                                  return true;
                                })
                    .ok());
    return weights;
  };
  EXPECT_EQ(weight_at(0), std::vector<double>());
  EXPECT_EQ(weight_at(1), std::vector<double>{1.0});
  EXPECT_EQ(weight_at(2), std::vector<double>{5.0});
  EXPECT_EQ(weight_at(3), std::vector<double>());
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(Edges, OfTheHierarchyAreKnownByNameWhateverRelationCameFirst) {
  TestMap map(GetParam());
  const NodeId a('O', 1), b('O', 2);
  GraphDelta first = DeltaOfNodes(
      {MakeObject(1, "", BoxOf(0, 0, 0, 1, 1, 1)), MakeObject(2, "", BoxOf(2, 0, 0, 3, 1, 1))});
  first.edges = {MakeEdge(a, relations::kNear, b)};
  map.MustCommit(first);
  NodeFilter children_of_a;
  children_of_a.parent = a;
  EXPECT_TRUE(Ids(*map.Latest(), children_of_a).empty());
  // A neighbour that grows beyond the other's box is no child that sticks out.
  map.MustCommit(DeltaOfNodes({MakeObject(2, "", BoxOf(2, 0, 0, 9, 9, 9))}));
}

TEST_P(Edges, RemovedTwiceAreRemovedOnce) {
  TestMap map(GetParam());
  GraphDelta delta;
  delta.edge_removals = {{NodeId('O', 1), "NEVER_SEEN", NodeId('O', 2)}};
  map.MustCommit(delta);
  EXPECT_EQ(OrDie(map.reader().Head()).edge_count, 0);
}

TEST_P(Ancestors, AreNearestFirstAndFollowTheRevision) {
  TestMap map(GetParam());
  ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, 1)).ok());
  const std::vector<NodeId> above = {NodeId('R', 0), NodeId('B', 0)};
  EXPECT_EQ(OrDie(map.Latest()->Ancestors(NodeId('p', 1))), above);
  GraphDelta moved;
  moved.edge_removals = {{NodeId('R', 0), relations::kContains, NodeId('p', 1)}};
  map.MustCommit(moved);
  EXPECT_TRUE(OrDie(map.Latest()->Ancestors(NodeId('p', 1))).empty());
  EXPECT_EQ(OrDie(map.At(1)->Ancestors(NodeId('p', 1))), above);
}

TEST_P(Names, ResolveByIdThenByNameAndToTheLowestId) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeObject(300, "cup", BoxOf(0, 0, 0, 1, 1, 1)),
                               MakeObject(2, "cup", BoxOf(0, 0, 0, 1, 1, 1)),
                               MakeObject(5, "O300", BoxOf(0, 0, 0, 1, 1, 1)), MakeHuman(9, "12"),
                               MakeHuman(12, "ann")}));
  const auto snapshot = map.Latest();
  EXPECT_EQ(OrDie(snapshot->ResolveNode("cup")), NodeId('O', 2));
  EXPECT_EQ(OrDie(snapshot->ResolveNode("O300")), NodeId('O', 300));
  EXPECT_EQ(OrDie(snapshot->ResolveAgent("12")), NodeId('H', 9));
  EXPECT_EQ(OrDie(snapshot->ResolveAgent("H12")), NodeId('H', 12));
  EXPECT_EQ(ReasonOf(snapshot->ResolveAgent("cup").status()), Reason::kAgentUnknown);
  EXPECT_EQ(ReasonOf(snapshot->ResolveNode("Cup").status()), Reason::kNodeUnknown);
  EXPECT_EQ(ReasonOf(snapshot->ResolveNode("").status()), Reason::kNodeUnknown);
  EXPECT_EQ(ReasonOf(snapshot->ResolveNode("' OR 1=1 --").status()), Reason::kNodeUnknown);
}

TEST_P(Names, OfPastRevisionsResolveAsTheyDidThen) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1))}));
  map.MustCommit(DeltaOfNodes({MakeObject(1, "mug", BoxOf(0, 0, 0, 1, 1, 1))}));
  EXPECT_EQ(OrDie(map.At(1)->ResolveNode("cup")), NodeId('O', 1));
  EXPECT_FALSE(map.At(1)->ResolveNode("mug").ok());
  EXPECT_FALSE(map.Latest()->ResolveNode("cup").ok());
  EXPECT_EQ(OrDie(map.Latest()->ResolveNode("mug")), NodeId('O', 1));
}

TEST_P(Layers, AreAddedInBetweenAndKnownFromTheirRevisionOn) {
  TestMap map(GetParam());
  GraphDelta delta;
  delta.layers = {{40, "level", 450}};
  delta.nodes = {MakeNode(NodeId('L', 1), 40, "level", "first floor", Box3d())};
  map.MustCommit(delta);
  EXPECT_EQ(OrDie(map.Latest()->FindLayer("level")).rank, 450);
  const auto unknown = map.At(0)->FindLayer("level");
  EXPECT_EQ(ReasonOf(unknown.status()), Reason::kLayerUnknown);
  EXPECT_TRUE(absl::StrContains(unknown.status().message(), "rooms")) << unknown.status();
  const auto layers = OrDie(map.Latest()->Layers());
  EXPECT_TRUE(std::is_sorted(layers.begin(), layers.end(), [](const Layer& a, const Layer& b) {
    return std::tie(a.rank, a.name) < std::tie(b.rank, b.name);
  }));
  delta.layers[0].rank = 451;
  EXPECT_EQ(ReasonOf(map.Commit(delta).status()), Reason::kDeltaInvalid);
}

TEST_P(Labels, ChangeTheirNameWithoutForgettingTheOldOne) {
  TestMap map(GetParam());
  GraphDelta delta;
  delta.labels = {{1, "chair"}, {2, "table"}};
  map.MustCommit(delta);
  delta.labels = {{1, "armchair"}};
  map.MustCommit(delta);
  EXPECT_EQ(OrDie(map.Latest()->Labels()),
            (std::vector<SemanticLabel>{{1, "armchair"}, {2, "table"}}));
  EXPECT_EQ(OrDie(map.At(1)->Labels()), (std::vector<SemanticLabel>{{1, "chair"}, {2, "table"}}));
}

TEST_P(Scan, AscendsByIdStopsWhenToldAndGoesOnAfter) {
  TestMap map(GetParam());
  std::vector<Node> nodes;
  std::vector<NodeId> expected;
  // More than a batch, letters and numbers of all lengths.
  for (uint64_t i = 0; i < 700; ++i) {
    nodes.push_back(MakeObject(i * 37, "", BoxOf(0, 0, 0, 1, 1, 1)));
    nodes.push_back(
        MakeNode(NodeId('p', i), layers::kPlaces, kinds::kPlace, "", BoxOf(0, 0, 0, 1, 1, 1)));
  }
  for (const Node& node : nodes) expected.push_back(node.id);
  std::sort(expected.begin(), expected.end());
  map.MustCommit(DeltaOfNodes(nodes));
  const auto snapshot = map.Latest();
  EXPECT_EQ(Ids(*snapshot, {}), expected);
  std::vector<NodeId> paged;
  while (true) {
    size_t seen = 0;
    const NodeId after = paged.empty() ? NodeId() : paged.back();
    ASSERT_TRUE(snapshot
                    ->ScanNodes({}, after, {},
                                [&](const Node& node) {
                                  paged.push_back(node.id);
                                  return ++seen < 333;
                                })
                    .ok());
    if (seen < 333) break;
  }
  EXPECT_EQ(paged, expected);
}

// Filters answered by indexes must keep what a look at every node keeps.
TEST_P(Scan, WithAFilterEqualsALookAtEveryNode) {
  TestMap map(GetParam());
  for (int64_t s = 1; s <= 60; ++s) ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
  std::mt19937_64 random(RecordSeed());
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 200; ++i) {
    const auto snapshot = map.At(i % 2 == 0 ? 60 : static_cast<Revision>(1 + random() % 60));
    NodeFilter filter;
    if (random() % 2 == 0) filter.layer = static_cast<LayerId>(2 + random() % 4);
    if (random() % 4 == 0) filter.name = absl::StrCat("object ", random() % 30);
    if (random() % 3 == 0) filter.at_ns = static_cast<TimeNs>(random() % 120) * kSecond;
    if (random() % 2 == 0) {
      const double x = uniform(-10, 100), y = uniform(-10, 60);
      filter.box_map = BoxOf(x, y, uniform(-1, 1), x + uniform(0, 30), y + uniform(0, 30), 2);
    }
    const NodeId parent = random() % 4 == 0 ? NodeId('p', random() % 20) : NodeId();
    std::vector<NodeId> expected;
    for (const NodeId id : Ids(*snapshot, {})) {
      const bool is_child = parent.empty() || !OrDie(snapshot->Ancestors(id)).empty();
      if (!is_child || !filter.Matches(OrDie(snapshot->GetNode(id)))) continue;
      if (!parent.empty() && OrDie(snapshot->Ancestors(id)).front() != parent) continue;
      expected.push_back(id);
    }
    filter.parent = parent;
    EXPECT_EQ(Ids(*snapshot, filter), expected) << "question " << i;
  }
}

TEST_P(Scan, FindsThingsAtTheEdgeOfTheMappableWorld) {
  TestMap map(GetParam());
  const double far = 1.9e6;
  map.MustCommit(DeltaOfNodes({MakeObject(1, "", BoxOf(-far - 1, -far, 0, -far, 1 - far, 1)),
                               MakeObject(2, "", BoxOf(far, far, 0, far + 1, far + 1, 1))}));
  NodeFilter filter;
  filter.layer = layers::kObjects;
  filter.box_map = BoxOf(-1e9, -1e9, -1e9, 0, 0, 1e9);
  EXPECT_EQ(Ids(*map.Latest(), filter), std::vector<NodeId>{NodeId('O', 1)});
}

TEST_P(Stats, CountWhatAScanCounts) {
  TestMap map(GetParam());
  for (int64_t s = 1; s <= 30; ++s) {
    ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
    const auto snapshot = map.Latest();
    const MapStats stats = OrDie(snapshot->Stats());
    for (const LayerCount& count : stats.layers) {
      NodeFilter filter;
      filter.layer = count.layer.id;
      EXPECT_EQ(count.node_count, static_cast<int64_t>(Ids(*snapshot, filter).size()))
          << count.layer.name << " at revision " << s;
    }
    EXPECT_EQ(stats.at.node_count, static_cast<int64_t>(Ids(*snapshot, {}).size()));
    EXPECT_EQ(stats.at.edge_count, static_cast<int64_t>(Keys(*snapshot, {}).size()));
    int64_t pose_count = 0;
    int64_t stay_count = 0;
    for (const TrackInfo& track : OrDie(snapshot->Tracks())) {
      int64_t read_count = 0;
      ASSERT_TRUE(snapshot
                      ->ReadPoses(track.agent, kTimeMin, kTimeMax, {},
                                  [&](const TimedPose&) {
                                    ++read_count;
                                    return true;
                                  })
                      .ok());
      EXPECT_EQ(read_count, track.pose_count);
      pose_count += read_count;
      stay_count += static_cast<int64_t>(
          OrDie(snapshot->StaysOfAgent(track.agent, kTimeMin, kTimeMax)).size());
    }
    EXPECT_EQ(stats.at.pose_count, pose_count);
    EXPECT_EQ(stats.at.stay_count, stay_count);
    EXPECT_EQ(stats.at.mesh_block_count,
              static_cast<int64_t>(OrDie(snapshot->MeshBlocks()).size()));
    EXPECT_EQ(stats.bytes_on_disk > 0, !map.store().folder().empty());
  }
  EXPECT_EQ(map.Problems(), "");
}

}  // namespace
}  // namespace dsg::test
