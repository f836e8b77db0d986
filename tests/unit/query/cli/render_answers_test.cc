// SPDX-License-Identifier: Apache-2.0
// Answers about meetings, picks, search, ways, obstacles, the future and change, as people read
// them.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/list_writer.h"
#include "query/cli/verb_predict.h"
#include "query/cli/verbs_agents.h"
#include "query/cli/verbs_changes.h"
#include "query/cli/verbs_meetings.h"
#include "query/cli/verbs_search.h"
#include "query/cli/verbs_space.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

using test::ListText;
using test::Monotonic;

NodeNames Names() {
  return NodeNames({{"R9", "kitchen"}, {"O7", "cup"}, {"H1", "carol"}, {"p3", ""}});
}

TEST(NodeNamesText, FallsBackToTheId) {
  EXPECT_EQ(Names().Text("R9"), "kitchen (R9)");
  EXPECT_EQ(Names().Text("p3"), "p3");
  EXPECT_EQ(Names().Text("O99"), "O99");
  EXPECT_EQ(Names().Text(""), "");
}

TEST(RenderEncounters, WritesALineAMeeting) {
  v1::ListEncountersResponse reply;
  reply.mutable_header()->set_read_revision(4);
  v1::Encounter* meeting = reply.add_encounters();
  meeting->set_agent_id("H1");
  meeting->set_agent_name("carol");
  meeting->set_other_agent_id("H3");
  meeting->set_from_ns(10 * kNsPerSecond);
  meeting->set_to_ns(12 * kNsPerSecond);
  meeting->set_distance_m_min(0.5);
  meeting->set_closest_at_ns(11 * kNsPerSecond);
  meeting->mutable_position()->set_x(1.25);
  meeting->set_place_id("p3");
  meeting->set_room_id("R9");
  const auto add = [&](ListWriter* list) { return AddMeetings(reply, Names(), list); };
  EXPECT_EQ(ListText(MeetingColumns(), Monotonic(), add,
                     ObservedFooter("1 meeting", 3, PageEnd::Of(reply))),
            "agent       other  from    to  lasted  closest m    at   x m   y m  in\n"
            "carol (H1)  H3     +10s  +12s      2s       0.50  +11s  1.25  0.00  kitchen (R9)\n"
            "1 meeting; 3 agents observed anywhere in that time (revision 4)\n");
  const std::string csv = ListText(MeetingColumns(), Monotonic(), add, "", ListFormat::kCsv);
  EXPECT_EQ(csv.substr(0, csv.find("\r\n")),
            "agent_id,agent_name,other_id,other_name,from_ns,to_ns,lasted_ns,closest_m,at_ns,x_m,"
            "y_m,in_id,in_name");
}

v1::ListInteractionsResponse Picks() {
  v1::ListInteractionsResponse reply;
  reply.mutable_header()->set_read_revision(4);
  reply.set_observed_share(0.5);
  v1::Interaction* pick = reply.add_interactions();
  pick->set_type(v1::PICKED);
  pick->set_object_id("O7");
  pick->set_object_name("cup");
  pick->set_room_id("R9");
  pick->set_earliest_ns(10 * kNsPerSecond);
  pick->set_latest_ns(20 * kNsPerSecond);
  v1::InteractionCandidate* carol = pick->add_candidates();
  carol->set_agent_id("H1");
  carol->set_agent_name("carol");
  carol->set_probability(0.9);
  carol->set_at_ns(15 * kNsPerSecond);
  v1::Evidence* dwell = carol->add_evidence();
  dwell->set_kind("dwell");
  dwell->set_log_weight(1.5);
  dwell->set_source("H1 NEAR O7");
  dwell->set_detail("4.0 s within reach");
  v1::InteractionCandidate* unseen = pick->add_candidates();
  unseen->set_alternative("unseen");
  unseen->set_probability(0.1);
  return reply;
}

TEST(RenderInteractions, ListsCandidatesUnderTheirObject) {
  EXPECT_EQ(RenderInteractions(Picks(), Monotonic(), Names(), false),
            "object    what    between       in               p  who              when\n"
            "cup (O7)  picked  +10s to +20s  kitchen (R9)  0.90  carol (H1)       at +15s\n"
            "                                              0.10  somebody unseen\n"
            "1 object; 50 % of that time observed (revision 4)\n");
}

TEST(RenderInteractions, ShowsEvidenceOnlyWhenAsked) {
  const std::string text = RenderInteractions(Picks(), Monotonic(), Names(), true);
  EXPECT_NE(text.find("+1.50"), std::string::npos) << text;
  EXPECT_NE(text.find("dwell: 4.0 s within reach [H1 NEAR O7]"), std::string::npos) << text;
  EXPECT_EQ(RenderInteractions(Picks(), Monotonic(), Names(), false).find("dwell"),
            std::string::npos);
}

TEST(RenderInteractions, SaysWhyNobodyIsNamed) {
  v1::ListInteractionsResponse reply = Picks();
  reply.mutable_interactions(0)->set_abstained(true);
  reply.mutable_interactions(0)->set_reason("two are as likely");
  const std::string text = RenderInteractions(reply, Monotonic(), Names(), false);
  EXPECT_NE(text.find("nobody named"), std::string::npos) << text;
  EXPECT_NE(text.find("two are as likely"), std::string::npos) << text;
  EXPECT_NE(text.find("carol (H1)"), std::string::npos) << text;
}

std::string HitsText(const v1::SearchNodesResponse& reply) {
  const std::vector<ListColumn> columns = HitColumns(reply, Names(), ListFormat::kTable);
  return ListText(
      columns, Monotonic(),
      [&](ListWriter* list) { return AddHits(reply, Names(), columns, list); }, HitsFooter(reply));
}

TEST(RenderHits, ShowsDistanceRoomAndWhatItStandsOn) {
  v1::SearchNodesResponse reply;
  reply.mutable_header()->set_read_revision(4);
  v1::SearchHit* hit = reply.add_hits();
  hit->mutable_node()->set_id("O8");
  hit->mutable_node()->set_kind("object");
  hit->mutable_node()->mutable_map_t_node()->mutable_position();
  hit->mutable_node()->set_layer("objects");
  hit->mutable_node()->mutable_semantic_class()->set_name("plate");
  hit->set_distance_m(1.5);
  hit->add_ancestor_ids("p3");
  hit->add_ancestor_ids("R9");
  hit->add_related_ids("O7");
  EXPECT_EQ(
      HitsText(reply),
      "distance m  id  kind    layer    name  class   x m   y m   z m  in            with\n"
      "     1.500  O8  object  objects        plate  0.00  0.00  0.00  kitchen (R9)  cup (O7)\n"
      "1 node (revision 4)\n");
  // What the query asked for by its room alone is said once.
  hit->set_related_ids(0, "R9");
  EXPECT_EQ(HitsText(reply),
            "distance m  id  kind    layer    name  class   x m   y m   z m  in\n"
            "     1.500  O8  object  objects        plate  0.00  0.00  0.00  kitchen (R9)\n"
            "1 node (revision 4)\n");
  v1::SearchStep* step = reply.add_plan();
  step->set_operation("class index");
  step->set_detail("plate");
  step->set_in_count(9);
  step->set_out_count(1);
  reply.set_canonical_query("plate");
  const std::string text = HitsText(reply);
  EXPECT_NE(text.find("class index   9    1  plate\nunderstood as: plate\n"), std::string::npos)
      << text;
}

TEST(RenderNeighbors, SaysWhichWayAnEdgeLeads) {
  v1::GetNeighborsResponse reply;
  for (const bool outgoing : {true, false}) {
    v1::Neighbor* neighbor = reply.add_neighbors();
    neighbor->mutable_node()->set_id(outgoing ? "O7" : "R9");
    neighbor->mutable_edge()->set_relation(outgoing ? "NEAR" : "CONTAINS");
    neighbor->mutable_edge()->set_source(outgoing ? "p3" : "R9");
    neighbor->mutable_edge()->set_target(outgoing ? "O7" : "p3");
  }
  const std::string text = ListText(NeighborColumns(), Monotonic(),
                                    [&](ListWriter* list) { return AddNeighbors(reply, list); });
  EXPECT_NE(text.find("->  NEAR      O7"), std::string::npos) << text;
  EXPECT_NE(text.find("<-  CONTAINS  R9"), std::string::npos) << text;
}

TEST(RenderPath, NamesEndsRoomsAndPlaces) {
  v1::PlanPathResponse reply;
  reply.mutable_header()->set_read_revision(4);
  for (int i = 0; i < 20; ++i) reply.add_place_ids("p" + std::to_string(i));
  reply.add_room_ids("R1");
  reply.add_room_ids("R9");
  reply.add_polyline();
  reply.add_polyline()->set_x(3.0);
  reply.set_length_m(3.0);
  reply.set_clearance_m_min(0.4);
  reply.set_to_node_id("O7");
  reply.set_expanded_count(25);
  reply.set_mode(v1::FLAT);
  EXPECT_EQ(RenderPath(reply, Names()),
            "from       x 0.00 y 0.00 z 0.00 m\n"
            "to         cup (O7), x 3.00 y 0.00 z 0.00 m\n"
            "length     3.00 m\n"
            "clearance  at least 0.40 m\n"
            "rooms      R1 > kitchen (R9)\n"
            "places     20: p0 p1 p2 p3 p4 ... p15 p16 p17 p18 p19\n"
            "found      over all places, 25 places looked at (revision 4)\n");
  reply.mutable_collision()->set_what("structure");
  reply.mutable_collision()->set_observed(true);
  reply.mutable_collision()->set_clearance_m(0.2);
  EXPECT_NE(RenderPath(reply, Names()).find("touches    free, 0.20 m from structure at"),
            std::string::npos);
}

TEST(CollisionText, TellsHitFreeAndUnknown) {
  v1::CollisionResult result;
  result.set_observed(true);
  result.set_clearance_m(2.0);
  EXPECT_EQ(CollisionText(result, Names()), "free, nothing within 2.00 m");
  result.set_observed(false);
  EXPECT_EQ(CollisionText(result, Names()),
            "free, nothing within 2.00 m; part of the body is in unobserved space");
  result.set_observed(true);
  result.set_hit(true);
  result.set_what("predicted_agent");
  result.set_node_id("H1");
  EXPECT_EQ(CollisionText(result, Names()),
            "hit predicted agent carol (H1) at x 0.00 y 0.00 z 0.00 m");
}

TEST(ChanceText, IsInWholePerCent) {
  EXPECT_EQ(ChanceText(1.0), "100 %");
  EXPECT_EQ(ChanceText(0.894), "89 %");
  EXPECT_EQ(ChanceText(0.01), "1 %");
  EXPECT_EQ(ChanceText(0.0099), "<1 %");
  EXPECT_EQ(ChanceText(0.0), "<1 %");
}

TEST(RenderPrediction, GivesWaysAndTheStepsOfTheFirst) {
  v1::PredictAgentResponse reply;
  reply.set_agent_id("H1");
  reply.set_observed_ns(10 * kNsPerSecond);
  reply.mutable_velocity()->set_x(3.0);
  reply.mutable_velocity()->set_y(4.0);
  reply.set_model(v1::CONSTANT_VELOCITY);
  v1::PredictedPath* path = reply.add_paths();
  path->set_probability(1.0);
  v1::PredictedPose* pose = path->add_poses();
  pose->set_time_ns(11 * kNsPerSecond);
  pose->mutable_position()->set_x(2.0);
  for (const double value : {0.25, 0.0, 0.0, 0.25, 0.0, 0.1}) pose->add_covariance(value);
  EXPECT_EQ(RenderPrediction(reply, Monotonic(), Names()),
            "carol (H1) seen until +10s, 5.00 m/s, by constant velocity (revision 0)\n"
            "way      p  towards  end x m  end y m  sd m\n"
            "  1  1.000              2.00     0.00  0.50\n"
            "\nway 1\n"
            "time   x m   y m   z m  sd m\n"
            "+11s  2.00  0.00  0.00  0.50\n");
}

v1::Node Cup() {
  v1::Node node;
  node.set_id("O7");
  node.set_kind("object");
  node.set_name("cup");
  node.set_revision(1);
  return node;
}

TEST(DifferenceText, NamesWhatChangedAndHow) {
  v1::Node after = Cup();
  after.set_revision(2);
  EXPECT_EQ(DifferenceText(Cup(), after, Monotonic()), "object \"cup\": written again");
  after.mutable_map_t_node()->mutable_position()->set_x(0.5);
  after.set_valid_to_ns(3 * kNsPerSecond);
  after.set_confidence(0.5);
  EXPECT_EQ(DifferenceText(Cup(), after, Monotonic()),
            "object \"cup\": moved 0.500 m, ended at +3s, confidence");
  after = Cup();
  (*after.mutable_attributes())["weight"].set_number(1.0);
  EXPECT_EQ(DifferenceText(Cup(), after, Monotonic()), "object \"cup\": attributes");
}

TEST(RenderDiff, ListsEachKindOfChange) {
  v1::DiffRevisionsResponse reply;
  reply.set_from_revision(1);
  reply.set_to_revision(2);
  v1::NodeChange* node = reply.add_nodes();
  node->set_type(v1::ADDED);
  *node->mutable_after() = Cup();
  v1::EdgeChange* edge = reply.add_edges();
  edge->set_type(v1::REMOVED);
  edge->mutable_before()->set_source("O7");
  edge->mutable_before()->set_relation("ON");
  edge->mutable_before()->set_target("O1");
  v1::TrackChange* track = reply.add_tracks();
  track->set_agent_id("H1");
  track->set_pose_count_before(5);
  track->set_pose_count_after(6);
  track->set_last_pose_ns_after(kNsPerSecond);
  reply.add_mesh_blocks()->set_type(v1::ADDED);
  EXPECT_EQ(RenderDiff(reply, Monotonic()),
            "   what   id        detail\n"
            "+  node   O7        object \"cup\"\n"
            "-  edge   O7 ON O1\n"
            "~  track  H1        1 pose more, up to +1s\n"
            "~  mesh   blocks    1 added, 0 changed, 0 removed\n"
            "4 changes from revision 1 to 2\n");
}

TEST(RenderDiff, OfATrackThatIsOnlyCorrectedSaysSo) {
  v1::DiffRevisionsResponse reply;
  v1::TrackChange* track = reply.add_tracks();
  track->set_agent_id("H1");
  track->set_pose_count_before(5);
  track->set_pose_count_after(5);
  track->set_last_pose_ns_after(kNsPerSecond);
  track->set_corrected(true);
  const std::string text = RenderDiff(reply, Monotonic());
  EXPECT_NE(text.find("as many poses, up to +1s, earlier ones corrected\n"), std::string::npos)
      << text;
}

TEST(RenderDiff, OfTheSameIsOneLine) {
  v1::DiffRevisionsResponse reply;
  reply.set_from_revision(2);
  reply.set_to_revision(2);
  EXPECT_EQ(RenderDiff(reply, Monotonic()), "0 changes from revision 2 to 2\n");
}

}  // namespace
}  // namespace dsg::cli
