// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class GraphAccess : public testing::Test {
 protected:
  GraphAccess() {
    MakeOffice(folder_.path());
    core_ = OpenCore(folder_.path());
  }

  absl::StatusOr<v1::GetNodeResponse> GetNode(const std::string& id, v1::NodeView view) {
    v1::GetNodeRequest request;
    request.set_map(kMap);
    request.set_id(id);
    request.set_view(view);
    v1::GetNodeResponse reply;
    const absl::Status status = core_->GetNode(call_, request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  absl::StatusOr<v1::ListNodesResponse> ListNodes(const v1::ListNodesRequest& request) {
    v1::ListNodesResponse reply;
    const absl::Status status = core_->ListNodes(call_, request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  // Ids of all pages, and how many pages there were.
  std::string AllNodes(v1::ListNodesRequest request, int page_size, int* page_count = nullptr) {
    std::string ids;
    request.set_map(kMap);
    request.set_page_size(page_size);
    do {
      const auto reply = ListNodes(request);
      EXPECT_TRUE(reply.ok()) << reply.status();
      if (!reply.ok()) return ids;
      EXPECT_LT(reply->ByteSizeLong(), size_t{4} << 20);
      for (const auto& node : reply->nodes()) ids += node.id() + " ";
      request.set_page_token(reply->next_page_token());
      if (page_count != nullptr) ++*page_count;
    } while (!request.page_token().empty());
    return ids;
  }

  absl::StatusOr<std::string> Nearest(v1::ListNearestNodesRequest request, double x) {
    request.set_map(kMap);
    request.mutable_position()->set_x(x);
    request.mutable_position()->set_y(5);
    request.mutable_position()->set_z(1);
    v1::ListNearestNodesResponse reply;
    const absl::Status status = core_->ListNearestNodes(call_, request, &reply);
    if (!status.ok()) return status;
    std::string text;
    for (const auto& nearest : reply.nodes()) text += nearest.node().id() + " ";
    return text;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
};

TEST_F(GraphAccess, GetsANodeByIdOrUniqueNameWithItsFamily) {
  for (const char* id : {"R1", "kitchen"}) {
    const auto reply = GetNode(id, v1::NODE_VIEW_FULL);
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->node().id(), "R1");
    EXPECT_EQ(reply->node().layer(), "rooms");
    EXPECT_EQ(reply->node().revision(), 1);
    EXPECT_EQ(reply->child_count(), 2);
    ASSERT_EQ(reply->ancestor_ids_size(), 1);
    EXPECT_EQ(reply->ancestor_ids(0), "B1");
  }
}

TEST_F(GraphAccess, ListsTheAgentsOfAnInstantWhereTheyWereThen) {
  v1::ListNodesRequest request;
  request.set_map(kMap);
  request.mutable_filter()->set_layer("agents");
  EXPECT_EQ(AllNodes(request, 10), "H12 H13 r1 ");
  request.mutable_filter()->set_at_ns(10 * kSecond);
  EXPECT_EQ(AllNodes(request, 10), "H12 H13 ");
  auto reply = ListNodes(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->nodes(0).map_t_node().position().x(), 11.0);
  EXPECT_EQ(reply->nodes(1).map_t_node().position().x(), 3.0);
  // In the gap of its track nobody knows where it was; the others came later or had left.
  request.mutable_filter()->set_at_ns(40 * kSecond);
  reply = ListNodes(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->nodes_size(), 1);
  EXPECT_EQ(reply->nodes(0).id(), "H12");
  EXPECT_FALSE(reply->nodes(0).has_map_t_node());
}

TEST_F(GraphAccess, ListsOfABoxAtAnInstantWhoWasInItThen) {
  v1::ListNodesRequest request;
  request.mutable_filter()->set_at_ns(10 * kSecond);
  v1::Box* const box = request.mutable_filter()->mutable_box();
  box->mutable_min()->set_x(10.5);
  box->mutable_max()->set_x(18.5);
  box->mutable_max()->set_y(10);
  box->mutable_max()->set_z(3);
  for (int page_size = 1; page_size <= 9; ++page_size) {
    EXPECT_EQ(AllNodes(request, page_size), "B1 H12 O2 R2 p3 ") << page_size;
  }
  request.mutable_filter()->set_at_ns(5 * kSecond);
  EXPECT_EQ(AllNodes(request, 3), "B1 O2 R2 p3 r1 ");
  // It stands at x = 19 in the end.
  box->mutable_min()->set_x(18.8);
  box->mutable_max()->set_x(19.2);
  EXPECT_EQ(AllNodes(request, 3), "B1 R2 ");
}

TEST_F(GraphAccess, FindsAmongAllTheNearestOfAnInstant) {
  v1::ListNearestNodesRequest request;
  request.mutable_filter()->set_at_ns(10 * kSecond);
  request.set_k(4);
  const auto near = Nearest(request, 11);
  ASSERT_TRUE(near.ok()) << near.status();
  EXPECT_NE(near->find("H12"), std::string::npos) << *near;
  const auto far = Nearest(request, 19);
  ASSERT_TRUE(far.ok()) << far.status();
  EXPECT_EQ(far->find("H12"), std::string::npos) << *far;
}

TEST_F(GraphAccess, TellsTheSpanOfAnAgentsTrack) {
  const auto reply = GetNode("H12", v1::NODE_VIEW_FULL);
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->first_pose_ns(), 0);
  EXPECT_EQ(reply->last_pose_ns(), 62 * kSecond);
  EXPECT_EQ(reply->pose_count(), 22);
}

TEST_F(GraphAccess, ShowsAsMuchOfANodeAsTheViewAsks) {
  const auto basic = GetNode("O1", v1::NODE_VIEW_BASIC);
  ASSERT_TRUE(basic.ok()) << basic.status();
  EXPECT_EQ(basic->node().name(), "cup");
  EXPECT_FALSE(basic->node().has_map_t_node());
  const auto geometry = GetNode("O1", v1::NODE_VIEW_GEOMETRY);
  ASSERT_TRUE(geometry.ok()) << geometry.status();
  EXPECT_NEAR(geometry->node().map_t_node().position().x(), 2.1, 1e-12);
  EXPECT_TRUE(geometry->node().has_bounding_box());
  EXPECT_EQ(geometry->node().revision(), 0);
  EXPECT_EQ(ReasonOf(GetNode("O1", static_cast<v1::NodeView>(9)).status()), Reason::kFieldInvalid);
}

TEST_F(GraphAccess, RefusesUnknownNodesAndSharedNames) {
  EXPECT_EQ(ReasonOf(GetNode("O99", v1::NODE_VIEW_FULL).status()), Reason::kNodeUnknown);
  EXPECT_EQ(ReasonOf(GetNode("", v1::NODE_VIEW_FULL).status()), Reason::kFieldInvalid);
  GraphDelta delta;
  delta.nodes = {MakeNode(NodeId('O', 3), layers::kObjects, kinds::kObject, "cup",
                          Box3d(Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(2, 2, 2)))};
  CommitToOffice(folder_.path(), std::move(delta));
  EXPECT_EQ(ReasonOf(GetNode("cup", v1::NODE_VIEW_FULL).status()), Reason::kFieldInvalid);
  EXPECT_TRUE(GetNode("O3", v1::NODE_VIEW_FULL).ok());
  // Everywhere else where a node may be told by its name.
  const auto expect_shared = [](const absl::Status& refused) {
    EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid) << refused;
    EXPECT_NE(refused.message().find("several nodes have this name"), std::string::npos) << refused;
  };
  v1::ListNodesRequest nodes;
  nodes.set_map(kMap);
  nodes.mutable_filter()->set_parent_id("cup");
  expect_shared(ListNodes(nodes).status());
  v1::ListEdgesRequest edges;
  edges.set_map(kMap);
  edges.set_source("cup");
  v1::ListEdgesResponse edges_reply;
  expect_shared(core_->ListEdges(call_, edges, &edges_reply));
  edges.clear_source();
  edges.set_target("cup");
  expect_shared(core_->ListEdges(call_, edges, &edges_reply));
  v1::ListNearestNodesRequest nearest;
  nearest.mutable_filter()->set_parent_id("cup");
  expect_shared(Nearest(nearest, 1.0).status());
  v1::ListInteractionsRequest interactions;
  interactions.set_map(kMap);
  interactions.set_from_ns(0);
  interactions.set_to_ns(1);
  interactions.set_object("cup");
  v1::ListInteractionsResponse interactions_reply;
  expect_shared(core_->ListInteractions(call_, interactions, &interactions_reply));
  v1::CheckCollisionRequest collision;
  collision.set_map(kMap);
  collision.mutable_scope()->add_ignored("cup");
  v1::CollisionBody* body = collision.add_bodies();
  body->mutable_sphere()->set_radius_m(0.25);
  body->add_poses()->mutable_position()->set_x(1);
  v1::CheckCollisionResponse collision_reply;
  expect_shared(core_->CheckCollision(call_, collision, &collision_reply));
}

TEST_F(GraphAccess, ListsNodesInOrderOfIdWhateverThePageSize) {
  const std::string whole = AllNodes({}, 1000);
  EXPECT_EQ(whole, "B1 H12 H13 O1 O2 R1 R2 p1 p2 p3 r1 ");
  for (const int page_size : {1, 2, 3, 11}) EXPECT_EQ(AllNodes({}, page_size), whole);
}

TEST_F(GraphAccess, NarrowsByLayerKindParentBoxAndName) {
  v1::ListNodesRequest request;
  request.mutable_filter()->set_layer("places");
  EXPECT_EQ(AllNodes(request, 2), "p1 p2 p3 ");
  request.mutable_filter()->set_parent_id("kitchen");
  EXPECT_EQ(AllNodes(request, 2), "p1 p2 ");
  request.mutable_filter()->clear_layer();
  request.mutable_filter()->clear_parent_id();
  request.mutable_filter()->set_kind("human");
  EXPECT_EQ(AllNodes(request, 1), "H12 H13 ");
  request.mutable_filter()->set_name("13");
  EXPECT_EQ(AllNodes(request, 1), "H13 ");
  request.clear_filter();
  v1::Box* box = request.mutable_filter()->mutable_box();
  box->mutable_min()->set_x(13);
  box->mutable_min()->set_y(4);
  box->mutable_max()->set_x(14.5);
  box->mutable_max()->set_y(5);
  box->mutable_max()->set_z(1);
  EXPECT_EQ(AllNodes(request, 1), "B1 O2 R2 p3 ");
}

TEST_F(GraphAccess, RefusesUnknownLayersAndParents) {
  v1::ListNodesRequest request;
  request.set_map(kMap);
  request.mutable_filter()->set_layer("attic");
  EXPECT_EQ(ReasonOf(ListNodes(request).status()), Reason::kLayerUnknown);
  request.mutable_filter()->clear_layer();
  request.mutable_filter()->set_parent_id("R77");
  EXPECT_EQ(ReasonOf(ListNodes(request).status()), Reason::kNodeUnknown);
}

TEST_F(GraphAccess, CutsPagesOfLargeNodesSoThatEveryReplyFits) {
  GraphDelta delta;
  for (uint64_t i = 10; i < 40; ++i) {
    delta.nodes.push_back(MakeNode(NodeId('O', i), layers::kObjects, kinds::kObject, "",
                                   Box3d(Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(2, 2, 2))));
    for (int k = 0; k < 5; ++k) {
      delta.nodes.back().attributes["note" + std::to_string(k)] = std::string(60'000, 'x');
    }
  }
  CommitToOffice(folder_.path(), std::move(delta));
  int page_count = 0;
  const std::string whole = AllNodes({}, 1000, &page_count);
  EXPECT_GT(page_count, 4);
  EXPECT_EQ(whole, AllNodes({}, 1));
}

TEST_F(GraphAccess, ListsEdgesInOrderWhateverThePageSize) {
  const auto all = [&](v1::ListEdgesRequest request, int page_size) {
    std::string text;
    request.set_map(kMap);
    request.set_page_size(page_size);
    do {
      v1::ListEdgesResponse reply;
      const absl::Status status = core_->ListEdges(call_, request, &reply);
      EXPECT_TRUE(status.ok()) << status;
      for (const auto& edge : reply.edges()) {
        text += edge.source() + "-" + edge.relation().substr(0, 1) + "-" + edge.target() + " ";
      }
      request.set_page_token(reply.next_page_token());
    } while (!request.page_token().empty());
    return text;
  };
  const std::string whole = all({}, 1000);
  EXPECT_EQ(whole, "B1-C-R1 B1-C-R2 R1-C-p1 R1-C-p2 R2-C-p3 p1-C-O1 p1-T-p2 p2-T-p3 p3-C-O2 ");
  for (const int page_size : {1, 2, 4}) EXPECT_EQ(all({}, page_size), whole);
  v1::ListEdgesRequest request;
  request.set_relation("TRAVERSABLE");
  EXPECT_EQ(all(request, 1), "p1-T-p2 p2-T-p3 ");
  request.set_target("p3");
  EXPECT_EQ(all(request, 1), "p2-T-p3 ");
  request.Clear();
  request.set_source("kitchen");
  EXPECT_EQ(all(request, 1), "R1-C-p1 R1-C-p2 ");
}

TEST_F(GraphAccess, RefusesATokenOfAnotherList) {
  v1::ListNodesRequest request;
  request.set_map(kMap);
  request.set_page_size(1);
  const auto reply = ListNodes(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  v1::ListEdgesRequest edges;
  edges.set_map(kMap);
  edges.set_page_token(reply->next_page_token());
  v1::ListEdgesResponse edge_reply;
  EXPECT_EQ(ReasonOf(core_->ListEdges(call_, edges, &edge_reply)), Reason::kPageTokenMismatch);
}

TEST_F(GraphAccess, FindsTheNearestNodesByDistanceToTheirBoxes) {
  v1::ListNearestNodesRequest request;
  request.mutable_filter()->set_layer("objects");
  request.set_k(5);
  EXPECT_EQ(Nearest(request, 1).value_or("error"), "O1 O2 ");
  EXPECT_EQ(Nearest(request, 19).value_or("error"), "O2 O1 ");
  request.set_max_distance_m(5);
  EXPECT_EQ(Nearest(request, 1).value_or("error"), "O1 ");
  request.set_max_distance_m(0);
  request.set_k(0);
  EXPECT_EQ(Nearest(request, 1).value_or("error"), "O1 ");
}

TEST_F(GraphAccess, FindsAgentsWhereTheyWereAtTheInstant) {
  v1::ListNearestNodesRequest request;
  request.mutable_filter()->set_kind("human");
  request.set_k(5);
  EXPECT_EQ(ReasonOf(Nearest(request, 3).status()), Reason::kFieldInvalid);
  request.mutable_filter()->set_at_ns(10 * kSecond);
  // H12 is at x = 11 then, H13 at x = 3.
  EXPECT_EQ(Nearest(request, 4).value_or("error"), "H13 H12 ");
  EXPECT_EQ(Nearest(request, 10).value_or("error"), "H12 H13 ");
  request.mutable_filter()->set_at_ns(40 * kSecond);
  EXPECT_EQ(Nearest(request, 10).value_or("error"), "");
  request.mutable_filter()->set_at_ns(5 * kSecond);
  request.mutable_filter()->clear_kind();
  request.mutable_filter()->set_layer("agents");
  EXPECT_EQ(Nearest(request, 20).value_or("error"), "r1 H12 H13 ");
}

TEST_F(GraphAccess, RefusesPointsAndNumbersThatMeanNothing) {
  v1::ListNearestNodesRequest request;
  EXPECT_EQ(ReasonOf(Nearest(request, std::numeric_limits<double>::quiet_NaN()).status()),
            Reason::kNumberNotFinite);
  request.set_k(-1);
  EXPECT_EQ(ReasonOf(Nearest(request, 0).status()), Reason::kFieldInvalid);
  request.set_k(1001);
  EXPECT_EQ(ReasonOf(Nearest(request, 0).status()), Reason::kFieldInvalid);
  request.set_k(1);
  request.set_max_distance_m(-1);
  EXPECT_EQ(ReasonOf(Nearest(request, 0).status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::test
