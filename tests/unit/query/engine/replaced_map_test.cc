// SPDX-License-Identifier: Apache-2.0
// A map that is replaced by another timeline while a service that has only read keeps it open.
#include <gtest/gtest.h>

#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

// Person "ann" is `ann` here, and stands in place p1, which is in building `building`.
GraphDelta Timeline(NodeId ann, NodeId building) {
  GraphDelta delta;
  delta.nodes = {MakeNode(ann, layers::kAgents, kinds::kHuman, "ann", Box3d())};
  if (building != NodeId('B', 1)) {
    delta.nodes.push_back(MakeNode(building, layers::kBuildings, kinds::kBuilding, "annexe",
                                   Box3d(Eigen::Vector3d::Zero(), Eigen::Vector3d(20, 10, 3))));
    Edge moved;
    moved.relation = relations::kContains;
    moved.target = NodeId('R', 1);
    moved.source = building;
    delta.edges = {moved};
    delta.edge_removals = {{NodeId('B', 1), relations::kContains, NodeId('R', 1)}};
  }
  delta.appends = {{ann, {PoseAt(0, 2, 5, 1), PoseAt(kSecond, 3, 5, 1)}}};
  delta.stays = {{ann, NodeId('p', 1), NodeId('R', 1), 0, kSecond}};
  return delta;
}

class ReplacedMap : public testing::Test {
 protected:
  ReplacedMap() {
    MakeOffice(folder_.path());
    CommitToOffice(folder_.path(), Timeline(NodeId('H', 20), NodeId('B', 1)));
    MakeOffice(other_.path());
    CommitToOffice(other_.path(), Timeline(NodeId('H', 21), NodeId('B', 2)));
    core_ = OpenCore(folder_.path());
  }

  // As `dsg restore --force` of another process.
  void Replace() {
    const std::string file = folder_.path() + "/restored";
    const auto other = GraphStore::Open(other_.path(), {});
    ASSERT_TRUE((*(*other)->OpenMap(kMap))->CopyTo(file, {}, {}).ok());
    const auto store = GraphStore::Open(folder_.path(), {});
    const absl::Status installed = (*store)->InstallMap(kMap, file, /*replace=*/true);
    ASSERT_TRUE(installed.ok()) << installed;
  }

  v1::LocateAgentResponse WhereIsAnn() {
    v1::LocateAgentRequest request;
    request.set_map(kMap);
    request.set_agent("ann");
    request.set_at_ns(0);
    v1::LocateAgentResponse reply;
    const absl::Status status = core_->LocateAgent(call_, request, &reply);
    EXPECT_TRUE(status.ok()) << status;
    return reply;
  }

  TempFolder folder_;
  TempFolder other_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
};

TEST_F(ReplacedMap, IsAnsweredFromItselfAtTheSameRevision) {
  const v1::LocateAgentResponse before = WhereIsAnn();
  EXPECT_EQ(before.agent_id(), "H20");
  EXPECT_EQ(before.building_id(), "B1");
  Replace();
  const v1::LocateAgentResponse after = WhereIsAnn();
  EXPECT_EQ(after.header().read_revision(), before.header().read_revision());
  EXPECT_EQ(after.agent_id(), "H21");
  EXPECT_EQ(after.building_id(), "B2");
}

TEST_F(ReplacedMap, HasAnotherIncarnationThatStaysUntilTheNext) {
  const std::string before = WhereIsAnn().header().incarnation();
  EXPECT_FALSE(before.empty());
  EXPECT_EQ(WhereIsAnn().header().incarnation(), before);
  core_ = OpenCore(folder_.path());
  EXPECT_EQ(WhereIsAnn().header().incarnation(), before);
  Replace();
  const std::string after = WhereIsAnn().header().incarnation();
  EXPECT_NE(after, before);
  core_ = OpenCore(folder_.path());
  EXPECT_EQ(WhereIsAnn().header().incarnation(), after);
}

TEST_F(ReplacedMap, RefusesPageTokensOfTheOneBefore) {
  v1::ListNodesRequest nodes;
  nodes.set_map(kMap);
  nodes.set_page_size(2);
  v1::ListNodesResponse page;
  ASSERT_TRUE(core_->ListNodes(call_, nodes, &page).ok());
  nodes.set_page_token(page.next_page_token());
  ASSERT_TRUE(core_->ListNodes(call_, nodes, &page).ok());
  v1::DiffRevisionsRequest diff;
  diff.set_map(kMap);
  diff.set_from_revision(1);
  diff.set_page_size(1);
  v1::DiffRevisionsResponse changes;
  ASSERT_TRUE(core_->DiffRevisions(call_, diff, &changes).ok());
  diff.set_page_token(changes.next_page_token());
  ASSERT_FALSE(diff.page_token().empty());
  Replace();
  EXPECT_EQ(ReasonOf(core_->ListNodes(call_, nodes, &page)), Reason::kMapReplaced);
  EXPECT_EQ(ReasonOf(core_->DiffRevisions(call_, diff, &changes)), Reason::kMapReplaced);
}

}  // namespace
}  // namespace dsg::test
