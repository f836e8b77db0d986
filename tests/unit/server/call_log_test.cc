// SPDX-License-Identifier: Apache-2.0
#include "server/call_log.h"

#include <gtest/gtest.h>

#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"

namespace dsg::server {
namespace {

TEST(RowCount, CountsTheEntriesOfEveryKindOfList) {
  v1::ListEncountersResponse encounters;
  encounters.add_encounters();
  encounters.add_encounters();
  EXPECT_EQ(RowCountOf(encounters), 2);
  v1::ListInteractionsResponse interactions;
  interactions.add_interactions();
  interactions.add_interactions();
  EXPECT_EQ(RowCountOf(interactions), 2);
  v1::GetNeighborsResponse neighbors;
  for (int i = 0; i < 3; ++i) neighbors.add_neighbors();
  EXPECT_EQ(RowCountOf(neighbors), 3);
  v1::SearchNodesResponse hits;
  for (int i = 0; i < 4; ++i) hits.add_hits();
  EXPECT_EQ(RowCountOf(hits), 4);
  v1::ListTagsResponse tags;
  EXPECT_EQ(RowCountOf(tags), 0);
  tags.add_tags();
  tags.add_tags();
  EXPECT_EQ(RowCountOf(tags), 2);
}

TEST(RowCount, AddsTheListsOfOneReply) {
  v1::DiffRevisionsResponse difference;
  difference.add_nodes();
  difference.add_edges();
  difference.add_edges();
  difference.add_tracks();
  difference.add_mesh_blocks();
  EXPECT_EQ(RowCountOf(difference), 5);
}

TEST(RowCount, IsOneForAReplyThatIsNoList) {
  v1::GetNodeResponse node;
  node.add_ancestor_ids("R1");
  node.add_ancestor_ids("B0");
  EXPECT_EQ(RowCountOf(node), 1);
  EXPECT_EQ(RowCountOf(v1::MergeMapsResponse()), 1);
}

}  // namespace
}  // namespace dsg::server
