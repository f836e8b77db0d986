// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "absl/strings/str_join.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Edge Between(NodeId source, const char* relation, NodeId target, double weight) {
  Edge edge;
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
  edge.weight = weight;
  return edge;
}

void AddPlace(uint64_t number, const Eigen::Vector3d& at, double clearance_m, NodeId room,
              GraphDelta* delta) {
  // As in the office, which fits boxes to what they hold.
  const Eigen::Vector3d half(number == 3 ? 3.0 : 1.5, 1.0, 1.0);
  Node place = MakeNode(NodeId('p', number), layers::kPlaces, kinds::kPlace, "",
                        Box3d(at - half, at + half));
  place.place = PlaceInfo();
  place.place->clearance_m = clearance_m;
  delta->nodes.push_back(place);
  delta->edges.push_back(Between(room, relations::kContains, place.id, 1.0));
}

void AddCouch(uint64_t number, double x, GraphDelta* delta) {
  Node couch =
      MakeNode(NodeId('O', number), layers::kObjects, kinds::kObject, "",
               Box3d(Eigen::Vector3d(x - 0.5, 5.5, 0.0), Eigen::Vector3d(x + 0.5, 6.5, 0.8)));
  couch.class_id = 7;
  couch.class_name = "couch";
  delta->nodes.push_back(couch);
}

// The office's places get clearances: p1 (2.5, 5, 1), p2 (6.5, 5, 1), p3 (15, 5, 1), with links of
// 0.8 m. Room R3 "attic" holds p4 at (2.5, 5, 7), linked to nothing. Couches O7 at x 4, beside p1,
// and O8 at x 15, beside p3; O8 leaves at 50 s.
GraphDelta Furniture() {
  GraphDelta delta;
  delta.labels = {{7, "couch"}};
  delta.nodes.push_back(MakeNode(NodeId('B', 1), layers::kBuildings, kinds::kBuilding, "HQ",
                                 Box3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(20, 10, 9))));
  delta.nodes.push_back(MakeNode(NodeId('R', 3), layers::kRooms, kinds::kRoom, "attic",
                                 Box3d(Eigen::Vector3d(0, 0, 6), Eigen::Vector3d(10, 10, 9))));
  delta.edges.push_back(Between(NodeId('B', 1), relations::kContains, NodeId('R', 3), 1.0));
  AddPlace(1, {2.5, 5, 1}, 1.0, NodeId('R', 1), &delta);
  AddPlace(2, {6.5, 5, 1}, 0.6, NodeId('R', 1), &delta);
  AddPlace(3, {15, 5, 1}, 1.5, NodeId('R', 2), &delta);
  AddPlace(4, {2.5, 5, 7}, 1.0, NodeId('R', 3), &delta);
  AddCouch(7, 4.0, &delta);
  AddCouch(8, 15.0, &delta);
  delta.nodes.back().valid.to_ns = 50 * kSecond;
  return delta;
}

class PlanPath : public testing::Test {
 protected:
  PlanPath() {
    MakeOffice(folder_.path());
    CommitToOffice(folder_.path(), Furniture());
    core_ = OpenCore(folder_.path());
  }

  static v1::PathEnd At(double x, double y, double z) {
    v1::PathEnd end;
    end.mutable_position()->set_x(x);
    end.mutable_position()->set_y(y);
    end.mutable_position()->set_z(z);
    return end;
  }
  static v1::PathEnd Node(const std::string& id_or_name) {
    v1::PathEnd end;
    end.set_node(id_or_name);
    return end;
  }
  static v1::PathEnd NearestOfClass(const std::string& class_name) {
    v1::PathEnd end;
    end.mutable_nearest()->set_class_name(class_name);
    return end;
  }
  static v1::PlanPathRequest Ask(const v1::PathEnd& from, const v1::PathEnd& to,
                                 double radius_m = 0.0) {
    v1::PlanPathRequest request;
    request.set_map(kMap);
    *request.mutable_from() = from;
    *request.mutable_to() = to;
    request.set_robot_radius_m(radius_m);
    return request;
  }

  absl::StatusOr<v1::PlanPathResponse> Plan(const v1::PlanPathRequest& request) {
    v1::PlanPathResponse reply;
    const absl::Status status = core_->PlanPath(call_, request, &reply);
    if (!status.ok()) return status;
    return reply;
  }
  // Places, or the error's reason and why.
  std::string Places(const v1::PlanPathRequest& request) {
    const auto reply = Plan(request);
    if (!reply.ok()) {
      if (ReasonOf(reply.status()) == Reason::kNoPath) return MetadataOf(reply.status())["why"];
      return std::string(reply.status().message());
    }
    return absl::StrJoin(reply->place_ids(), " ");
  }
  void ExpectError(const v1::PlanPathRequest& request, Reason reason, const std::string& field) {
    const auto reply = Plan(request);
    EXPECT_EQ(ReasonOf(reply.status()), reason) << reply.status();
    EXPECT_EQ(MetadataOf(reply.status())["field"], field) << reply.status();
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
};

TEST_F(PlanPath, GoesFromPositionToPositionOverPlacesAndRooms) {
  for (const v1::PlanMode mode : {v1::HIERARCHICAL, v1::FLAT}) {
    v1::PlanPathRequest request = Ask(At(2.0, 5, 1), At(15.5, 5, 1), 0.3);
    request.set_mode(mode);
    const auto reply = Plan(request);
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(absl::StrJoin(reply->place_ids(), " "), "p1 p2 p3");
    EXPECT_EQ(absl::StrJoin(reply->room_ids(), " "), "R1 R2");
    ASSERT_EQ(reply->polyline_size(), 5);
    EXPECT_EQ(reply->polyline(0).x(), 2.0);
    EXPECT_EQ(reply->polyline(4).x(), 15.5);
    EXPECT_NEAR(reply->length_m(), 13.5, 1e-9);
    EXPECT_NEAR(reply->clearance_m_min(), 0.6, 1e-6);
    EXPECT_EQ(reply->mode(), mode);
    EXPECT_EQ(reply->header().read_revision(), 2);
    EXPECT_GT(reply->expanded_count(), 0);
  }
}

TEST_F(PlanPath, GoesStraightWithinTheFreeSpaceOfOnePlace) {
  const auto reply = Plan(Ask(At(2.0, 5, 1), At(2.5, 5.5, 1), 0.2));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->polyline_size(), 2);
  EXPECT_EQ(absl::StrJoin(reply->place_ids(), " "), "p1");
  EXPECT_NEAR(reply->length_m(), std::sqrt(0.5), 1e-9);
}

TEST_F(PlanPath, FindsTheNearestThingOfAClassAsOfThen) {
  v1::PlanPathRequest request = Ask(Node("p3"), NearestOfClass("Couch"));
  EXPECT_EQ(Places(request), "p3 p2 p1");
  EXPECT_EQ(Plan(request)->to_node_id(), "O7");
  request.set_at_ns(20 * kSecond);
  EXPECT_EQ(Places(request), "p3");
  EXPECT_EQ(Plan(request)->to_node_id(), "O8");
}

TEST_F(PlanPath, StartsWhereAnAgentWas) {
  v1::PlanPathRequest request = Ask(Node("H12"), Node("lab"));
  request.set_at_ns(0);
  const auto reply = Plan(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->from_node_id(), "H12");
  EXPECT_EQ(reply->to_node_id(), "R2");
  EXPECT_EQ(reply->polyline(0).x(), 1.0);
  EXPECT_EQ(absl::StrJoin(reply->place_ids(), " "), "p1 p2 p3");
  // Its last pose is at x = 19, 4 m from the nearest place.
  request.clear_at_ns();
  EXPECT_EQ(Places(request), "no place is near the start H12");
  request.set_at_ns(30 * kSecond);
  EXPECT_EQ(ReasonOf(Plan(request).status()), Reason::kTimeOutsideTrack);
  request.set_at_ns(300 * kSecond);
  EXPECT_EQ(ReasonOf(Plan(request).status()), Reason::kTimeOutsideTrack);
}

TEST_F(PlanPath, TakesAnyPlaceOfARoom) {
  EXPECT_EQ(Places(Ask(Node("kitchen"), Node("lab"))), "p2 p3");
  EXPECT_EQ(Places(Ask(Node("HQ"), Node("p2"))), "p2");
}

TEST_F(PlanPath, SaysWhatIsInTheWay) {
  EXPECT_EQ(Places(Ask(Node("p1"), Node("p3"), 0.7)),
            "a robot of 0.7 m radius is too wide; the widest way admits 0.600 m");
  v1::PlanPathRequest request = Ask(Node("p1"), Node("p3"));
  request.add_blocked("p2");
  EXPECT_EQ(Places(request), "blocked nodes cut all ways");
  request.set_blocked(0, "kitchen");
  EXPECT_EQ(Places(request), "blocked nodes cut all ways");
  EXPECT_EQ(Places(Ask(Node("p1"), Node("attic"))),
            "the places of the start (R1) and of the end (R3) are not linked: the map has no "
            "chain of places between them, which comes from mapping the way or from seeing "
            "somebody walk it");
  EXPECT_EQ(Places(Ask(Node("p1"), At(90, 0, 0))), "no place is near the end (90.00, 0.00, 0.00)");
  EXPECT_EQ(Places(Ask(Node("p1"), Node("O8"))), "it is not in the world at that time");
  const auto status = Plan(Ask(Node("p1"), Node("p3"), 0.7)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  ErrorMetadata metadata = MetadataOf(status);
  EXPECT_EQ(metadata["from"], "p1");
  EXPECT_EQ(metadata["to"], "p3");
  EXPECT_EQ(metadata["radius_m_max"], "0.600");
  EXPECT_EQ(metadata["from_room"], "R1");
}

TEST_F(PlanPath, ReadsTheRevisionThatItIsTold) {
  v1::PlanPathRequest request = Ask(Node("p1"), Node("p3"), 0.3);
  request.mutable_read_at()->set_exact_revision(1);
  EXPECT_EQ(Places(request), "a robot of 0.3 m radius is too wide; the widest way admits 0.000 m");
  request.mutable_read_at()->set_exact_revision(2);
  EXPECT_EQ(Places(request), "p1 p2 p3");
}

TEST_F(PlanPath, RefusesBadInput) {
  const v1::PathEnd p1 = Node("p1");
  ExpectError(Ask(p1, p1, -0.1), Reason::kFieldInvalid, "robot_radius_m");
  ExpectError(Ask(p1, p1, kNan), Reason::kFieldInvalid, "robot_radius_m");
  ExpectError(Ask(p1, p1, 1.0 / 0.0), Reason::kFieldInvalid, "robot_radius_m");
  ExpectError(Ask(v1::PathEnd(), p1), Reason::kFieldInvalid, "from");
  ExpectError(Ask(p1, v1::PathEnd()), Reason::kFieldInvalid, "to");
  ExpectError(Ask(p1, At(0, kNan, 0)), Reason::kNumberNotFinite, "to.position");
  ExpectError(Ask(p1, Node("")), Reason::kFieldInvalid, "to.node");
  ExpectError(Ask(p1, Node("O99")), Reason::kNodeUnknown, "to.node");
  ExpectError(Ask(Node("nobody"), p1), Reason::kNodeUnknown, "from.node");
  v1::PathEnd anything;
  anything.mutable_nearest();
  ExpectError(Ask(p1, anything), Reason::kFieldInvalid, "to.nearest");
  v1::PlanPathRequest request = Ask(p1, p1);
  request.add_blocked("p2");
  request.add_blocked("p77");
  ExpectError(request, Reason::kNodeUnknown, "blocked[1]");
  request.set_blocked(1, "O7");
  ExpectError(request, Reason::kFieldInvalid, "blocked[1]");
  request = Ask(p1, p1);
  request.set_mode(static_cast<v1::PlanMode>(9));
  ExpectError(request, Reason::kFieldInvalid, "mode");
  EXPECT_EQ(ReasonOf(Plan(Ask(p1, NearestOfClass("unicorn"))).status()), Reason::kClassUnknown);
}

TEST_F(PlanPath, TellsWhatTheRobotWouldTouch) {
  v1::PlanPathRequest request = Ask(Node("p1"), Node("p3"), 0.3);
  request.set_check_collision(true);
  const auto reply = Plan(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_TRUE(reply->has_collision());
  // H13 stood at (3, 5, 1) when last seen, but the newest pose is 50 s younger. The chair spans
  // x 14 to 15 up to z = 1, and p3 is at (15, 5, 1).
  EXPECT_TRUE(reply->collision().hit());
  EXPECT_EQ(reply->collision().node_id(), "O2");
}

TEST_F(PlanPath, StopsAtTheDeadline) {
  query::CallContext late(query::CallContext::Clock::time_point::min());
  v1::PlanPathResponse reply;
  EXPECT_TRUE(absl::IsDeadlineExceeded(core_->PlanPath(late, Ask(Node("p1"), Node("p3")), &reply)));
}

TEST_F(PlanPath, AnswersManyAtOnceEachForItself) {
  v1::PlanPathsRequest request;
  request.set_map(kMap);
  *request.add_paths() = Ask(Node("p1"), Node("p3"), 0.3);
  *request.add_paths() = Ask(Node("p1"), Node("p3"), 0.7);
  *request.add_paths() = Ask(Node("p1"), Node("O99"));
  v1::PlanPathsResponse reply;
  ASSERT_TRUE(core_->PlanPaths(call_, request, &reply).ok());
  ASSERT_EQ(reply.results_size(), 3);
  EXPECT_EQ(reply.header().read_revision(), 2);
  EXPECT_EQ(reply.results(0).status_code(), 0);
  EXPECT_EQ(absl::StrJoin(reply.results(0).path().place_ids(), " "), "p1 p2 p3");
  EXPECT_FALSE(reply.results(0).path().has_header());
  for (const int i : {1, 2}) {
    EXPECT_EQ(reply.results(i).status_code(), static_cast<int>(absl::StatusCode::kNotFound));
    EXPECT_FALSE(reply.results(i).status_message().empty());
    EXPECT_FALSE(reply.results(i).has_path());
  }
  for (int i = 0; i < 1000; ++i) *request.add_paths() = Ask(Node("p1"), Node("p3"));
  reply.Clear();
  const absl::Status status = core_->PlanPaths(call_, request, &reply);
  EXPECT_EQ(MetadataOf(status)["field"], "paths");
}

}  // namespace
}  // namespace dsg::test
