// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class Neighborhood : public testing::Test {
 protected:
  Neighborhood() {
    MakeOffice(folder_.path());
    core_ = OpenCore(folder_.path());
  }

  // "p1-C-O1 ..." of all pages, or the error.
  std::string Neighbors(v1::GetNeighborsRequest request, int page_size) {
    std::string text;
    request.set_map(kMap);
    request.set_page_size(page_size);
    do {
      v1::GetNeighborsResponse reply;
      const absl::Status status = core_->GetNeighbors(call_, request, &reply);
      if (!status.ok()) return std::string(status.message());
      for (const v1::Neighbor& neighbor : reply.neighbors()) {
        const v1::Edge& edge = neighbor.edge();
        text += edge.source() + "-" + edge.relation().substr(0, 1) + "-" + edge.target() + ":" +
                neighbor.node().id() + " ";
      }
      request.set_page_token(reply.next_page_token());
    } while (!request.page_token().empty());
    return text;
  }

  Reason ReasonOfNeighbors(v1::GetNeighborsRequest request) {
    request.set_map(kMap);
    v1::GetNeighborsResponse reply;
    return ReasonOf(core_->GetNeighbors(call_, request, &reply));
  }

  // Nodes, a bar, edges; or the error.
  std::string Subgraph(v1::GetSubgraphRequest request, int* message_count = nullptr) {
    std::string nodes;
    std::string edges;
    request.set_map(kMap);
    const absl::Status status = query::ReadStream(
        call_, core_->GetSubgraph(call_, request), [&](const v1::GetSubgraphResponse& reply) {
          if (message_count != nullptr) ++*message_count;
          EXPECT_LT(reply.ByteSizeLong(), size_t{4} << 20);
          // No node after the first edge.
          EXPECT_TRUE(edges.empty() || reply.nodes().empty());
          for (const v1::Node& node : reply.nodes()) nodes += node.id() + " ";
          for (const v1::Edge& edge : reply.edges()) {
            edges += edge.source() + "-" + edge.relation().substr(0, 1) + "-" + edge.target() + " ";
          }
          return true;
        });
    if (!status.ok()) return std::string(status.message());
    return nodes + "| " + edges;
  }

  Reason ReasonOfSubgraph(v1::GetSubgraphRequest request) {
    request.set_map(kMap);
    return ReasonOf(query::ReadStream(call_, core_->GetSubgraph(call_, request),
                                      [](const v1::GetSubgraphResponse&) { return true; }));
  }

  static v1::GetSubgraphRequest From(const std::string& root) {
    v1::GetSubgraphRequest request;
    request.set_root(root);
    return request;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
};

TEST_F(Neighborhood, ListsEdgesBothWaysOutgoingFirstWhateverThePageSize) {
  v1::GetNeighborsRequest request;
  request.set_id("p2");
  EXPECT_EQ(Neighbors(request, 100), "p2-T-p3:p3 R1-C-p2:R1 p1-T-p2:p1 ");
  for (const int page_size : {1, 2, 3}) {
    EXPECT_EQ(Neighbors(request, page_size), Neighbors(request, 100));
  }
  request.set_outgoing(true);
  EXPECT_EQ(Neighbors(request, 1), "p2-T-p3:p3 ");
  request.set_incoming(true);
  request.add_relations("CONTAINS");
  EXPECT_EQ(Neighbors(request, 1), "R1-C-p2:R1 ");
  request.set_id("kitchen");
  EXPECT_EQ(Neighbors(request, 1), "R1-C-p1:p1 R1-C-p2:p2 B1-C-R1:B1 ");
}

TEST_F(Neighborhood, HonoursTheInstantOnEdgesAndTheirEnds) {
  GraphDelta delta;
  Node lamp = MakeNode(NodeId('O', 5), layers::kObjects, kinds::kObject, "lamp",
                       Box3d(Eigen::Vector3d(1, 4, 0), Eigen::Vector3d(2, 5, 1)));
  lamp.valid = {10, 20};
  delta.nodes = {lamp};
  Edge near;
  near.source = NodeId('O', 1);
  near.relation = relations::kNear;
  near.target = lamp.id;
  near.valid = {0, 15};
  delta.edges = {near};
  CommitToOffice(folder_.path(), std::move(delta));
  v1::GetNeighborsRequest request;
  request.set_id("O1");
  request.add_relations("NEAR");
  EXPECT_EQ(Neighbors(request, 1), "O1-N-O5:O5 ");
  for (const auto& [at_ns, expected] :
       {std::pair<int64_t, const char*>{5, ""}, {10, "O1-N-O5:O5 "}, {15, ""}}) {
    request.set_at_ns(at_ns);
    EXPECT_EQ(Neighbors(request, 1), expected) << at_ns;
  }
  request.clear_at_ns();
  request.mutable_read_at()->set_exact_revision(1);
  EXPECT_EQ(Neighbors(request, 1), "");
}

TEST_F(Neighborhood, RefusesUnknownNodesRelationsAndForeignTokens) {
  v1::GetNeighborsRequest request;
  EXPECT_EQ(ReasonOfNeighbors(request), Reason::kFieldInvalid);
  request.set_id("O99");
  EXPECT_EQ(ReasonOfNeighbors(request), Reason::kNodeUnknown);
  request.set_id("p2");
  request.add_relations("TRAVERSIBLE");
  EXPECT_EQ(ReasonOfNeighbors(request), Reason::kRelationUnknown);
  request.set_relations(0, "INSIDE");
  EXPECT_EQ(ReasonOfNeighbors(request), Reason::kRelationUnknown);
  // The model knows it, the map has none.
  request.set_relations(0, "HELD_BY");
  EXPECT_EQ(Neighbors(request, 1), "");
  request.clear_relations();
  request.set_page_token("nonsense");
  EXPECT_EQ(ReasonOfNeighbors(request), Reason::kPageTokenMismatch);
  request.clear_page_token();
  request.set_view(static_cast<v1::NodeView>(9));
  EXPECT_EQ(ReasonOfNeighbors(request), Reason::kFieldInvalid);
}

TEST_F(Neighborhood, GetsManyNodesInTheOrderAskedEachWithItsOwnError) {
  v1::BatchGetNodesRequest request;
  request.set_map(kMap);
  for (const char* id : {"p3", "O99", "kitchen", "p3", "", "!"}) request.add_ids(id);
  v1::BatchGetNodesResponse reply;
  ASSERT_TRUE(core_->BatchGetNodes(call_, request, &reply).ok());
  ASSERT_EQ(reply.results_size(), 6);
  EXPECT_EQ(reply.results(0).node().id(), "p3");
  EXPECT_EQ(reply.results(1).status_code(), static_cast<int>(absl::StatusCode::kNotFound));
  EXPECT_FALSE(reply.results(1).has_node());
  EXPECT_EQ(reply.results(2).node().id(), "R1");
  EXPECT_EQ(reply.results(3).node().id(), "p3");
  EXPECT_EQ(reply.results(4).status_code(), static_cast<int>(absl::StatusCode::kInvalidArgument));
  EXPECT_EQ(reply.results(5).status_code(), static_cast<int>(absl::StatusCode::kNotFound));
  for (int i = 0; i < 1000; ++i) request.add_ids("p1");
  EXPECT_EQ(ReasonOf(core_->BatchGetNodes(call_, request, &reply)), Reason::kFieldInvalid);
}

TEST_F(Neighborhood, WalksDownTheHierarchyNodesBeforeEdges) {
  EXPECT_EQ(Subgraph(From("R1")), "R1 p1 p2 O1 | R1-C-p1 R1-C-p2 p1-C-O1 p1-T-p2 ");
  EXPECT_EQ(Subgraph(From("HQ")),
            "B1 R1 R2 p1 p2 p3 O1 O2 | B1-C-R1 B1-C-R2 R1-C-p1 R1-C-p2 R2-C-p3 p1-C-O1 p1-T-p2 "
            "p2-T-p3 p3-C-O2 ");
  auto request = From("B1");
  request.set_depth_max(1);
  EXPECT_EQ(Subgraph(request), "B1 R1 R2 | B1-C-R1 B1-C-R2 ");
  request.set_depth_max(2);
  request.set_tree_only(true);
  EXPECT_EQ(Subgraph(request), "B1 R1 R2 p1 p2 p3 | B1-C-R1 B1-C-R2 R1-C-p1 R1-C-p2 R2-C-p3 ");
}

TEST_F(Neighborhood, FollowsTheRelationsAndDirectionsAskedFor) {
  auto request = From("p2");
  request.add_relations("TRAVERSABLE");
  EXPECT_EQ(Subgraph(request), "p2 p3 | p2-T-p3 ");
  request.set_both_directions(true);
  EXPECT_EQ(Subgraph(request), "p2 p1 p3 | p1-T-p2 p2-T-p3 ");
  request.add_relations("CONTAINS");
  request.mutable_filter()->set_layer("places");
  EXPECT_EQ(Subgraph(request), "p2 p1 p3 | p1-T-p2 p2-T-p3 ");
  request = From("B1");
  // Rooms fail, so nothing below them is reached.
  request.mutable_filter()->set_kind("place");
  EXPECT_EQ(Subgraph(request), "B1 | ");
  request.mutable_filter()->set_kind("cactus");
  EXPECT_EQ(Subgraph(request), "B1 | ");
}

TEST_F(Neighborhood, HonoursTheInstantOnEveryHop) {
  GraphDelta delta;
  Node box = MakeNode(NodeId('O', 7), layers::kObjects, kinds::kObject, "box",
                      Box3d(Eigen::Vector3d(1, 4, 0), Eigen::Vector3d(2, 5, 1)));
  delta.nodes = {box};
  Edge in;
  in.source = NodeId('p', 1);
  in.relation = relations::kContains;
  in.target = box.id;
  in.valid = {10, 20};
  delta.edges = {in};
  CommitToOffice(folder_.path(), std::move(delta));
  auto request = From("p1");
  EXPECT_EQ(Subgraph(request), "p1 O1 O7 | p1-C-O1 p1-C-O7 ");
  request.mutable_filter()->set_at_ns(10);
  EXPECT_EQ(Subgraph(request), "p1 O1 O7 | p1-C-O1 p1-C-O7 ");
  request.mutable_filter()->set_at_ns(20);
  EXPECT_EQ(Subgraph(request), "p1 O1 | p1-C-O1 ");
}

TEST_F(Neighborhood, ReachesAgentsWhereTheyWereAtTheInstant) {
  GraphDelta delta;
  for (const uint64_t human : {12, 13}) {
    delta.edges.push_back({NodeId('H', human), relations::kSameAs, NodeId('O', 1), 1.0});
  }
  CommitToOffice(folder_.path(), std::move(delta));
  auto request = From("O1");
  request.set_map(kMap);
  request.add_relations(relations::kSameAs);
  request.set_both_directions(true);
  const auto x_of_last = [&] {
    double x = -1.0;
    EXPECT_TRUE(query::ReadStream(call_, core_->GetSubgraph(call_, request),
                                  [&](const v1::GetSubgraphResponse& reply) {
                                    const v1::Node& last = reply.nodes(reply.nodes_size() - 1);
                                    if (last.has_map_t_node()) x = last.map_t_node().position().x();
                                    return true;
                                  })
                    .ok());
    return x;
  };
  request.mutable_filter()->set_at_ns(10 * kSecond);
  EXPECT_EQ(Subgraph(request), "O1 H12 H13 | H12-S-O1 H13-S-O1 ");
  EXPECT_EQ(x_of_last(), 3.0);
  // H13 has left; H12 is in a gap of its track, and so in no box.
  request.mutable_filter()->set_at_ns(40 * kSecond);
  EXPECT_EQ(Subgraph(request), "O1 H12 | H12-S-O1 ");
  EXPECT_EQ(x_of_last(), -1.0);
  v1::Box* const box = request.mutable_filter()->mutable_box();
  box->mutable_min()->set_x(10.5);
  box->mutable_max()->set_x(11.5);
  box->mutable_max()->set_y(10.0);
  box->mutable_max()->set_z(3.0);
  EXPECT_EQ(Subgraph(request), "O1 | ");
  request.mutable_filter()->set_at_ns(10 * kSecond);
  EXPECT_EQ(Subgraph(request), "O1 H12 | H12-S-O1 ");
}

TEST_F(Neighborhood, CutsLargeSubgraphsIntoMessages) {
  GraphDelta delta;
  for (uint64_t i = 10; i < 60; ++i) {
    delta.nodes.push_back(MakeNode(NodeId('O', i), layers::kObjects, kinds::kObject, "",
                                   Box3d(Eigen::Vector3d(1, 4, 0), Eigen::Vector3d(2, 5, 1))));
    for (int k = 0; k < 3; ++k) {
      delta.nodes.back().attributes["note" + std::to_string(k)] = std::string(60'000, 'x');
    }
    Edge in;
    in.source = NodeId('p', 1);
    in.relation = relations::kContains;
    in.target = NodeId('O', i);
    in.attributes["note"] = std::string(60'000, 'y');
    delta.edges.push_back(in);
  }
  CommitToOffice(folder_.path(), std::move(delta));
  int message_count = 0;
  const std::string whole = Subgraph(From("p1"), &message_count);
  // 9 MB of nodes and 3 MB of edges.
  EXPECT_GE(message_count, 9);
  EXPECT_EQ(std::count(whole.begin(), whole.end(), ' '), 52 + 1 + 51);
  auto request = From("p1");
  request.set_tree_only(true);
  EXPECT_EQ(Subgraph(request), whole);
}

TEST_F(Neighborhood, RefusesWalksThatMeanNothing) {
  EXPECT_EQ(ReasonOfSubgraph(From("")), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOfSubgraph(From("O99")), Reason::kNodeUnknown);
  auto request = From("B1");
  request.set_depth_max(-1);
  EXPECT_EQ(ReasonOfSubgraph(request), Reason::kFieldInvalid);
  request = From("B1");
  request.add_relations("CONTANIS");
  EXPECT_EQ(ReasonOfSubgraph(request), Reason::kRelationUnknown);
  request = From("B1");
  request.mutable_filter()->set_layer("attic");
  EXPECT_EQ(ReasonOfSubgraph(request), Reason::kLayerUnknown);
  request = From("B1");
  request.mutable_filter()->set_name("kitchen");
  EXPECT_EQ(ReasonOfSubgraph(request), Reason::kFieldInvalid);
  request = From("B1");
  request.mutable_filter()->mutable_box()->mutable_min()->set_x(
      std::numeric_limits<double>::quiet_NaN());
  request.mutable_filter()->mutable_box()->mutable_max();
  EXPECT_EQ(ReasonOfSubgraph(request), Reason::kNumberNotFinite);
}

TEST_F(Neighborhood, StopsWhenTheReaderGoesAway) {
  int message_count = 0;
  auto request = From("B1");
  request.set_map(kMap);
  EXPECT_TRUE(query::ReadStream(call_, core_->GetSubgraph(call_, request),
                                [&](const v1::GetSubgraphResponse&) {
                                  ++message_count;
                                  call_.Cancel();
                                  return false;
                                })
                  .ok());
  EXPECT_EQ(message_count, 1);
  EXPECT_TRUE(
      absl::IsCancelled(query::ReadStream(call_, core_->GetSubgraph(call_, request),
                                          [](const v1::GetSubgraphResponse&) { return true; })));
}

}  // namespace
}  // namespace dsg::test
