// SPDX-License-Identifier: Apache-2.0
// A mug in the office of other tests, with people who may have taken it, and the question who did.
// Refuses to judge the answer.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "dsg/v1/meetings.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {

// A mug in R1 was last seen at 100 s and missed at 140 s.
inline constexpr NodeId kMug('O', 10);
inline const Eigen::Vector3d kMugAt(3.0, 5.0, 0.8);

class Interactions : public testing::Test {
 protected:
  Interactions() { MakeOffice(folder_.path()); }

  void AddObject(NodeId id, const Eigen::Vector3d& at, TimeNs from_s, TimeNs to_s, TimeNs seen_s,
                 NodeId place = NodeId('p', 1)) {
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.05);
    Node node = MakeNode(id, layers::kObjects, kinds::kObject, "", Box3d(at - half, at + half));
    node.class_name = "mug";
    node.valid = {from_s * kSecond, to_s == 0 ? kTimeMax : to_s * kSecond};
    node.last_observed_ns = seen_s * kSecond;
    node.observation_count = 5;
    Edge edge{place, relations::kContains, id};
    edge.valid = node.valid;
    delta_.edges.push_back(edge);
    delta_.nodes.push_back(std::move(node));
  }

  void AddMug(TimeNs missed_s = 140) { AddObject(kMug, kMugAt, 20, missed_s, 100); }

  // Stands at `at` from from_s to to_s, a pose each half second; the right hand is at `hand` in the
  // middle of that, and beside the body else.
  void AddPerson(uint64_t index, const Eigen::Vector3d& at, TimeNs from_s, TimeNs to_s,
                 std::optional<Eigen::Vector3d> hand = std::nullopt) {
    const NodeId agent('H', index);
    Node node =
        MakeNode(agent, layers::kAgents, kinds::kHuman, "p" + std::to_string(index), Box3d());
    delta_.nodes.push_back(node);
    TrajectoryAppend track{agent, {}};
    ShapeAppend shapes;
    shapes.agent = agent;
    const TimeNs middle_ns = (from_s + to_s) * kSecond / 2;
    for (TimeNs t = from_s * kSecond; t <= to_s * kSecond; t += kSecond / 2) {
      track.poses.push_back(PoseAt(t, at.x(), at.y(), at.z()));
      BodyShape shape;
      shape.time_ns = t;
      shape.joints.assign(72, 0.0F);
      if (hand.has_value() && std::abs(t - middle_ns) <= kSecond / 2) {
        for (int i = 0; i < 3; ++i) shape.joints[69 + i] = static_cast<float>((*hand - at)[i]);
      }
      shapes.shapes.push_back(shape);
    }
    delta_.appends.push_back(std::move(track));
    delta_.shapes.push_back(std::move(shapes));
    delta_.stays.push_back(
        {agent, NodeId('p', 1), NodeId('R', 1), from_s * kSecond, to_s * kSecond});
  }

  // In the other room all the while.
  void AddFarPerson(uint64_t index, TimeNs from_s, TimeNs to_s) {
    AddPerson(index, {15.0, 5.5, 1.0}, from_s, to_s);
    delta_.stays.pop_back();
  }

  void AddEdge(NodeId from, const char* relation, NodeId to, double weight,
               const Interval& during) {
    Edge edge{from, relation, to, weight};
    edge.valid = during;
    delta_.edges.push_back(edge);
  }

  static Interval Seconds(TimeNs from_s, TimeNs to_s) { return {from_s * kSecond, to_s * kSecond}; }

  v1::ListInteractionsRequest Ask() {
    v1::ListInteractionsRequest request;
    request.set_map(kMap);
    request.set_object(ToString(kMug));
    request.set_from_ns(0);
    request.set_to_ns(1000 * kSecond);
    request.add_types(v1::PICKED);
    request.set_include_abstained(true);
    return request;
  }

  absl::StatusOr<v1::ListInteractionsResponse> Get(const v1::ListInteractionsRequest& request) {
    if (!delta_.nodes.empty() || !delta_.edges.empty()) {
      CommitToOffice(folder_.path(), std::exchange(delta_, {}));
    }
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    v1::ListInteractionsResponse reply;
    const absl::Status status = core_->ListInteractions(query::CallContext(), request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  v1::Interaction GetOne() {
    const auto reply = Get(Ask());
    EXPECT_TRUE(reply.ok()) << reply.status();
    if (!reply.ok() || reply->interactions_size() != 1) {
      ADD_FAILURE() << "not one interaction";
      return {};
    }
    double sum = 0.0;
    for (const auto& one : reply->interactions(0).candidates()) sum += one.probability();
    EXPECT_NEAR(sum, 1.0, 1e-9);
    return reply->interactions(0);
  }

  static bool HasEvidence(const v1::InteractionCandidate& candidate, const std::string& kind) {
    for (const auto& row : candidate.evidence()) {
      if (row.kind() == kind && !row.source().empty() && !row.detail().empty()) return true;
    }
    return false;
  }

  // Stands there, a pose a second.
  void AddRobot(const Eigen::Vector3d& at, TimeNs from_s, TimeNs to_s) {
    const NodeId robot('r', 9);
    delta_.nodes.push_back(MakeNode(robot, layers::kAgents, kinds::kRobot, "r9", Box3d()));
    TrajectoryAppend track{robot, {}};
    for (TimeNs t = from_s; t <= to_s; ++t) {
      track.poses.push_back(PoseAt(t * kSecond, at.x(), at.y(), at.z()));
    }
    delta_.appends.push_back(std::move(track));
  }

  static v1::InteractionCandidate Candidate(const v1::Interaction& one, const std::string& name) {
    for (const auto& candidate : one.candidates()) {
      if (candidate.agent_name() == name) return candidate;
    }
    return {};
  }

  static bool HasCandidate(const v1::Interaction& one, const std::string& name) {
    return Candidate(one, name).agent_name() == name;
  }

  static v1::InteractionCandidate Alternative(const v1::Interaction& one,
                                              const std::string& alternative) {
    for (const auto& candidate : one.candidates()) {
      if (candidate.alternative() == alternative) return candidate;
    }
    return {};
  }

  TempFolder folder_;
  GraphDelta delta_;
  std::unique_ptr<query::ServiceCore> core_;
};

}  // namespace dsg::test
