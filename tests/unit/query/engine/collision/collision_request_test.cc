// SPDX-License-Identifier: Apache-2.0
// What a caller of CheckCollision gets, and what is refused.
#include "query/engine/collision.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "dsg/v1/query_service.pb.h"
#include "query/service/service_core.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::query {
namespace {

using test::kMap;
using test::kSecond;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void AddPose(double x, double y, double z, v1::CollisionBody* body) {
  v1::Vector3* position = body->add_poses()->mutable_position();
  position->set_x(x);
  position->set_y(y);
  position->set_z(z);
}

// A sphere beside the chair, which stands at x 14 to 15, y 4.5 to 5.5, z 0 to 1.
v1::CheckCollisionRequest NearChair() {
  v1::CheckCollisionRequest request;
  request.set_map(kMap);
  v1::CollisionBody* body = request.add_bodies();
  body->mutable_sphere()->set_radius_m(0.25);
  AddPose(13.5, 5, 0.5, body);
  return request;
}

class CheckCollisionCall : public testing::Test {
 protected:
  CheckCollisionCall() {
    test::MakeOffice(folder_.path());
    core_ = test::OpenCore(folder_.path());
  }

  absl::Status Ask(const v1::CheckCollisionRequest& request) {
    reply_.Clear();
    return core_->CheckCollision(CallContext(), request, &reply_);
  }

  const v1::CollisionResult& One(const v1::CheckCollisionRequest& request) {
    EXPECT_EQ(Ask(request), absl::OkStatus());
    if (reply_.results_size() == 0) reply_.add_results();
    return reply_.results(0);
  }

  // INVALID_ARGUMENT that names the field.
  void ExpectRefused(const std::string& field,
                     const std::function<void(v1::CheckCollisionRequest*)>& change) {
    SCOPED_TRACE(field);
    v1::CheckCollisionRequest request = NearChair();
    change(&request);
    const absl::Status status = Ask(request);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    EXPECT_EQ(MetadataOf(status)["field"], field) << status;
  }

  test::TempFolder folder_;
  std::unique_ptr<ServiceCore> core_;
  v1::CheckCollisionResponse reply_;
};

TEST_F(CheckCollisionCall, SaysHowFarTheNearestThingIs) {
  const v1::CollisionResult& result = One(NearChair());
  EXPECT_FALSE(result.hit());
  EXPECT_EQ(result.node_id(), "O2");
  EXPECT_EQ(result.what(), "object");
  EXPECT_NEAR(result.clearance_m(), 0.25, 1e-9);
  EXPECT_NEAR(result.point().x(), 14.0, 1e-9);
  EXPECT_TRUE(result.observed());
  EXPECT_EQ(reply_.header().read_revision(), 1);
}

TEST_F(CheckCollisionCall, AnswersEveryBodyInOrderAndEveryShape) {
  v1::CheckCollisionRequest request = NearChair();
  v1::CollisionBody* box = request.add_bodies();
  box->mutable_cuboid()->mutable_size()->set_x(0.5);
  box->mutable_cuboid()->mutable_size()->set_y(0.2);
  box->mutable_cuboid()->mutable_size()->set_z(0.2);
  AddPose(13.5, 5, 0.5, box);
  v1::CollisionBody* capsule = request.add_bodies();
  capsule->mutable_capsule()->set_radius_m(0.2);
  capsule->mutable_capsule()->set_length_m(1.0);
  AddPose(13.5, 5, 0.5, capsule);
  v1::CollisionBody* mesh = request.add_bodies();
  for (const float x : {0.0f, 0.0f, 0.0f, 0.6f, 0.0f, 0.0f, 0.0f, 0.1f, 0.0f}) {
    mesh->mutable_mesh()->add_vertices(x);
  }
  for (const uint32_t vertex : {0u, 1u, 2u}) mesh->mutable_mesh()->add_faces(vertex);
  AddPose(13.5, 5, 0.5, mesh);
  v1::CollisionBody* moving = request.add_bodies();
  moving->mutable_sphere()->set_radius_m(0.25);
  AddPose(13, 5, 0.5, moving);
  AddPose(17, 5, 0.5, moving);
  ASSERT_EQ(Ask(request), absl::OkStatus());
  ASSERT_EQ(reply_.results_size(), 5);
  EXPECT_NEAR(reply_.results(1).clearance_m(), 0.25, 1e-9);
  EXPECT_NEAR(reply_.results(2).clearance_m(), 0.3, 1e-9);
  EXPECT_TRUE(reply_.results(3).hit());
  EXPECT_TRUE(reply_.results(4).hit());
  EXPECT_NEAR(reply_.results(4).at_pose(), 0.75 / 4.0, 1e-9);
}

TEST_F(CheckCollisionCall, AMarginMakesANearThingAHit) {
  v1::CheckCollisionRequest request = NearChair();
  request.set_margin_m(0.3);
  EXPECT_TRUE(One(request).hit());
  request.set_margin_m(0.2);
  request.set_clearance_m_max(0.22);
  const v1::CollisionResult& result = One(request);
  EXPECT_FALSE(result.hit());
  EXPECT_EQ(result.what(), "");
  EXPECT_EQ(result.clearance_m(), 0.22);
}

TEST_F(CheckCollisionCall, IgnoresANodeWithAllBelowIt) {
  for (const char* name : {"O2", "chair", "p3", "R2", "lab", "HQ"}) {
    v1::CheckCollisionRequest request = NearChair();
    request.mutable_scope()->add_ignored(name);
    EXPECT_EQ(One(request).what(), "") << name;
  }
  v1::CheckCollisionRequest request = NearChair();
  request.mutable_scope()->add_ignored("R1");
  EXPECT_EQ(One(request).node_id(), "O2");
  request.mutable_scope()->add_ignored("nobody");
  EXPECT_EQ(ReasonOf(Ask(request)), Reason::kNodeUnknown);
}

TEST_F(CheckCollisionCall, MeetsAgentsOfTheInstant) {
  v1::CheckCollisionRequest request = NearChair();
  request.mutable_scope()->set_agents(true);
  request.set_at_ns(12 * kSecond);
  EXPECT_TRUE(One(request).hit());
  EXPECT_EQ(reply_.results(0).node_id(), "H12");
  EXPECT_EQ(reply_.results(0).what(), "agent");
  request.set_at_ns(30 * kSecond);
  EXPECT_EQ(One(request).what(), "");
  request.mutable_scope()->set_predicted_agents(true);
  request.set_at_ns(64 * kSecond);
  request.mutable_bodies(0)->mutable_poses(0)->mutable_position()->set_x(18.0);
  EXPECT_EQ(One(request).what(), "predicted_agent");
}

TEST_F(CheckCollisionCall, ReadsTheRevisionThatIsAskedFor) {
  GraphDelta delta;
  Node chair = test::OfficeDelta().nodes[7];
  ASSERT_EQ(chair.name, "chair");
  chair.valid.to_ns = 100 * kSecond;
  delta.nodes = {chair};
  test::CommitToOffice(folder_.path(), delta);
  v1::CheckCollisionRequest request = NearChair();
  EXPECT_EQ(One(request).what(), "");
  request.set_at_ns(99 * kSecond);
  EXPECT_EQ(One(request).node_id(), "O2");
  request.set_at_ns(100 * kSecond);
  EXPECT_EQ(One(request).what(), "");
  request.mutable_read_at()->set_exact_revision(1);
  EXPECT_EQ(One(request).node_id(), "O2");
  request.mutable_read_at()->set_exact_revision(3);
  EXPECT_EQ(ReasonOf(Ask(request)), Reason::kRevisionInFuture);
}

TEST_F(CheckCollisionCall, RefusesShapesThatAreNone) {
  for (const double bad : {0.0, -1.0, kNan, kInfinity, 1e9}) {
    ExpectRefused("bodies[0].sphere.radius_m",
                  [&](auto* r) { r->mutable_bodies(0)->mutable_sphere()->set_radius_m(bad); });
    ExpectRefused("bodies[0].cuboid.size.y", [&](auto* r) {
      v1::Vector3* size = r->mutable_bodies(0)->mutable_cuboid()->mutable_size();
      size->set_x(1);
      size->set_y(bad);
      size->set_z(1);
    });
    ExpectRefused("bodies[0].capsule.radius_m",
                  [&](auto* r) { r->mutable_bodies(0)->mutable_capsule()->set_radius_m(bad); });
  }
  ExpectRefused("bodies[0].capsule.length_m", [&](auto* r) {
    r->mutable_bodies(0)->mutable_capsule()->set_radius_m(1);
    r->mutable_bodies(0)->mutable_capsule()->set_length_m(-1);
  });
  ExpectRefused("bodies[0].shape", [](auto* r) { r->mutable_bodies(0)->clear_sphere(); });
  ExpectRefused("bodies", [](auto* r) { r->clear_bodies(); });
  ExpectRefused("bodies", [](auto* r) {
    for (int i = 0; i < 1000; ++i) *r->add_bodies() = r->bodies(0);
  });
}

TEST_F(CheckCollisionCall, RefusesMeshesThatAreNone) {
  const auto mesh = [](v1::CheckCollisionRequest* r) -> v1::TriangleMesh* {
    v1::TriangleMesh* out = r->mutable_bodies(0)->mutable_mesh();
    for (int i = 0; i < 9; ++i) out->add_vertices(static_cast<float>(i * i));
    for (const uint32_t vertex : {0u, 1u, 2u}) out->add_faces(vertex);
    return out;
  };
  ExpectRefused("bodies[0].mesh.vertices", [&](auto* r) { mesh(r)->clear_vertices(); });
  ExpectRefused("bodies[0].mesh.vertices", [&](auto* r) { mesh(r)->add_vertices(1); });
  ExpectRefused("bodies[0].mesh.vertices",
                [&](auto* r) { mesh(r)->set_vertices(4, static_cast<float>(kNan)); });
  ExpectRefused("bodies[0].mesh.faces", [&](auto* r) { mesh(r)->clear_faces(); });
  ExpectRefused("bodies[0].mesh.faces", [&](auto* r) { mesh(r)->add_faces(0); });
  ExpectRefused("bodies[0].mesh.faces", [&](auto* r) { mesh(r)->set_faces(1, 3); });
  ExpectRefused("bodies[0].mesh", [&](auto* r) {
    v1::TriangleMesh* out = mesh(r);
    for (int i = 0; i < 30'000; ++i) out->add_faces(0);
  });
}

TEST_F(CheckCollisionCall, RefusesPosesThatAreNone) {
  ExpectRefused("bodies[0].poses", [](auto* r) { r->mutable_bodies(0)->clear_poses(); });
  ExpectRefused("bodies[0].poses", [](auto* r) {
    for (int i = 0; i < 1000; ++i) AddPose(0, 0, 0, r->mutable_bodies(0));
  });
  ExpectRefused("bodies", [](auto* r) {
    for (int i = 0; i < 999; ++i) AddPose(0, 0, 0, r->mutable_bodies(0));
    for (int i = 0; i < 10; ++i) *r->add_bodies() = r->bodies(0);
  });
  for (const double bad : {kNan, kInfinity, 1e7}) {
    ExpectRefused("bodies[0].poses[1].position",
                  [&](auto* r) { AddPose(1, bad, 0, r->mutable_bodies(0)); });
  }
  ExpectRefused("bodies[0].poses", [](auto* r) { AddPose(9e5, 0, 0, r->mutable_bodies(0)); });
  for (const double bad : {kNan, 0.0, 0.5}) {
    ExpectRefused("bodies[0].poses[0].orientation", [&](auto* r) {
      r->mutable_bodies(0)->mutable_poses(0)->mutable_orientation()->set_w(bad);
    });
  }
}

TEST_F(CheckCollisionCall, RefusesDistancesAndScopesThatMakeNoSense) {
  for (const double bad : {-0.1, kNan, kInfinity, 100.0}) {
    ExpectRefused("margin_m", [&](auto* r) { r->set_margin_m(bad); });
  }
  for (const double bad : {-0.1, kNan, kInfinity, 101.0, 0.2}) {
    ExpectRefused("clearance_m_max", [&](auto* r) {
      r->set_margin_m(0.2);
      r->set_clearance_m_max(bad);
    });
  }
  ExpectRefused("at_ns", [](auto* r) { r->mutable_scope()->set_predicted_agents(true); });
  ExpectRefused("scope.ignored", [](auto* r) {
    for (int i = 0; i < 1001; ++i) r->mutable_scope()->add_ignored("O1");
  });
}

TEST_F(CheckCollisionCall, StopsWhenTheCallerIsGone) {
  CallContext call;
  call.Cancel();
  EXPECT_EQ(core_->CheckCollision(call, NearChair(), &reply_).code(), absl::StatusCode::kCancelled);
}

TEST_F(CheckCollisionCall, AWayThroughNothingStopsAtTheDeadline) {
  v1::CheckCollisionRequest request;
  request.set_map(kMap);
  for (int i = 0; i < 500; ++i) {
    v1::CollisionBody* body = request.add_bodies();
    body->mutable_capsule()->set_radius_m(0.1);
    AddPose(0, 0, 0.3, body);
    AddPose(90'000, 0, 0.3, body);
  }
  const CallContext call(CallContext::Clock::now() + std::chrono::milliseconds(30));
  EXPECT_EQ(core_->CheckCollision(call, request, &reply_).code(),
            absl::StatusCode::kDeadlineExceeded);
}

}  // namespace
}  // namespace dsg::query
