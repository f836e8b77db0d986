// SPDX-License-Identifier: Apache-2.0
// What a map has is drawn on the pixels where the camera has it, of the right instant.
#include "ingest/overlay/draw_overlay.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "schema/base/status.h"
#include "schema/picture/look.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/overlay/made_camera.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr NodeId kRobot('r', 1);
constexpr NodeId kPerson('H', 4);
constexpr NodeId kCup('O', 1);
constexpr TimeNs kSecond = kNsPerSecond;
constexpr uint8_t kGray = 90;

Node MakeThing(NodeId id, const std::string& kind, LayerId layer, const Vector3d& position_map) {
  Node node;
  node.id = id;
  node.kind = kind;
  node.layer = layer;
  node.map_T_node.position = position_map;
  node.valid.from_ns = 0;
  return node;
}

TimedPose PoseAt(TimeNs time_ns, const Vector3d& position_map) {
  TimedPose pose{time_ns};
  pose.map_T_agent.position = position_map;
  return pose;
}

// The robot stands at the origin for 10 s; a person goes by 4 m ahead, from right to left.
GraphDelta World() {
  GraphDelta delta;
  delta.map = "home";
  delta.session_id = "test";
  delta.sequence = 1;
  Node cup = MakeThing(kCup, kinds::kObject, layers::kObjects, {4, -1, 1});
  cup.class_name = "cup";
  cup.box_node = Box3d(Vector3d::Constant(-0.3), Vector3d::Constant(0.3));
  cup.valid = {0, 6 * kSecond};
  Node person = MakeThing(kPerson, kinds::kHuman, layers::kAgents, Vector3d::Zero());
  person.box_node = Box3d(Vector3d(-0.2, -0.2, -0.8), Vector3d(0.2, 0.2, 0.6));
  delta.nodes = {cup, person, MakeThing(kRobot, kinds::kRobot, layers::kAgents, Vector3d::Zero())};
  TrajectoryAppend robot{kRobot, {}};
  TrajectoryAppend walk{kPerson, {}};
  for (int second = 0; second <= 10; ++second) {
    robot.poses.push_back(PoseAt(second * kSecond, Vector3d::Zero()));
    walk.poses.push_back(PoseAt(second * kSecond, {4, 0.4 * (second - 5), 1}));
  }
  delta.appends = {robot, walk};
  BodyShape shape;
  shape.time_ns = 5 * kSecond + 100'000'000;
  for (int joint = 0; joint < kJointCount; ++joint) {
    // All at the torso, but the head above it.
    shape.joints.insert(shape.joints.end(), {0.0f, 0.0f, joint == 15 ? 0.5f : 0.0f});
  }
  delta.shapes = {{kPerson, std::nullopt, {shape}}};
  return delta;
}

class DrawOverlay : public testing::Test {
 protected:
  void Commit(const GraphDelta& delta) {
    auto store =
        OpenStore("memory:overlay_" +
                      std::string(testing::UnitTest::GetInstance()->current_test_info()->name()),
                  {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    store_ = *std::move(store);
    MapSpec spec;
    spec.name = "home";
    ASSERT_TRUE(store_->CreateMap(spec).ok());
    auto writer = store_->OpenWriter("home");
    ASSERT_TRUE(writer.ok()) << writer.status();
    const auto committed = (*writer)->Commit(delta);
    ASSERT_TRUE(committed.ok()) << committed.status();
    writer_ = *std::move(writer);
    const auto map = store_->OpenMap("home");
    ASSERT_TRUE(map.ok()) << map.status();
    map_ = *map;
  }

  absl::StatusOr<MapScene> Scene(const std::string& robot = "") {
    DSG_ASSIGN_OR_RETURN(auto snapshot, map_->Latest());
    return MapScene::Read(std::move(snapshot), robot);
  }

  picture::Picture DrawAt(TimeNs at_ns, std::vector<HumanDetection> detections = {}) {
    const auto scene = Scene();
    EXPECT_TRUE(scene.ok()) << scene.status();
    const auto pose = scene->RobotAt(at_ns);
    EXPECT_TRUE(pose.ok() && pose->has_value());
    const CameraCalibration camera = MakeCamera();
    OverlayImage image{
        at_ns, {camera.width, camera.height, PixelFormat::kGray8, {}}, std::move(detections)};
    image.image.bytes.assign(static_cast<size_t>(camera.width) * 240, kGray);
    const auto drawn = DrawOverlayImage(*scene, **pose, camera, image, {});
    EXPECT_TRUE(drawn.ok()) << drawn.status();
    return *drawn;
  }

  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<MapWriter> writer_;
  std::shared_ptr<MapReader> map_;
};

uint32_t At(const picture::Picture& picture, int x, int y) {
  const size_t i = 3 * static_cast<size_t>(y * picture.width + x);
  return static_cast<uint32_t>(picture.rgb[i] << 16 | picture.rgb[i + 1] << 8 | picture.rgb[i + 2]);
}

bool IsPlain(const picture::Picture& picture, int x, int y) {
  return At(picture, x, y) == (kGray << 16 | kGray << 8 | kGray);
}

// Nearer to that colour than to the image below.
bool IsLike(const picture::Picture& picture, int x, int y, uint32_t rgb) {
  int off = 0;
  int off_plain = 0;
  for (const int shift : {0, 8, 16}) {
    const int is = static_cast<int>(At(picture, x, y) >> shift & 0xff);
    off += std::abs(is - static_cast<int>(rgb >> shift & 0xff));
    off_plain += std::abs(is - kGray);
  }
  return off < off_plain;
}

// The near face of the cup's box is 3.7 m ahead, its left edge 0.7 m to the right; the row is on it
// and beside the trail of the person.
constexpr int kCupEdgePx = 198;
constexpr int kCupRowPx = 130;

Node Cup() { return World().nodes[0]; }

TEST_F(DrawOverlay, DrawsObjectsAndPeopleWhereTheCameraHasThem) {
  ASSERT_NO_FATAL_FAILURE(Commit(World()));
  const picture::Picture picture = DrawAt(5 * kSecond);
  EXPECT_EQ(picture.width, 320);
  EXPECT_EQ(picture.height, 240);
  EXPECT_TRUE(IsLike(picture, kCupEdgePx, kCupRowPx, ClassColor(Cup())));
  EXPECT_TRUE(IsPlain(picture, kCupEdgePx + 8, kCupRowPx));
  // The neck of the person, between torso (pixel 160, 120) and head (160, 95).
  EXPECT_TRUE(IsLike(picture, 160, 108, AgentColor(0)));
  // Where it came from, on the right: 3 s are 1.2 m.
  EXPECT_TRUE(IsLike(picture, 160 + 40, 120, AgentColor(0)));
  EXPECT_TRUE(IsPlain(picture, 160 - 40, 120));
  EXPECT_TRUE(IsPlain(picture, 10, 10));
}

TEST_F(DrawOverlay, DrawsTheWorldOfTheInstant) {
  ASSERT_NO_FATAL_FAILURE(Commit(World()));
  const picture::Picture picture = DrawAt(9 * kSecond);
  // The cup is gone, and the person 1.6 m to the left; nobody saw its joints then.
  EXPECT_TRUE(IsPlain(picture, kCupEdgePx, kCupRowPx));
  EXPECT_TRUE(IsLike(picture, 160 - 78, 120, AgentColor(0)));
  EXPECT_TRUE(IsPlain(picture, 160 - 80, 108));
}

TEST_F(DrawOverlay, LeavesOutObjectsBehindTheMeshAndPalesPeople) {
  GraphDelta world = World();
  MeshBlock wall;
  wall.index = {1, -1, 0};
  wall.positions_map = {{2, -1.9f, 0}, {2, -0.1f, 0}, {2, -0.1f, 1.9f}, {2, -1.9f, 1.9f}};
  wall.faces = {{0, 1, 2}, {2, 3, 0}};
  world.mesh_blocks = {wall};
  ASSERT_NO_FATAL_FAILURE(Commit(world));
  const picture::Picture picture = DrawAt(5 * kSecond);
  EXPECT_TRUE(IsPlain(picture, kCupEdgePx, kCupRowPx));
  // The person stands beside the wall; the trail is behind it.
  EXPECT_TRUE(IsLike(picture, 160, 108, AgentColor(0)));
  EXPECT_FALSE(IsLike(picture, 160 + 40, 120, AgentColor(0)));
  EXPECT_FALSE(IsPlain(picture, 160 + 40, 120));
}

TEST_F(DrawOverlay, OutlinesDetectionsAndRooms) {
  GraphDelta world = World();
  Node room = MakeThing(NodeId('R', 1), kinds::kRoom, layers::kRooms, {3, 0, 1.5});
  room.class_name = "hall";
  room.region = RegionInfo{{{-2, -2}, {6, -2}, {6, 2}, {-2, 2}}, 0.0, 3.0, {}};
  world.nodes.push_back(room);
  ASSERT_NO_FATAL_FAILURE(Commit(world));
  HumanDetection detection;
  detection.box_px = {20, 30, 60, 90};
  const picture::Picture picture = DrawAt(5 * kSecond, {detection});
  EXPECT_TRUE(IsLike(picture, 20, 60, 0xffe14d));
  EXPECT_TRUE(IsLike(picture, 40, 90, 0xffe14d));
  EXPECT_TRUE(IsPlain(picture, 40, 50));
  // The far edge of the floor is 6 m ahead and 1 m below the camera.
  EXPECT_TRUE(IsLike(picture, 140, static_cast<int>(120.0 + 200.0 / 6.0 + 0.5), RoomColor(room)));
}

TEST_F(DrawOverlay, RefusesRobotsThatAreNotThereAndTimesWithoutPose) {
  ASSERT_NO_FATAL_FAILURE(Commit(World()));
  const auto none = Scene("spot");
  EXPECT_EQ(ReasonOf(none.status()), Reason::kAgentUnknown);
  EXPECT_NE(none.status().message().find("r1"), std::string_view::npos) << none.status();
  const auto scene = Scene("r1");
  ASSERT_TRUE(scene.ok()) << scene.status();
  const auto late = scene->RobotAt(11 * kSecond);
  ASSERT_TRUE(late.ok()) << late.status();
  EXPECT_FALSE(late->has_value());
}

}  // namespace
}  // namespace dsg::ingest
