// SPDX-License-Identifier: Apache-2.0
// Long work ends within 50 ms of its deadline, which is looked at where a cancel is: at every place
// of every kind of question.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <thread>
#include <vector>

#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/random.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::query {
namespace {

using Clock = CallContext::Clock;
using std::chrono::duration_cast;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using test::kSecond;

constexpr milliseconds kStopMax{50};
constexpr int kSide = 100;
constexpr int kHallWalkerCount = 16;
constexpr int kWalkPoseCount = 2000;
constexpr TimeNs kWalkEndNs = kWalkPoseCount * (kSecond / 10);
constexpr int kObjectCount = 5000;

NodeId Place(int x, int y) { return NodeId('p', static_cast<uint64_t>(1000 + y * kSide + x)); }

void AddEdge(NodeId source, const char* relation, NodeId target, GraphDelta* delta) {
  Edge& edge = delta->edges.emplace_back();
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
}

// A hall of 100 x 100 places, half a metre apart, as rooms of 10 x 10.
void AddHall(GraphDelta* delta) {
  for (int i = 0; i < 100; ++i) {
    Node room = test::MakeNode(NodeId('R', static_cast<uint64_t>(100 + i)), layers::kRooms,
                               kinds::kRoom, "", Box3d());
    delta->nodes.push_back(room);
  }
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      Node place = test::MakeNode(Place(x, y), layers::kPlaces, kinds::kPlace, "", Box3d());
      place.map_T_node.position = {0.5 * x, 0.5 * y, 1.0};
      place.place = PlaceInfo();
      place.place->clearance_m = 0.4;
      delta->nodes.push_back(place);
      const NodeId room('R', static_cast<uint64_t>(100 + y / 10 * 10 + x / 10));
      AddEdge(room, relations::kContains, place.id, delta);
      if (x > 0) AddEdge(Place(x - 1, y), relations::kTraversable, place.id, delta);
      if (y > 0) AddEdge(Place(x, y - 1), relations::kTraversable, place.id, delta);
    }
  }
}

void AddObjects(Random* random, GraphDelta* delta) {
  for (int i = 0; i < kObjectCount; ++i) {
    const Eigen::Vector3d p(random->Uniform(0, 49), random->Uniform(0, 49), random->Uniform(0, 2));
    Node object = test::MakeNode(NodeId('O', static_cast<uint64_t>(1000 + i)), layers::kObjects,
                                 kinds::kObject, "thing " + std::to_string(i),
                                 Box3d(p, p + Eigen::Vector3d::Constant(0.3)));
    // Half of them are taken away, so that there are interactions to explain.
    if (i % 2 == 0) object.valid = {0, 1 + i % 190 * kSecond};
    const int x = static_cast<int>(2 * p.x());
    const int y = static_cast<int>(2 * p.y());
    AddEdge(Place(x, y), relations::kContains, object.id, delta);
    delta->nodes.push_back(std::move(object));
  }
}

void AddWalkers(Random* random, GraphDelta* delta) {
  for (int i = 0; i < kHallWalkerCount; ++i) {
    const NodeId id('H', static_cast<uint64_t>(100 + i));
    delta->nodes.push_back(
        test::MakeNode(id, layers::kAgents, kinds::kHuman, "walker " + std::to_string(i), Box3d()));
    TrajectoryAppend track{id, {}};
    const double radius_m = random->Uniform(3, 20);
    for (int k = 0; k < kWalkPoseCount; ++k) {
      const double angle = i + 0.1 * k / radius_m;
      track.poses.push_back(test::PoseAt(k * (kSecond / 10), 25 + radius_m * std::cos(angle),
                                         25 + radius_m * std::sin(angle), 1));
    }
    delta->appends.push_back(std::move(track));
  }
}

class Stop : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TempFolder>();
    test::MakeOffice(folder_->path());
    Random random(11, 0);
    GraphDelta delta;
    AddHall(&delta);
    AddObjects(&random, &delta);
    AddWalkers(&random, &delta);
    test::AddRandomMesh(10, &random, &delta);
    test::CommitToOffice(folder_->path(), std::move(delta));
  }
  static void TearDownTestSuite() { folder_ = nullptr; }

  using Ask = std::function<absl::Status(ServiceCore*, const CallContext&)>;

  // Ends `ask` at deadlines spread over its work. `is_cold`: with a core that has read nothing yet.
  void ExpectStops(const Ask& ask, bool is_cold = false) {
    constexpr int kDeadlineCount = 6;
    // A busy machine may keep this thread waiting for longer than what is measured.
    constexpr int kTryCount = 10;
    auto core = test::OpenCore(folder_->path());
    if (!is_cold) Warm(core.get());
    // The shortest of some, since the deadlines below are to come before the end.
    auto length = Clock::duration::max();
    for (int i = 0; i < 3; ++i) {
      if (is_cold) core = test::OpenCore(folder_->path());
      const auto begin = Clock::now();
      const absl::Status whole = ask(core.get(), CallContext(begin + std::chrono::seconds(1)));
      ASSERT_TRUE(whole.ok() || absl::IsDeadlineExceeded(whole)) << whole;
      length = std::min(length, Clock::now() - begin);
    }
    int stopped_count = 0;
    for (int i = 0; i < kDeadlineCount; ++i) {
      auto least = Clock::duration::max();
      for (int k = 0; k < kTryCount && least > kStopMax; ++k) {
        if (is_cold) core = test::OpenCore(folder_->path());
        const auto deadline = Clock::now() + length * i / kDeadlineCount;
        const absl::Status status = ask(core.get(), CallContext(deadline));
        const auto late = Clock::now() - deadline;
        ASSERT_TRUE(status.ok() || absl::IsDeadlineExceeded(status)) << status;
        if (!status.ok()) ++stopped_count;
        least = std::min(least, late);
      }
      EXPECT_LE(duration_cast<microseconds>(least), microseconds(kStopMax))
          << "deadline after " << i << "/" << kDeadlineCount << " of "
          << duration_cast<milliseconds>(length).count() << " ms";
    }
    // The first deadline has passed when the call begins.
    EXPECT_GE(stopped_count, 2) << "nothing was long enough to be stopped";
  }

  template <typename Request, typename Reply>
  static Ask Unary(absl::Status (Api::*method)(const CallContext&, const Request&, Reply*),
                   Request request) {
    request.set_map(test::kMap);
    return [method, request](ServiceCore* core, const CallContext& call) {
      Reply reply;
      return (core->*method)(call, request, &reply);
    };
  }

  static void Warm(ServiceCore* core) {
    v1::PlanPathRequest request = RandomPath(0);
    v1::PlanPathResponse reply;
    request.set_map(test::kMap);
    ASSERT_TRUE(core->PlanPath(CallContext(), request, &reply).ok());
  }

  static void SetPoint(Random* random, v1::Vector3* out) {
    out->set_x(random->Uniform(0, 49));
    out->set_y(random->Uniform(0, 49));
    out->set_z(random->Uniform(0, 2));
  }

  static v1::PlanPathRequest RandomPath(uint64_t stream) {
    Random random(12, stream);
    v1::PlanPathRequest request;
    SetPoint(&random, request.mutable_from()->mutable_position());
    SetPoint(&random, request.mutable_to()->mutable_position());
    return request;
  }

  static Ask LongPrediction() {
    v1::PredictAgentRequest request;
    request.set_agent("H100");
    request.set_from_ns(kWalkEndNs / 2);
    request.set_horizon_ns(400 * kSecond);
    request.set_path_count_max(20);
    return Unary(&Api::PredictAgent, request);
  }

  static inline std::unique_ptr<test::TempFolder> folder_;
};

TEST_F(Stop, EndsTheReadingOfAGraph) {
  v1::SearchNodesRequest request;
  request.mutable_pattern()->set_kind("object");
  ExpectStops(Unary(&Api::SearchNodes, request), /*is_cold=*/true);
}

TEST_F(Stop, EndsTheMakingOfWhatPathsNeed) {
  ExpectStops(Unary(&Api::PlanPath, RandomPath(1)), /*is_cold=*/true);
}

TEST_F(Stop, EndsASearchOverAllNodes) {
  v1::SearchNodesRequest request;
  request.set_query(
      "name = \"*1*2*3*4*\" and not inside (place and not traversable (place and traversable "
      "R100))");
  ExpectStops(Unary(&Api::SearchNodes, request));
}

TEST_F(Stop, EndsAThousandPaths) {
  v1::PlanPathsRequest request;
  for (uint64_t i = 0; i < 1000; ++i) {
    v1::PlanPathRequest path = RandomPath(i);
    path.set_mode(v1::FLAT);
    *request.add_paths() = path;
  }
  ExpectStops(Unary(&Api::PlanPaths, request));
}

TEST_F(Stop, EndsTenThousandPosesThatMightCollide) {
  Random random(13, 0);
  v1::CheckCollisionRequest request;
  for (int i = 0; i < 10; ++i) {
    v1::CollisionBody* body = request.add_bodies();
    body->mutable_sphere()->set_radius_m(1e-4);
    for (int k = 0; k < 1000; ++k) SetPoint(&random, body->add_poses()->mutable_position());
  }
  ExpectStops(Unary(&Api::CheckCollision, request));
}

TEST_F(Stop, EndsOneLongStepThatMightCollide) {
  v1::CheckCollisionRequest request;
  for (int i = 0; i < 10; ++i) {
    v1::CollisionBody* body = request.add_bodies();
    body->mutable_cuboid()->mutable_size()->set_x(0.01);
    body->mutable_cuboid()->mutable_size()->set_y(0.01);
    body->mutable_cuboid()->mutable_size()->set_z(0.01);
    for (int k = 0; k < 2; ++k) {
      v1::Vector3* p = body->add_poses()->mutable_position();
      p->set_x(100.0 * k - 25);
      p->set_y(5.0 * i);
      p->set_z(2.5);
    }
  }
  ExpectStops(Unary(&Api::CheckCollision, request));
}

TEST_F(Stop, EndsEncountersOfAll) {
  v1::ListEncountersRequest request;
  request.set_to_ns(kWalkEndNs);
  request.set_distance_m(20);
  request.set_page_size(1000);
  ExpectStops(Unary(&Api::ListEncounters, request));
}

TEST_F(Stop, EndsInteractionsOfAll) {
  v1::ListInteractionsRequest request;
  request.set_to_ns(kWalkEndNs);
  request.set_include_abstained(true);
  ExpectStops(Unary(&Api::ListInteractions, request));
}

TEST_F(Stop, EndsAPrediction) { ExpectStops(LongPrediction(), /*is_cold=*/true); }

// Those who are in a hurry give up, whatever they were making for all; the others do not notice.
TEST_F(Stop, LeavesOthersTheirAnswers) {
  v1::CheckCollisionRequest collision;
  v1::CollisionBody* body = collision.add_bodies();
  body->mutable_sphere()->set_radius_m(0.1);
  body->add_poses()->mutable_position()->set_x(3);
  const Ask asks[] = {Unary(&Api::PlanPath, RandomPath(1)), LongPrediction(),
                      Unary(&Api::CheckCollision, collision)};
  constexpr size_t kThreadCount = 6;
  for (int round = 0; round < 5; ++round) {
    const auto core = test::OpenCore(folder_->path());
    const auto hurried = Clock::now() + milliseconds(30 * round);
    std::vector<absl::Status> statuses(kThreadCount);
    std::vector<std::thread> threads;
    for (size_t i = 0; i < kThreadCount; ++i) {
      threads.emplace_back([&, i] {
        const CallContext call(i % 2 == 0 ? hurried : Clock::time_point::max());
        statuses[i] = asks[i % std::size(asks)](core.get(), call);
      });
    }
    for (std::thread& thread : threads) thread.join();
    for (size_t i = 0; i < kThreadCount; ++i) {
      const bool has_given_up = i % 2 == 0 && absl::IsDeadlineExceeded(statuses[i]);
      EXPECT_TRUE(statuses[i].ok() || has_given_up) << statuses[i];
    }
  }
}

TEST_F(Stop, EndsAMesh) {
  ExpectStops([](ServiceCore* core, const CallContext& call) {
    v1::GetMeshRequest request;
    request.set_map(test::kMap);
    return query::ReadStream(call, core->GetMesh(call, request),
                             [](const v1::GetMeshResponse&) { return true; });
  });
}

TEST_F(Stop, EndsASubgraph) {
  const Ask ask = [](ServiceCore* core, const CallContext& call) {
    v1::GetSubgraphRequest request;
    request.set_map(test::kMap);
    request.set_root("R100");
    request.add_relations("TRAVERSABLE");
    request.add_relations("CONTAINS");
    request.set_both_directions(true);
    request.set_depth_max(1000);
    return query::ReadStream(call, core->GetSubgraph(call, request),
                             [](const v1::GetSubgraphResponse&) { return true; });
  };
  ExpectStops(ask);
}

TEST_F(Stop, EndsADifference) {
  v1::DiffRevisionsRequest request;
  request.set_from_revision(1);
  request.set_to_revision(2);
  request.set_page_size(1000);
  ExpectStops(Unary(&Api::DiffRevisions, request));
}

}  // namespace
}  // namespace dsg::query
