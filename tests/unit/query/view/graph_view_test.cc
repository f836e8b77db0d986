// SPDX-License-Identifier: Apache-2.0
#include "query/view/graph_view.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "query/view/indexed_view.h"
#include "schema/model/known_names.h"
#include "tests/unit/query/view/changing_map.h"

namespace dsg::query {
namespace {

using test::ChangingMap;
using ViewPtr = std::shared_ptr<const GraphView>;

Node MakeNode(NodeId id, LayerId layer, const char* kind) {
  Node node;
  node.id = id;
  node.layer = layer;
  node.kind = kind;
  return node;
}

// Commits changes of one map one by one and shows the view after each, derived from the one before.
class StepByStep {
 public:
  StepByStep() : map_(1) { view_ = Next(GraphDelta()); }

  ViewPtr Next(GraphDelta delta) {
    delta.session_id = "steps";
    delta.sequence = ++sequence_;
    const Revision revision = map_.Commit(std::move(delta));
    auto view = view_ == nullptr
                    ? GraphView::Load(*map_.At(revision), std::make_shared<SymbolTable>(), {})
                    : GraphView::Derive(view_, map_.reader().get(), *map_.At(revision), {});
    EXPECT_TRUE(view.ok()) << view.status();
    return view_ = *view;
  }
  const ChangingMap& map() const { return map_; }

 private:
  ChangingMap map_;
  ViewPtr view_;
  int64_t sequence_ = 0;
};

GraphDelta Flat() {
  GraphDelta delta;
  for (uint64_t i = 0; i < 2; ++i) {
    delta.nodes.push_back(MakeNode(NodeId('R', i), layers::kRooms, kinds::kRoom));
    delta.nodes.push_back(MakeNode(NodeId('p', i), layers::kPlaces, kinds::kPlace));
    delta.nodes.push_back(MakeNode(NodeId('O', i), layers::kObjects, kinds::kObject));
    delta.edges.push_back({NodeId('R', i), relations::kContains, NodeId('p', i)});
    delta.edges.push_back({NodeId('p', i), relations::kContains, NodeId('O', i)});
  }
  delta.edges.push_back({NodeId('p', 0), relations::kTraversable, NodeId('p', 1), 0.4});
  return delta;
}

TEST(GraphView, IsEmptyOfAnEmptyMap) {
  const ChangingMap map(1);
  const auto loaded = GraphView::Load(*map.At(0), std::make_shared<SymbolTable>(), {});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  const GraphView& view = **loaded;
  EXPECT_EQ(view.node_count(), 0);
  EXPECT_EQ(view.edge_count(), 0);
  EXPECT_EQ(view.layers(), *map.At(0)->Layers());
  EXPECT_TRUE(view.Parent(NodeId('p', 1)).empty());
  view.ForEachNearest(Eigen::Vector3d::Zero(), {}, 1e9, [](const ViewNode&, double) {
    ADD_FAILURE();
    return true;
  });
}

TEST(GraphView, KeepsThePlacesOfItsNeighbourWhileNoneDiffers) {
  StepByStep steps;
  const ViewPtr first = steps.Next(Flat());
  GraphDelta objects;
  objects.nodes.push_back(MakeNode(NodeId('O', 7), layers::kObjects, kinds::kObject));
  objects.edges.push_back({NodeId('p', 0), relations::kContains, NodeId('O', 7)});
  objects.edge_removals.push_back({NodeId('p', 1), relations::kContains, NodeId('O', 1)});
  const ViewPtr second = steps.Next(objects);
  EXPECT_EQ(*first->Places({}), *second->Places({}));
}

TEST(GraphView, MakesPlacesAnewWhenPlacesLinksOrRoomsDiffer) {
  StepByStep steps;
  ViewPtr before = steps.Next(Flat());
  const auto expect_other_places = [&](const GraphDelta& delta, const char* what) {
    const ViewPtr after = steps.Next(delta);
    EXPECT_NE(*before->Places({}), *after->Places({})) << what;
    before = after;
  };
  GraphDelta moved;
  moved.nodes.push_back(MakeNode(NodeId('p', 1), layers::kPlaces, kinds::kPlace));
  moved.nodes.back().map_T_node.position = {1, 2, 3};
  expect_other_places(moved, "a place moved");
  GraphDelta linked;
  linked.edges.push_back({NodeId('p', 0), relations::kTraversable, NodeId('p', 1), 0.3});
  expect_other_places(linked, "a link changed");
  GraphDelta rehoused;
  rehoused.edge_removals.push_back({NodeId('R', 1), relations::kContains, NodeId('p', 1)});
  rehoused.edges.push_back({NodeId('R', 0), relations::kContains, NodeId('p', 1)});
  expect_other_places(rehoused, "a place is in another room");
  GraphDelta gone;
  gone.retirements.push_back({NodeId('p', 1), std::nullopt});
  expect_other_places(gone, "a place never was");
}

TEST(GraphView, StopsWhenItIsTold) {
  ChangingMap map(1);
  Revision head = 0;
  for (int i = 0; i < 10; ++i) head = map.Grow();
  const auto stop = [] { return absl::CancelledError("enough"); };
  const auto view = GraphView::Load(*map.At(head), std::make_shared<SymbolTable>(), stop);
  EXPECT_TRUE(absl::IsCancelled(view.status())) << view.status();
}

TEST(GraphView, SharesAllButWhatAChangeTouches) {
  StepByStep steps;
  GraphDelta many;
  for (uint64_t i = 0; i < 20'000; ++i) {
    many.nodes.push_back(MakeNode(NodeId('p', i), layers::kPlaces, kinds::kPlace));
    many.nodes.back().map_T_node.position = {static_cast<double>(i % 141),
                                             static_cast<double>(i / 141), 0};
    if (i > 0) {
      many.edges.push_back({NodeId('p', i - 1), relations::kTraversable, NodeId('p', i), 0.5});
    }
  }
  const ViewPtr whole = steps.Next(many);
  GraphDelta one;
  one.nodes.push_back(MakeNode(NodeId('p', 777), layers::kPlaces, kinds::kPlace));
  one.nodes.back().map_T_node.position = {70, 70, 1};
  const ViewPtr changed = steps.Next(one);
  EXPECT_EQ(changed->FindNode(NodeId('p', 15'000)), whole->FindNode(NodeId('p', 15'000)));
  EXPECT_NE(changed->FindNode(NodeId('p', 777)), whole->FindNode(NodeId('p', 777)));
  EXPECT_LT(static_cast<const IndexedView&>(*changed).fresh_bytes(), whole->memory_bytes() / 100);
}

TEST(GraphView, TakesAtMost400BytesANodeAnd60AnEdge) {
  StepByStep steps;
  GraphDelta nodes;
  for (uint64_t i = 0; i < 20'000; ++i) {
    nodes.nodes.push_back(MakeNode(NodeId('p', i), layers::kPlaces, kinds::kPlace));
    nodes.nodes.back().name = absl::StrCat("place ", i);
  }
  const size_t of_nodes = steps.Next(std::move(nodes))->memory_bytes();
  EXPECT_LE(of_nodes, 400U * 20'000U);
  GraphDelta edges;
  for (uint64_t i = 0; i < 60'000; ++i) {
    edges.edges.push_back({NodeId('p', i % 20'000), relations::kTraversable,
                           NodeId('p', (i + 1 + i / 20'000 * 100) % 20'000), 0.5});
  }
  steps.Next(std::move(edges));
  const auto whole = GraphView::Load(*steps.map().At(steps.map().reader()->Head()->revision),
                                     std::make_shared<SymbolTable>(), {});
  EXPECT_LE((*whole)->memory_bytes() - of_nodes, 60U * 60'000U);
}

TEST(GraphView, KeepsNoAttributeThatIsForAnExportOnly) {
  StepByStep steps;
  GraphDelta delta;
  delta.nodes.push_back(MakeNode(NodeId('p', 1), layers::kPlaces, kinds::kPlace));
  delta.nodes.back().attributes["real_place"] = true;
  delta.nodes.back().attributes[attributes::kSparkRest] = std::string(10'000, 'x');
  delta.nodes.back().attributes["spark_dsg_2"] = std::string(10'000, 'y');
  const ViewPtr view = steps.Next(std::move(delta));
  const auto kept = view->FindNode(NodeId('p', 1))->attributes();
  ASSERT_EQ(kept.size(), 1U);
  EXPECT_EQ(view->symbols().Text(kept[0].name), "real_place");
  EXPECT_EQ(kept[0].value, AttributeValue(true));
  EXPECT_LT(view->memory_bytes(), 15'000U);
}

}  // namespace
}  // namespace dsg::query
