// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/graph_rows.h"
#include "query/cli/list_writer.h"
#include "query/cli/verbs_agents.h"
#include "query/cli/verbs_graph.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

using test::ListText;
using test::Monotonic;

TimeText Unix() {
  MapSpec map;
  map.clock = Clock::kUnix;
  return TimeText(map);
}

v1::LocateAgentResponse Located() {
  v1::LocateAgentResponse reply;
  reply.mutable_header()->set_read_revision(12);
  reply.set_agent_id("H1");
  reply.set_agent_name("alice");
  reply.set_at_ns(60 * kNsPerSecond);
  reply.mutable_pose()->mutable_position()->set_x(3.21);
  reply.mutable_pose()->mutable_position()->set_y(4.05);
  const double half_rad = 91.2 / 2.0 * M_PI / 180.0;
  reply.mutable_pose()->mutable_orientation()->set_z(std::sin(half_rad));
  reply.mutable_pose()->mutable_orientation()->set_w(std::cos(half_rad));
  reply.set_quality(v1::INTERPOLATED);
  reply.set_before_ns(59'900'000'000);
  reply.set_after_ns(60'000'000'001);
  reply.set_place_id("p17");
  reply.set_room_id("R2");
  reply.set_building_id("B0");
  return reply;
}

TEST(RenderLocation, SaysAllInOneSentence) {
  EXPECT_EQ(RenderLocation(Located(), Monotonic(), "kitchen"),
            "alice (H1) at +60s (revision 12): x 3.21 y 4.05 z 0.00 m, yaw 91.2 deg, interpolated "
            "between +59.9s and +60.000000001s; place p17, room R2 \"kitchen\", building B0\n");
}

TEST(RenderLocation, GapHasNoPose) {
  v1::LocateAgentResponse reply = Located();
  reply.clear_pose();
  reply.set_quality(v1::IN_GAP);
  reply.clear_place_id();
  reply.clear_building_id();
  EXPECT_EQ(RenderLocation(reply, Monotonic(), ""),
            "alice (H1) at +60s (revision 12): not observed: the track has a gap from +59.9s to "
            "+60.000000001s; room R2\n");
}

TEST(RenderLocation, ShowsNoYawWhereTheSourceGaveNone) {
  v1::LocateAgentResponse reply = Located();
  reply.set_quality(v1::EXACT);
  reply.set_orientation_unknown(true);
  reply.clear_place_id();
  reply.clear_room_id();
  reply.clear_building_id();
  reply.set_agent_name("H1");
  EXPECT_EQ(RenderLocation(reply, Unix(), ""),
            "H1 at +60s (1970-01-01T00:01:00Z) (revision 12): x 3.21 y 4.05 z 0.00 m, measured; "
            "in no known place\n");
}

TEST(RenderTrack, WritesALineAPose) {
  v1::GetTrajectoryResponse reply;
  reply.mutable_header()->set_read_revision(3);
  reply.set_agent_id("H1");
  v1::TimedPose* pose = reply.add_poses();
  pose->set_time_ns(kNsPerSecond);
  pose->mutable_pose()->mutable_position()->set_x(-1.5);
  pose->set_flags(1);
  pose = reply.add_poses();
  pose->set_time_ns(12 * kNsPerSecond);
  pose->mutable_pose()->mutable_orientation()->set_w(1.0);
  pose->set_flags(2);
  const auto add = [&](ListWriter* list) { return AddPoses(reply, list); };
  EXPECT_EQ(ListText(PoseColumns(), Monotonic(), add, TrackFooter(2, reply)),
            "time     x m    y m    z m  yaw deg  note\n"
            " +1s  -1.500  0.000  0.000        -\n"
            "+12s   0.000  0.000  0.000      0.0  corrected\n"
            "2 poses of H1 (revision 3)\n");
}

TEST(RenderPresence, WritesALineAStayAndTheCoverage) {
  v1::ListPresenceResponse reply;
  reply.mutable_header()->set_read_revision(3);
  reply.set_next_page_token("more");
  v1::PresenceInterval* stay = reply.add_intervals();
  stay->set_agent_id("H1");
  stay->set_agent_name("alice");
  stay->set_enter_ns(kNsPerSecond);
  stay->set_exit_ns(3 * kNsPerSecond);
  stay->set_node_id("R2");
  const auto add = [&](ListWriter* list) { return AddStays(reply, list); };
  const std::string footer = ObservedFooter("1 stay", 4, PageEnd::Of(reply));
  EXPECT_EQ(ListText(StayColumns(), Unix(), add, footer),
            "agent  name   enter  exit  stayed  in  date\n"
            "H1     alice    +1s   +3s      2s  R2  1970-01-01T00:00:01Z\n"
            "1 stay; 4 agents observed anywhere in that time (revision 3); there are more, "
            "see --limit\n");
  EXPECT_EQ(ListText(StayColumns(), Unix(), add, footer, ListFormat::kCsv),
            "agent,name,enter_ns,enter_utc,exit_ns,exit_utc,stayed_ns,in\r\n"
            "H1,alice,1000000000,1970-01-01T00:00:01Z,3000000000,1970-01-01T00:00:03Z,2000000000,"
            "R2\r\n");
}

TEST(RenderNode, LeavesOutWhatTheNodeDoesNotHave) {
  v1::GetNodeResponse reply;
  reply.mutable_header()->set_read_revision(9);
  v1::Node* node = reply.mutable_node();
  node->set_id("O42");
  node->set_kind("object");
  node->set_layer("objects");
  node->mutable_semantic_class()->set_name("cup");
  node->set_revision(7);
  (*node->mutable_attributes())["b"].set_text("x");
  (*node->mutable_attributes())["a"].set_flag(true);
  node->mutable_object()->mutable_color()->set_red(255);
  reply.add_ancestor_ids("p7");
  reply.add_ancestor_ids("R3");
  EXPECT_EQ(RenderNode(reply, Monotonic()),
            "id       O42\n"
            "kind     object\n"
            "layer    objects\n"
            "class    cup\n"
            "inside   p7, R3\n"
            "color    #ff0000\n"
            ".a       true\n"
            ".b       \"x\"\n"
            "written  by revision 7, read at 9\n");
}

TEST(RenderEdges, ShowsWhenAnEdgeHeld) {
  v1::ListEdgesResponse reply;
  v1::Edge* edge = reply.add_edges();
  edge->set_source("O1");
  edge->set_relation("ON");
  edge->set_target("O2");
  edge->set_valid_from_ns(kNsPerSecond);
  const auto add = [&](ListWriter* list) { return list->Add(reply, reply.edges(), EdgeRow); };
  EXPECT_EQ(ListText(EdgeColumns(), Monotonic(), add),
            "source  relation  target  weight  held\n"
            "O1      ON        O2       0.000  +1s to open\n");
  EXPECT_EQ(ListText(EdgeColumns(), Monotonic(), add, "", ListFormat::kCsv),
            "source,relation,target,weight,held_from_ns,held_to_ns\r\n"
            "O1,ON,O2,0,1000000000,\r\n");
}

TEST(RenderNearest, BeginsWithTheDistance) {
  v1::ListNearestNodesResponse reply;
  v1::NearestNode* nearest = reply.add_nodes();
  nearest->set_distance_m(1.25);
  nearest->mutable_node()->set_id("O1");
  nearest->mutable_node()->mutable_map_t_node()->mutable_position();
  const std::string text = ListText(NearestColumns(), Monotonic(),
                                    [&](ListWriter* list) { return AddNearest(reply, list); });
  EXPECT_EQ(text.substr(0, text.find('\n')),
            "distance m  id  kind  layer  name  class   x m   y m   z m");
  EXPECT_NE(text.find("     1.250  O1"), std::string::npos) << text;
}

TEST(RenderMaps, BytesAreReadable) {
  EXPECT_EQ(BytesText(999), "999 bytes");
  EXPECT_EQ(BytesText(60'512'345), "60.5 MB (60512345 bytes)");
  EXPECT_EQ(BytesText(999'999), "1.0 MB (999999 bytes)");
}

}  // namespace
}  // namespace dsg::cli
