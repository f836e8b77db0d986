// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <string>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

Edge MakeEdge(NodeId source, const char* relation, NodeId target, Interval valid = {}) {
  Edge edge;
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
  edge.valid = valid;
  return edge;
}

// On top of the office: table O10 in p1, on which stood a red cup O11 until 50 s, when it went to
// the blue table O12 in p3; the sofa is a label only.
GraphDelta FurnitureDelta() {
  GraphDelta delta;
  delta.labels = {{1, "cup"}, {2, "dining table"}, {3, "sofa"}};
  const auto add = [&](uint64_t index, int class_id, const char* class_name, const char* name,
                       double x, Color color) {
    Node node = MakeNode(NodeId('O', index), layers::kObjects, kinds::kObject, name,
                         Box3d(Eigen::Vector3d(x, 4.5, 0.5), Eigen::Vector3d(x + 0.5, 5, 1)));
    node.class_id = class_id;
    node.class_name = class_name;
    node.object.emplace();
    node.object->color = color;
    node.attributes["weight"] = x;
    delta.nodes.push_back(std::move(node));
  };
  add(10, 2, "dining table", "", 2.0, {120, 70, 30, 255});
  add(11, 1, "cup", "Anna's", 2.5, {200, 20, 20, 255});
  add(12, 2, "dining table", "Blue Table", 14.0, {30, 60, 200, 255});
  const NodeId table('O', 10), cup('O', 11), blue_table('O', 12);
  delta.edges = {
      MakeEdge(NodeId('p', 1), relations::kContains, table),
      MakeEdge(NodeId('p', 1), relations::kContains, cup, {kTimeMin, 50 * kSecond}),
      MakeEdge(NodeId('p', 3), relations::kContains, blue_table),
      MakeEdge(cup, relations::kOn, table, {kTimeMin, 50 * kSecond}),
      MakeEdge(cup, relations::kOn, blue_table, {50 * kSecond, kTimeMax}),
      MakeEdge(NodeId('R', 1), relations::kAdjacent, NodeId('R', 2)),
      MakeEdge(NodeId('H', 12), "SEES", cup),
  };
  return delta;
}

class SearchNodes : public testing::Test {
 protected:
  SearchNodes() {
    MakeOffice(folder_.path());
    CommitToOffice(folder_.path(), FurnitureDelta());
    core_ = OpenCore(folder_.path());
  }

  static v1::SearchNodesRequest Query(const std::string& query) {
    v1::SearchNodesRequest request;
    request.set_map(kMap);
    request.set_query(query);
    return request;
  }

  absl::StatusOr<v1::SearchNodesResponse> Ask(const v1::SearchNodesRequest& request) {
    v1::SearchNodesResponse reply;
    const absl::Status status = core_->SearchNodes(call_, request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  // Ids of all hits, or the error.
  std::string Hits(v1::SearchNodesRequest request, int page_size = 0) {
    std::string ids;
    request.set_page_size(page_size);
    do {
      const auto reply = Ask(request);
      if (!reply.ok()) return std::string(reply.status().message());
      for (const auto& hit : reply->hits()) ids += hit.node().id() + " ";
      request.set_page_token(reply->next_page_token());
    } while (!request.page_token().empty());
    return ids;
  }
  std::string Hits(const std::string& query) { return Hits(Query(query)); }

  Reason ReasonOfAsking(const v1::SearchNodesRequest& request) {
    return ReasonOf(Ask(request).status());
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
};

TEST_F(SearchNodes, FindsTheRedCupOnTheTableInTheKitchen) {
  EXPECT_EQ(Hits("red cup on \"dining table\" in kitchen"), "O11 ");
  EXPECT_EQ(Hits("red cup on \"dining table\" in \"lab\""), "O11 ");
  EXPECT_EQ(Hits("blue cup"), "");
  EXPECT_EQ(Hits("cups"), "O11 ");
  EXPECT_EQ(Hits("rooms adjacent to lab"), "R1 ");
  EXPECT_EQ(Hits("rooms adjacent to kitchen"), "R2 ");
  EXPECT_EQ(Hits("object inside R1"), "O1 O10 O11 ");
  EXPECT_EQ(Hits("weight > 2.4"), "O11 O12 ");
  EXPECT_EQ(Hits("name = \"*table\""), "O12 ");
  EXPECT_EQ(Hits("room with cup"), "R1 ");
  EXPECT_EQ(Hits("human sees cup"), "H12 ");
  EXPECT_EQ(Hits("people"), "H12 H13 ");
  EXPECT_EQ(Hits("O11"), "O11 ");
  EXPECT_EQ(Hits("sofa"), "");
  EXPECT_EQ(Hits("object and not on any"), "O1 O2 O10 O12 ");
}

TEST_F(SearchNodes, AsksEveryHopAtTheInstant) {
  auto request = Query("cup on \"Blue Table\"");
  request.set_at_ns(40 * kSecond);
  EXPECT_EQ(Hits(request), "");
  request.set_at_ns(50 * kSecond);
  EXPECT_EQ(Hits(request), "O11 ");
  request = Query("cup inside kitchen");
  request.set_at_ns(49 * kSecond);
  EXPECT_EQ(Hits(request), "O11 ");
  request.set_at_ns(50 * kSecond);
  EXPECT_EQ(Hits(request), "");
}

TEST_F(SearchNodes, ReadsTheRevisionThatIsAskedFor) {
  auto request = Query("dining table");
  request.set_query("\"dining table\"");
  EXPECT_EQ(Hits(request), "O10 O12 ");
  request.mutable_read_at()->set_exact_revision(1);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kClassUnknown);
  request.mutable_read_at()->set_exact_revision(9);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kRevisionInFuture);
}

TEST_F(SearchNodes, TellsAncestorsRelatedNodesDistanceAndTheCanonicalQuery) {
  auto request = Query("cup on \"dining table\" and not near any");
  request.mutable_near()->set_x(3.0);
  request.mutable_near()->set_y(4.5);
  request.mutable_near()->set_z(2.0);
  request.set_view(v1::NODE_VIEW_BASIC);
  request.set_explain(true);
  const auto reply = Ask(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->hits_size(), 1);
  const v1::SearchHit& hit = reply->hits(0);
  EXPECT_NEAR(hit.distance_m(), 1.0, 1e-12);
  EXPECT_FALSE(hit.node().has_map_t_node());
  ASSERT_EQ(hit.ancestor_ids_size(), 3);
  EXPECT_EQ(hit.ancestor_ids(0) + hit.ancestor_ids(1) + hit.ancestor_ids(2), "p1R1B1");
  ASSERT_EQ(hit.related_ids_size(), 2);
  EXPECT_EQ(hit.related_ids(0), "O10");
  EXPECT_EQ(hit.related_ids(1), "");
  EXPECT_EQ(reply->canonical_query(),
            "class = cup and ON (class = \"dining table\") and not NEAR (any)");
  EXPECT_GT(reply->plan_size(), 0);
  EXPECT_EQ(reply->header().read_revision(), 2);
}

TEST_F(SearchNodes, ShowsTheSameNodeWhetherFromMemoryOrFromTheStore) {
  for (const auto view : {v1::NODE_VIEW_BASIC, v1::NODE_VIEW_GEOMETRY, v1::NODE_VIEW_FULL}) {
    auto request = Query("any");
    request.set_view(view);
    const auto reply = Ask(request);
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->hits_size(), 14);
    for (const v1::SearchHit& hit : reply->hits()) {
      v1::GetNodeRequest one;
      one.set_map(kMap);
      one.set_id(hit.node().id());
      one.set_view(view);
      v1::GetNodeResponse expected;
      ASSERT_TRUE(core_->GetNode(call_, one, &expected).ok());
      EXPECT_EQ(hit.node().SerializeAsString(), expected.node().SerializeAsString());
    }
  }
}

TEST_F(SearchNodes, GivesTheSameListWhateverThePageSize) {
  for (const bool is_near : {false, true}) {
    auto request = Query("any");
    if (is_near) request.mutable_near()->set_x(5.0);
    const std::string whole = Hits(request, 1000);
    for (const int page_size : {1, 2, 3, 7}) EXPECT_EQ(Hits(request, page_size), whole);
  }
}

TEST_F(SearchNodes, FindsAgentsNearAPointOnlyAtAnInstant) {
  auto request = Query("human");
  request.mutable_near()->set_x(4.0);
  request.mutable_near()->set_y(5.0);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kFieldInvalid);
  request.set_at_ns(10 * kSecond);
  // H12 is at x = 11 then, H13 at x = 3.
  EXPECT_EQ(Hits(request), "H13 H12 ");
  request.mutable_near()->set_x(10.0);
  EXPECT_EQ(Hits(request, 1), "H12 H13 ");
  request.set_at_ns(40 * kSecond);
  EXPECT_EQ(Hits(request), "");
}

TEST_F(SearchNodes, FindsAgentsWhereTheyWereAtTheInstant) {
  auto request = Query("human");
  EXPECT_EQ(Hits(request), "H12 H13 ");
  request.set_at_ns(10 * kSecond + kSecond / 2);
  const auto there = Ask(request);
  ASSERT_TRUE(there.ok()) << there.status();
  ASSERT_EQ(there->hits_size(), 2);
  EXPECT_EQ(there->hits(0).node().map_t_node().position().x(), 11.5);
  EXPECT_EQ(there->hits(1).node().map_t_node().position().x(), 3.0);
  ASSERT_EQ(there->hits(0).ancestor_ids_size(), 3);
  EXPECT_EQ(there->hits(0).ancestor_ids(0), "p3");
  EXPECT_EQ(there->hits(0).ancestor_ids(1), "R2");
  EXPECT_EQ(there->hits(1).ancestor_ids(1), "R1");
  // H13 has left; H12 is in a gap of its track.
  request.set_at_ns(40 * kSecond);
  const auto gap = Ask(request);
  ASSERT_TRUE(gap.ok()) << gap.status();
  ASSERT_EQ(gap->hits_size(), 1);
  EXPECT_EQ(gap->hits(0).node().id(), "H12");
  EXPECT_FALSE(gap->hits(0).node().has_map_t_node());
  EXPECT_EQ(gap->hits(0).ancestor_ids_size(), 0);
  request.set_at_ns(63 * kSecond);
  EXPECT_EQ(Hits(request), "");
  request = Query("any");
  request.set_at_ns(5 * kSecond);
  EXPECT_EQ(Hits(request), "B1 H12 H13 O1 O2 O10 O11 O12 R1 R2 p1 p2 p3 r1 ");
  request.set_at_ns(6 * kSecond);
  EXPECT_EQ(Hits(request), "B1 H12 H13 O1 O2 O10 O11 O12 R1 R2 p1 p2 p3 ");
}

TEST_F(SearchNodes, TakesAPatternFromPrograms) {
  v1::SearchNodesRequest request;
  request.set_map(kMap);
  v1::NodePattern* pattern = request.mutable_pattern();
  EXPECT_EQ(Hits(request), "B1 H12 H13 O1 O2 O10 O11 O12 R1 R2 p1 p2 p3 r1 ");
  pattern->set_class_name("CUP");
  pattern->set_color("Red");
  v1::RelationCondition* relation = pattern->add_relations();
  relation->set_relation("on");
  relation->mutable_other()->set_id("O10");
  EXPECT_EQ(Hits(request), "O11 ");
  relation->set_relation("INSIDE");
  relation->mutable_other()->set_id("B1");
  EXPECT_EQ(Hits(request), "O11 ");
}

TEST_F(SearchNodes, TakesOneOrTheOtherAndWhatIsNotSo) {
  EXPECT_EQ(Hits("cup or chair"), "O2 O11 ");
  EXPECT_EQ(Hits("red cup or lab"), "O11 R2 ");
  EXPECT_EQ(Hits("(cup or \"dining table\") and (red or blue)"), "O11 O12 ");
  EXPECT_EQ(Hits("cup on (\"Blue Table\" or O10)"), "O11 ");
  EXPECT_EQ(Hits("object and not (cup or \"dining table\")"), "O1 O2 ");
  // What has no weight, and what has no colour, is not so either.
  EXPECT_EQ(Hits("object and not weight > 2.4"), "O1 O2 O10 ");
  EXPECT_EQ(Hits("object and not red"), "O1 O2 O10 O12 ");
  EXPECT_EQ(Hits("room not lab"), "R1 ");
  v1::SearchNodesRequest request;
  request.set_map(kMap);
  v1::Alternatives* either = request.mutable_pattern()->add_alternatives();
  either->add_any_of()->set_class_name("cup");
  either->add_any_of()->set_kind("room");
  EXPECT_EQ(Hits(request), "O11 R1 R2 ");
  EXPECT_EQ(Ask(request)->canonical_query(), "class = cup or kind = room");
  either->set_negated(true);
  request.mutable_pattern()->set_layer("objects");
  EXPECT_EQ(Hits(request), "O1 O2 O10 O12 ");
  EXPECT_EQ(Ask(request)->canonical_query(),
            "layer = objects and not (class = cup or kind = room)");
}

TEST_F(SearchNodes, AlternativesMayWantAgentsNearAPoint) {
  auto request = Query("human or chair");
  request.mutable_near()->set_x(14.0);
  request.mutable_near()->set_y(5.0);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kFieldInvalid);
  request.set_at_ns(10 * kSecond);
  EXPECT_EQ(Hits(request), "O2 H12 H13 ");
  EXPECT_EQ(Hits(request, 1), "O2 H12 H13 ");
}

TEST_F(SearchNodes, AgentsAreWhereTheyStay) {
  const auto at = [&](const char* query, TimeNs at_ns) {
    auto request = Query(query);
    request.set_at_ns(at_ns);
    return Hits(request);
  };
  EXPECT_EQ(at("human in kitchen", 3 * kSecond), "H12 H13 ");
  EXPECT_EQ(at("human in kitchen", 10 * kSecond), "H13 ");
  EXPECT_EQ(at("human inside p2", 4 * kSecond), "H12 ");
  EXPECT_EQ(at("human in HQ", 10 * kSecond), "H12 H13 ");
  EXPECT_EQ(at("human not in HQ", 40 * kSecond), "H12 ");
  EXPECT_EQ(at("room with human", 10 * kSecond), "R1 R2 ");
  EXPECT_EQ(at("room with human", 15 * kSecond), "R2 ");
  EXPECT_EQ(at("building with human", 40 * kSecond), "");
  EXPECT_EQ(at("any in kitchen", 10 * kSecond), "H13 O1 O10 O11 p1 p2 ");
  EXPECT_EQ(Hits("human in lab"), "H12 ");
  EXPECT_EQ(Hits("human not in lab"), "H13 ");
  EXPECT_EQ(Hits("robot in HQ"), "");
  EXPECT_EQ(Hits("room contains human"), "");
  const auto reply = Ask(Query("human in room"));
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->hits_size(), 2);
  EXPECT_EQ(reply->hits(0).related_ids(0), "R1");
}

TEST_F(SearchNodes, AgentsAreOnTheLevelOfTheirRoom) {
  GraphDelta delta;
  delta.layers = {{450, "levels", 450}};
  Node level = MakeNode(NodeId('L', 1), 450, "level", "level 1", Box3d());
  delta.edges = {MakeEdge(level.id, relations::kContains, NodeId('R', 2))};
  delta.nodes = {std::move(level)};
  CommitToOffice(folder_.path(), std::move(delta));
  auto request = Query("human in (level 1)");
  EXPECT_EQ(Hits(request), "H12 ");
  request.set_at_ns(10 * kSecond);
  EXPECT_EQ(Hits(request), "H12 ");
  request.set_at_ns(3 * kSecond);
  EXPECT_EQ(Hits(request), "");
  request.set_query("human and not in (level 1)");
  EXPECT_EQ(Hits(request), "H12 H13 ");
}

TEST_F(SearchNodes, FindsInARoomWhomListPresenceListsThere) {
  int64_t found_count = 0;
  for (TimeNs at_ns = 0; at_ns <= 64 * kSecond; at_ns += kSecond / 2) {
    for (const char* where : {"R1", "R2", "B1", "p1", "p2", "p3"}) {
      v1::ListPresenceRequest who;
      who.set_map(kMap);
      who.set_node_id(where);
      who.set_from_ns(at_ns);
      who.set_to_ns(at_ns + 1);
      v1::ListPresenceResponse there;
      ASSERT_TRUE(core_->ListPresence(call_, who, &there).ok());
      std::string ids;
      for (const auto& interval : there.intervals()) ids += interval.agent_id() + " ";
      auto request = Query("human in " + std::string(where));
      request.set_at_ns(at_ns);
      EXPECT_EQ(Hits(request), ids) << where << " at " << at_ns;
      request.set_query(std::string(where) + " with human");
      EXPECT_EQ(Hits(request).empty(), ids.empty()) << where << " at " << at_ns;
      found_count += there.intervals_size();
    }
  }
  EXPECT_GT(found_count, 100);
}

TEST_F(SearchNodes, CountsWithoutNodes) {
  for (const bool is_near : {false, true}) {
    auto request = Query("object or room");
    request.set_page_size(2);
    request.set_count_only(true);
    if (is_near) request.mutable_near()->set_x(5.0);
    const auto reply = Ask(request);
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->hit_count(), 7);
    EXPECT_EQ(reply->hits_size(), 0);
    EXPECT_EQ(reply->next_page_token(), "");
  }
  EXPECT_EQ(Ask(Query("object"))->hit_count(), 0);
}

TEST_F(SearchNodes, SaysNamesThatAreNearInSpelling) {
  const std::pair<const char*, const char*> mistakes[] = {
      {"cup in (room \"kitchn\")", "; near in spelling: \"kitchen\""},
      {"cup not in (room \"kitchn\")", "; near in spelling: \"kitchen\""},
      {"cup or name = \"blue tabel\"", "; near in spelling: \"Blue Table\""},
      // None is near: those that rooms have.
      {"room \"observatory\"", "; known: \"kitchen\", \"lab\""},
  };
  for (const auto& [query, hint] : mistakes) {
    const auto reply = Ask(Query(query));
    EXPECT_EQ(ReasonOf(reply.status()), Reason::kNodeUnknown) << query;
    EXPECT_NE(reply.status().message().find(hint), std::string::npos) << reply.status();
  }
  const auto numbered = Ask(Query("cup in kitchen 2"));
  EXPECT_EQ(ReasonOf(numbered.status()), Reason::kClassUnknown);
  EXPECT_NE(numbered.status().message().find("\"kitchen 2\""), std::string::npos);
  EXPECT_NE(numbered.status().message().find("near in spelling: \"kitchen\""), std::string::npos)
      << numbered.status();
  const auto kind = Ask(Query("kind = humna"));
  EXPECT_NE(kind.status().message().find("\"human\""), std::string::npos) << kind.status();
  // Whether there are any is the question.
  EXPECT_EQ(Hits("name = \"obs*\""), "");
}

TEST_F(SearchNodes, NarrowsByABoxThatTouches) {
  auto request = Query("objects");
  request.mutable_box()->mutable_min()->set_x(2.5);
  request.mutable_box()->mutable_min()->set_y(4.5);
  request.mutable_box()->mutable_max()->set_x(9.0);
  request.mutable_box()->mutable_max()->set_y(5.0);
  request.mutable_box()->mutable_max()->set_z(1.0);
  EXPECT_EQ(Hits(request), "O10 O11 ");
}

TEST_F(SearchNodes, ListsWhatIsNearInSpelling) {
  const auto reply = Ask(Query("diningtable"));
  EXPECT_EQ(ReasonOf(reply.status()), Reason::kClassUnknown);
  EXPECT_NE(reply.status().message().find("\"dining table\""), std::string::npos) << reply.status();
  const auto relation = Ask(Query("cup sess any"));
  EXPECT_EQ(ReasonOf(relation.status()), Reason::kRelationUnknown);
  EXPECT_NE(relation.status().message().find("\"SEES\""), std::string::npos) << relation.status();
  const auto layer = Ask(Query("layer = object"));
  EXPECT_EQ(ReasonOf(layer.status()), Reason::kLayerUnknown);
  EXPECT_NE(layer.status().message().find("\"objects\""), std::string::npos) << layer.status();
}

TEST_F(SearchNodes, RefusesAnAttributeThatNoNodeHas) {
  for (const std::string query :
       {"wieght > 2", "has wieght", "cup on (\"dining table\" and wieght = 2)",
        "cup not on (any and wieght = 2)"}) {
    const auto reply = Ask(Query(query));
    EXPECT_EQ(ReasonOf(reply.status()), Reason::kFieldInvalid) << query;
    EXPECT_NE(reply.status().message().find("\"wieght\" at revision"), std::string::npos)
        << reply.status();
    EXPECT_NE(reply.status().message().find("near in spelling: \"weight\""), std::string::npos)
        << reply.status();
  }
  // A field in the spelling of an attribute.
  const auto field = Ask(Query("clas = cup"));
  EXPECT_NE(field.status().message().find("\"class\""), std::string::npos) << field.status();
  // Some node has it, though none with this value.
  EXPECT_EQ(Hits("weight = heavy"), "");
}

TEST_F(SearchNodes, RefusesWhatItCannotAnswer) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  v1::SearchNodesRequest request;
  request.set_map(kMap);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOfAsking(Query("")), Reason::kQueryMalformed);
  EXPECT_EQ(ReasonOfAsking(Query("cup on")), Reason::kQueryMalformed);
  EXPECT_EQ(ReasonOfAsking(Query("O99")), Reason::kNodeUnknown);
  EXPECT_EQ(ReasonOfAsking(Query("id = O99")), Reason::kNodeUnknown);
  EXPECT_EQ(ReasonOfAsking(Query("id = x")), Reason::kNodeIdInvalid);
  EXPECT_EQ(ReasonOfAsking(Query("kind = humna")), Reason::kClassUnknown);
  EXPECT_EQ(ReasonOfAsking(Query("any and has spark_dsg")), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOfAsking(Query("cup and class = \"dining table\"")), Reason::kQueryMalformed);
  request = Query("any");
  request.mutable_near()->set_x(nan);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kNumberNotFinite);
  request = Query("any");
  request.set_max_distance_m(3.0);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kFieldInvalid);
  request.mutable_near();
  request.set_max_distance_m(-1.0);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kFieldInvalid);
  request = Query("any");
  request.mutable_box()->mutable_min()->set_x(1.0);
  request.mutable_box()->mutable_max();
  EXPECT_EQ(ReasonOfAsking(request), Reason::kBoxInverted);
  request = Query("any");
  request.set_page_size(-1);
  EXPECT_EQ(ReasonOfAsking(request), Reason::kFieldInvalid);
  request = Query("any");
  request.set_view(static_cast<v1::NodeView>(9));
  EXPECT_EQ(ReasonOfAsking(request), Reason::kFieldInvalid);
}

TEST_F(SearchNodes, RefusesPatternsThatMeanNothing) {
  const auto reason_of = [&](const v1::NodePattern& pattern) {
    v1::SearchNodesRequest request;
    request.set_map(kMap);
    *request.mutable_pattern() = pattern;
    return ReasonOfAsking(request);
  };
  v1::NodePattern pattern;
  pattern.set_color("reddish");
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
  pattern.Clear();
  pattern.add_relations()->set_relation("");
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
  pattern.Clear();
  v1::AttributeCondition* condition = pattern.add_attributes();
  condition->set_name("weight");
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
  condition->mutable_value()->set_number(std::numeric_limits<double>::infinity());
  EXPECT_EQ(reason_of(pattern), Reason::kNumberNotFinite);
  condition->mutable_value()->set_flag(true);
  condition->set_comparison(v1::LESS);
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
  condition->set_comparison(static_cast<v1::Comparison>(42));
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
  pattern.Clear();
  pattern.add_alternatives();
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
  for (int i = 0; i < 64; ++i) pattern.mutable_alternatives(0)->add_any_of()->set_kind("room");
  EXPECT_EQ(reason_of(pattern), Reason::kUnspecified);
  pattern.mutable_alternatives(0)->add_any_of();
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
  pattern.Clear();
  v1::NodePattern* inner = &pattern;
  for (int i = 0; i < 9; ++i) inner = inner->add_alternatives()->add_any_of();
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
  pattern.Clear();
  v1::NodePattern* deepest = &pattern;
  for (int i = 0; i < 9; ++i) {
    v1::RelationCondition* relation = deepest->add_relations();
    relation->set_relation("ON");
    deepest = relation->mutable_other();
  }
  EXPECT_EQ(reason_of(pattern), Reason::kFieldInvalid);
}

TEST_F(SearchNodes, RefusesATokenOfAnotherQuestion) {
  auto request = Query("any");
  request.set_page_size(1);
  const auto reply = Ask(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  auto other = Query("objects");
  other.set_page_token(reply->next_page_token());
  EXPECT_EQ(ReasonOfAsking(other), Reason::kPageTokenMismatch);
  other = Query("any");
  other.set_page_token("nonsense");
  EXPECT_EQ(ReasonOfAsking(other), Reason::kPageTokenMismatch);
}

TEST_F(SearchNodes, StopsAtTheDeadline) {
  const query::CallContext late(query::CallContext::Clock::now() - std::chrono::seconds(1));
  v1::SearchNodesResponse reply;
  EXPECT_TRUE(absl::IsDeadlineExceeded(core_->SearchNodes(late, Query("any"), &reply)));
}

}  // namespace
}  // namespace dsg::test
