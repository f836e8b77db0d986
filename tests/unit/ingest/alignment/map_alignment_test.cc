// SPDX-License-Identifier: Apache-2.0
// Two robots in one building of made places, each in a map of its own.
#include "ingest/alignment/map_alignment.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "ingest/recognition/place_memory.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/recognition/made_places.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

constexpr NodeId kRobot('r', 0);
// Cameras look along x of a body, and z of the body is up.
const Pose3d kBodyTCamera{Vector3d(0.1, 0, 0.4), Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)};

// Where places are, and robots stand, in the building: a place a few metres before each stand.
Pose3d StandAt(int place) {
  return {Vector3d(4.0 * place, 2.0 * (place % 2), 0.0),
          Eigen::Quaterniond(Eigen::AngleAxisd(0.9 * place, Vector3d::UnitZ()))};
}

struct Visit {
  int place = 0;
  /// Beside the stand.
  Vector3d aside_m = Vector3d::Zero();
};

// What the robot of a map does and remembers. Its map is where `map_T_building` says.
GraphDelta MapOf(const std::vector<Visit>& visits, const Pose3d& map_T_building, uint64_t seed) {
  GraphDelta delta;
  TrajectoryAppend track{kRobot, {}};
  std::vector<KeyframeFeatures> keyframes;
  for (size_t i = 0; i < visits.size(); ++i) {
    const TimeNs time_ns = static_cast<TimeNs>(i + 1) * 20 * kNsPerSecond;
    const Pose3d building_T_body =
        StandAt(visits[i].place) * Pose3d{visits[i].aside_m, Eigen::Quaterniond::Identity()};
    TimedPose pose{time_ns};
    pose.map_T_agent = map_T_building * building_T_body;
    track.poses.push_back(pose);
    ViewSpec view;
    view.stamp = {0, time_ns};
    view.body_T_camera = kBodyTCamera;
    view.place_T_camera =
        (StandAt(visits[i].place) * kBodyTCamera).Inverse() * building_T_body * kBodyTCamera;
    view.seed = seed + i;
    keyframes.push_back(
        MadeKeyframe(MakePlace(static_cast<uint64_t>(visits[i].place) + 100), view));
  }
  Asset memory;
  memory.content = EncodePlaceMemory(keyframes).at(0);
  memory.sha256 = ComputeSha256(memory.content);
  memory.media_type = std::string(kPlaceMemoryType);
  Node robot;
  robot.id = kRobot;
  robot.layer = layers::kAgents;
  robot.kind = kinds::kRobot;
  robot.valid.from_ns = 0;
  robot.agent.emplace();
  robot.agent->place_memory = {memory.sha256};
  delta.assets.push_back(std::move(memory));
  delta.nodes.push_back(std::move(robot));
  delta.appends.push_back(std::move(track));
  return delta;
}

class MapAlignmentTest : public testing::Test {
 protected:
  void SetUp() override {
    auto store = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    store_ = *std::move(store);
  }

  void Commit(const std::string& map, GraphDelta delta) {
    MapSpec spec;
    spec.name = map;
    ASSERT_TRUE(store_->CreateMap(spec).ok());
    auto writer = store_->OpenWriter(map);
    ASSERT_TRUE(writer.ok()) << writer.status();
    delta.map = map;
    delta.session_id = "s";
    delta.sequence = 1;
    const auto committed = (*writer)->Commit(std::move(delta));
    ASSERT_TRUE(committed.ok()) << committed.status();
  }

  absl::StatusOr<MapAlignment> Align(const std::string& into, const std::string& other) {
    auto newest = [&](const std::string& map) { return *(*store_->OpenMap(map))->Latest(); };
    const auto a = newest(into);
    const auto b = newest(other);
    return AlignMaps({into, a.get()}, {other, b.get()}, {}, {});
  }

  test::TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
};

const Pose3d kOtherTBuilding{Vector3d(-6, 3, 0.2),
                             Eigen::Quaterniond(Eigen::AngleAxisd(1.2, Vector3d::UnitZ()))};

TEST_F(MapAlignmentTest, FindsTheTransformByWhatBothRobotsSaw) {
  Commit("a", MapOf({{1}, {2}, {3}, {4}, {5}}, {}, 10));
  Commit("b", MapOf({{5, {0.3, 0.2, 0}}, {9}, {3, {-0.2, 0.4, 0}}, {2, {0.1, -0.3, 0}}, {8}},
                    kOtherTBuilding, 900));
  const auto aligned = Align("a", "b");
  ASSERT_TRUE(aligned.ok()) << aligned.status();
  EXPECT_EQ(aligned->keyframe_count, 5);
  EXPECT_EQ(aligned->other_keyframe_count, 5);
  EXPECT_EQ(aligned->found.agree_count, 3);
  const Pose3d truth = kOtherTBuilding.Inverse();
  const Pose3d& found = aligned->found.map_T_other;
  const Vector3d middle = kOtherTBuilding * Vector3d(13, 1, 0);
  EXPECT_LT((found * middle - truth * middle).norm(), 0.1);
  EXPECT_LT(AngleBetween(found.orientation, truth.orientation), 0.02);
}

TEST_F(MapAlignmentTest, IsRefusedWhereNothingWasSeenTwice) {
  Commit("a", MapOf({{1}, {2}, {3}}, {}, 10));
  Commit("b", MapOf({{7}, {8}, {9}}, kOtherTBuilding, 900));
  const auto aligned = Align("a", "b");
  EXPECT_EQ(ReasonOf(aligned.status()), Reason::kNoRegistration);
  EXPECT_NE(aligned.status().message().find("map \"b\" is not found in \"a\": 0 views"),
            std::string::npos)
      << aligned.status();
}

TEST_F(MapAlignmentTest, SaysWhichMapRemembersNothing) {
  Commit("a", MapOf({{1}, {2}, {3}}, {}, 10));
  GraphDelta bare = MapOf({{1}, {2}, {3}}, {}, 20);
  bare.assets.clear();
  bare.nodes[0].agent->place_memory.clear();
  Commit("b", std::move(bare));
  const auto aligned = Align("a", "b");
  EXPECT_EQ(ReasonOf(aligned.status()), Reason::kNoRegistration);
  EXPECT_NE(aligned.status().message().find("no robot of map \"b\" remembers places"),
            std::string::npos)
      << aligned.status();
}

TEST_F(MapAlignmentTest, NamesTheRobotWhoseMemoryIsDamaged) {
  Commit("a", MapOf({{1}, {2}, {3}}, {}, 10));
  GraphDelta cut = MapOf({{1}, {2}, {3}}, {}, 20);
  cut.assets[0].content.resize(cut.assets[0].content.size() / 2);
  cut.assets[0].sha256 = ComputeSha256(cut.assets[0].content);
  cut.nodes[0].agent->place_memory = {cut.assets[0].sha256};
  Commit("b", std::move(cut));
  const auto aligned = Align("a", "b");
  EXPECT_EQ(ReasonOf(aligned.status()), Reason::kStoreCorrupt);
  EXPECT_NE(aligned.status().message().find("map \"b\", robot r0"), std::string::npos)
      << aligned.status();
}

}  // namespace
}  // namespace dsg::ingest
