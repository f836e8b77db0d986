// SPDX-License-Identifier: Apache-2.0
// People of generated worlds, predicted from their tracks and the places in a store: nobody is
// foreseen inside a wall or furniture of the world itself, and beyond two seconds the best guess is
// nearer to where people went than constant velocity.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/space.pb.h"
#include "ingest/simulator/world/planner.h"
#include "ingest/simulator/world/walker.h"
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
constexpr int kPeopleCount = 5;
constexpr TimeNs kEndNs = 150 * kNsPerSecond;
constexpr TimeNs kPoseNs = kNsPerSecond / 5;
constexpr TimeNs kTenthNs = kNsPerSecond / 10;
constexpr double kTorsoM = 0.9;
// Of tracked positions on each axis.
constexpr double kNoiseM = 0.02;
// Of tenths of a second ahead.
constexpr std::array<int, 3> kHorizons = {20, 48, 80};
constexpr double kWalkingMS = 0.3;

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

struct Tally {
  int asked_count = 0;
  int path_count = 0;
  int touching_count = 0;
  int straight_touching_count = 0;
  std::array<double, 3> fde_m{};
  std::array<double, 3> straight_fde_m{};
};

// Where a person was at every tenth of a second.
std::vector<Point> TruePositions(const World& world, const Planner& planner, const AgentSpec& agent,
                                 uint64_t seed) {
  Walker walker(&world, &planner, agent, seed);
  std::vector<Point> positions;
  for (TimeNs at_ns = 0; at_ns <= kEndNs; at_ns += kTenthNs) {
    positions.push_back(walker.PoseAt(at_ns).position);
  }
  return positions;
}

TrajectoryAppend TrackOf(NodeId id, const std::vector<Point>& positions, Random* random) {
  TrajectoryAppend track{id, {}};
  for (size_t i = 0; i < positions.size(); i += kPoseNs / kTenthNs) {
    TimedPose pose;
    pose.time_ns = static_cast<TimeNs>(i) * kTenthNs;
    pose.map_T_agent.position = {positions[i].x() + kNoiseM * random->Normal(),
                                 positions[i].y() + kNoiseM * random->Normal(), kTorsoM};
    track.poses.push_back(pose);
  }
  return track;
}

// A store with a world and its people, and what really happened.
class Crowd {
 public:
  Crowd(const World& world, uint64_t seed) : world_(world) {
    const Planner planner(&world);
    Random random(seed, 12);
    GraphDelta delta = WorldGraph(world);
    delta.map = kMap;
    delta.session_id = "test";
    delta.sequence = 1;
    for (const AgentSpec& agent : MakeCrowd(kPeopleCount)) {
      if (agent.is_robot) continue;
      Node node;
      node.id = NodeId('H', static_cast<uint64_t>(agent.index));
      node.layer = layers::kAgents;
      node.kind = kinds::kHuman;
      node.name = agent.name;
      delta.nodes.push_back(node);
      people_.push_back({agent.name, TruePositions(world, planner, agent, seed)});
      delta.appends.push_back(TrackOf(node.id, people_.back().second, &random));
    }
    StoreOptions options;
    options.create = true;
    auto store = GraphStore::Open(folder_.path(), options);
    EXPECT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = kMap;
    EXPECT_TRUE((*store)->CreateMap(spec).ok());
    const auto committed = (*(*store)->OpenWriter(kMap))->Commit(std::move(delta));
    EXPECT_TRUE(committed.ok()) << committed.status();
    core_ = query::MakeServiceCore(*std::move(store));
  }

  // Everybody who walks, every other second.
  void PredictAll(Tally* tally) {
    for (const auto& [name, truth] : people_) {
      for (size_t now = 80; now + kHorizons.back() < truth.size(); now += 20) {
        if ((truth[now] - truth[now - 4]).norm() < kWalkingMS * 0.4) continue;
        PredictOne(name, truth, now, tally);
      }
    }
  }

 private:
  v1::PredictAgentResponse Ask(const std::string& name, size_t now, v1::PredictionModel model) {
    v1::PredictAgentRequest request;
    request.set_map(kMap);
    request.set_agent(name);
    request.set_from_ns(static_cast<TimeNs>(now) * kTenthNs);
    request.set_horizon_ns(kHorizons.back() * kTenthNs);
    request.set_period_ns(kTenthNs);
    request.set_model(model);
    v1::PredictAgentResponse reply;
    const absl::Status status = core_->PredictAgent(query::CallContext(), request, &reply);
    EXPECT_TRUE(status.ok()) << status;
    return reply;
  }

  bool Touches(const v1::PredictedPath& path) const {
    for (int i = 1; i < path.poses_size(); ++i) {
      const v1::Vector3& from = path.poses(i - 1).position();
      const v1::Vector3& to = path.poses(i).position();
      if (Clearance(world_, {from.x(), from.y()}, {to.x(), to.y()}) <= 0.0) return true;
    }
    return false;
  }

  static void AddErrors(const v1::PredictedPath& path, const std::vector<Point>& truth, size_t now,
                        std::array<double, 3>* errors_m) {
    for (size_t i = 0; i < kHorizons.size(); ++i) {
      const v1::Vector3& at = path.poses(kHorizons[i] - 1).position();
      (*errors_m)[i] += (Point(at.x(), at.y()) - truth[now + kHorizons[i]]).norm();
    }
  }

  void PredictOne(const std::string& name, const std::vector<Point>& truth, size_t now,
                  Tally* tally) {
    const v1::PredictAgentResponse to_goals = Ask(name, now, v1::GOALS);
    const v1::PredictAgentResponse straight = Ask(name, now, v1::CONSTANT_VELOCITY);
    ASSERT_GT(to_goals.paths_size(), 0);
    EXPECT_EQ(to_goals.model(), v1::GOALS) << name << " is off the graph at " << now;
    ++tally->asked_count;
    tally->path_count += to_goals.paths_size();
    AddErrors(to_goals.paths(0), truth, now, &tally->fde_m);
    AddErrors(straight.paths(0), truth, now, &tally->straight_fde_m);
    tally->straight_touching_count += Touches(straight.paths(0));
    for (const v1::PredictedPath& path : to_goals.paths()) {
      const bool touches = Touches(path);
      tally->touching_count += touches;
      EXPECT_FALSE(touches) << name << " from tenth " << now;
    }
  }

  const World& world_;
  test::TempFolder folder_;
  std::vector<std::pair<std::string, std::vector<Point>>> people_;
  std::unique_ptr<query::ServiceCore> core_;
};

TEST(PredictedPaths, StayOutOfTheWorldAndBeatConstantVelocity) {
  // Above those on which parameters were tuned.
  const uint64_t first_seed = test::TestSeed(11);
  for (const WorldKind kind : {WorldKind::kApartment, WorldKind::kWing, WorldKind::kOffice}) {
    Tally tally;
    for (uint64_t seed = first_seed; seed < first_seed + 3; ++seed) {
      SCOPED_TRACE(testing::Message() << Name(kind) << ", seed " << seed);
      const World world = *GenerateWorld({kind, seed});
      Crowd(world, seed).PredictAll(&tally);
    }
    const double count = tally.asked_count;
    std::printf(
        "%s: %d questions; FDE after 2, 4.8 and 8 s %.2f %.2f %.2f m, straight %.2f %.2f %.2f m; "
        "%d of %d paths touch something, straight %d\n",
        std::string(Name(kind)).c_str(), tally.asked_count, tally.fde_m[0] / count,
        tally.fde_m[1] / count, tally.fde_m[2] / count, tally.straight_fde_m[0] / count,
        tally.straight_fde_m[1] / count, tally.straight_fde_m[2] / count, tally.touching_count,
        tally.path_count, tally.straight_touching_count);
    EXPECT_GT(tally.asked_count, 200);
    EXPECT_GT(tally.straight_touching_count, tally.asked_count / 4);
    EXPECT_LT(tally.fde_m[1], 0.8 * tally.straight_fde_m[1]);
    EXPECT_LT(tally.fde_m[2], 0.8 * tally.straight_fde_m[2]);
  }
}

}  // namespace
}  // namespace dsg::simulator
