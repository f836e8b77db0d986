// SPDX-License-Identifier: Apache-2.0
// Paths planned over generated worlds in a store, walked against the worlds themselves: a robot of
// the radius that was asked for must come along without touching wall, pillar or furniture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "ingest/simulator/world/world.h"
#include "ingest/simulator/world/world_graph.h"
#include "query/service/service_core.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::simulator {
namespace {

constexpr char kMap[] = "world";

// What stands in the way of walkers, straight from the plan.
double Clearance(const World& world, const Point& from, const Point& to) {
  double clearance_m = std::numeric_limits<double>::infinity();
  for (const Structure& structure : world.plan.structures) {
    if (!structure.IsObstacle()) continue;
    clearance_m = std::min(clearance_m, SegmentDistanceToRect(from, to, structure.rect));
  }
  for (const Furniture& item : world.furniture) {
    if (!item.StandsOnFloor()) continue;
    clearance_m = std::min(clearance_m, SegmentDistanceToRect(from, to, item.Footprint()));
  }
  return clearance_m;
}

// Plans in one world as a service would.
class Walks {
 public:
  Walks(const World& world, uint64_t seed) : world_(world), random_(seed, 11) {
    StoreOptions options;
    options.create = true;
    auto store = GraphStore::Open(folder_.path(), options);
    EXPECT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = kMap;
    EXPECT_TRUE((*store)->CreateMap(spec).ok());
    GraphDelta delta = WorldGraph(world);
    delta.map = kMap;
    delta.session_id = "test";
    delta.sequence = 1;
    const auto committed = (*(*store)->OpenWriter(kMap))->Commit(std::move(delta));
    EXPECT_TRUE(committed.ok()) << committed.status();
    core_ = query::MakeServiceCore(*std::move(store));
  }

  int found_count() const { return found_count_; }
  int touched_count() const { return touched_count_; }

  void PlanAndWalk() {
    const double radius_m = random_.Uniform(0.15, 0.35);
    v1::PlanPathRequest request;
    request.set_map(kMap);
    request.set_robot_radius_m(radius_m);
    request.set_mode(random_.Chance(0.5) ? v1::FLAT : v1::HIERARCHICAL);
    PutFreePosition(radius_m, request.mutable_from()->mutable_position());
    PutFreePosition(radius_m, request.mutable_to()->mutable_position());
    v1::PlanPathResponse reply;
    const absl::Status status = core_->PlanPath(query::CallContext(), request, &reply);
    if (ReasonOf(status) == Reason::kNoPath) return;
    ASSERT_TRUE(status.ok()) << status;
    ++found_count_;
    double clearance_m = std::numeric_limits<double>::infinity();
    for (int i = 1; i < reply.polyline_size(); ++i) {
      const Point from(reply.polyline(i - 1).x(), reply.polyline(i - 1).y());
      const Point to(reply.polyline(i).x(), reply.polyline(i).y());
      clearance_m = std::min(clearance_m, Clearance(world_, from, to));
    }
    if (clearance_m >= radius_m - 1e-6) return;
    ++touched_count_;
    ADD_FAILURE() << "comes as near as " << clearance_m << " m with a radius of " << radius_m
                  << " m: " << request.ShortDebugString();
  }

 private:
  // Somewhere in a room where a robot of the radius can stand.
  void PutFreePosition(double radius_m, v1::Vector3* out) {
    const Rect bounds = world_.Bounds();
    while (true) {
      const Point point(random_.Uniform(bounds.min().x(), bounds.max().x()),
                        random_.Uniform(bounds.min().y(), bounds.max().y()));
      if (world_.plan.RoomAt(point) < 0 || Clearance(world_, point, point) < radius_m) continue;
      out->set_x(point.x());
      out->set_y(point.y());
      // Bodies are reported at the height of their middle, places lie on the floor.
      out->set_z(random_.Chance(0.5) ? 0.0 : 1.0);
      return;
    }
  }

  const World& world_;
  Random random_;
  test::TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  int found_count_ = 0;
  int touched_count_ = 0;
};

TEST(PlannedPaths, NeverTouchTheWorld) {
  // Above those on which parameters were tuned.
  const uint64_t first_seed = test::TestSeed(11);
  constexpr int kQuestionCount = 180;
  int asked_count = 0;
  int found_count = 0;
  int touched_count = 0;
  for (const WorldKind kind : {WorldKind::kApartment, WorldKind::kWing, WorldKind::kOffice}) {
    for (uint64_t seed = first_seed; seed < first_seed + 3; ++seed) {
      SCOPED_TRACE(testing::Message() << Name(kind) << ", seed " << seed);
      const World world = *GenerateWorld({kind, seed});
      Walks walks(world, seed);
      for (int i = 0; i < kQuestionCount; ++i) walks.PlanAndWalk();
      asked_count += kQuestionCount;
      found_count += walks.found_count();
      touched_count += walks.touched_count();
    }
  }
  std::printf("%d questions, %d paths found and walked, %d touch something\n", asked_count,
              found_count, touched_count);
  EXPECT_GE(found_count, 1000);
}

}  // namespace
}  // namespace dsg::simulator
