// SPDX-License-Identifier: Apache-2.0
// Floor, head and depth tell how far a person is, and stay silent when they cannot.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "ingest/agents/detections/depth_cue.h"
#include "ingest/agents/detections/floor_cue.h"
#include "tests/unit/ingest/agents/detections/detection_test_util.h"

namespace dsg::ingest {
namespace {

constexpr uint64_t kCueSeed = 20200514;
constexpr uint16_t kPerson = 60 << 8 | 5;

/// A person before a camera, with a detection whose own depth is wrong.
struct Scene {
  Scene(double range_m, double side_m, double heading_rad = 2.0) {
    torso = Upright({range_m, side_m, kSolesBelowPelvisM}, heading_rad);
    camera.name = "cam0";
    detection = PerfectDetection(camera, map_T_camera, torso);
    detection.mask_instance = 5;
  }

  PlacedBody Body() const {
    PlacedBody body;
    body.detection = &detection;
    body.camera = &camera;
    body.map_T_camera = map_T_camera;
    // Half as far again, on the ray.
    body.torso_map = map_T_camera.position + 1.5 * (torso.position - map_T_camera.position);
    for (size_t j = 0; j < size_t{kJointCount}; ++j) {
      body.joints_map[j] = map_T_camera.orientation * detection.joints_root[j];
    }
    return body;
  }

  // A wall 3 m behind the person, and the person as an upright elliptic cylinder.
  DepthFrame Depth() const {
    DepthFrame frame;
    frame.camera = camera;
    frame.map_T_camera = map_T_camera;
    const size_t count = static_cast<size_t>(camera.width * camera.height);
    frame.depth_m.assign(count, static_cast<float>(torso.position.x() + 3.0));
    frame.labels.assign(count, 0);
    frame.dynamic.assign(count, 0);
    const Pose3d torso_T_camera = torso.Inverse() * map_T_camera;
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
        const auto depth_m = HitBody(torso_T_camera.position, torso_T_camera.orientation * ray);
        if (!depth_m.has_value()) continue;
        const size_t i = static_cast<size_t>(v * camera.width + u);
        frame.depth_m[i] = static_cast<float>(*depth_m);
        frame.labels[i] = kPerson;
        frame.dynamic[i] = 1;
      }
    }
    return frame;
  }

  static std::optional<double> HitBody(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
    const Eigen::Vector2d scale(1.0 / 0.12, 1.0 / 0.2);
    const Eigen::Vector2d p = from.head<2>().cwiseProduct(scale);
    const Eigen::Vector2d d = ray.head<2>().cwiseProduct(scale);
    const double b = p.dot(d);
    const double root = b * b - d.squaredNorm() * (p.squaredNorm() - 1.0);
    if (root < 0.0) return std::nullopt;
    const double at = (-b - std::sqrt(root)) / d.squaredNorm();
    const double z = from.z() + at * ray.z();
    if (at <= 0.0 || z < -kSolesBelowPelvisM || z > 0.77) return std::nullopt;
    return at;
  }

  CameraCalibration camera = TestCamera();
  Pose3d map_T_camera = LookAlongX(1.3);
  Pose3d torso;
  HumanDetection detection;
};

// Something between camera and person over some columns, in nobody's label.
void Occlude(double from_px, double to_px, DepthFrame* frame) {
  for (int v = 0; v < frame->camera.height; ++v) {
    for (int u = 0; u < frame->camera.width; ++u) {
      if (u < from_px || u >= to_px) continue;
      const size_t i = static_cast<size_t>(v * frame->camera.width + u);
      frame->depth_m[i] = 1.0f;
      frame->labels[i] = 10 << 8 | 5;
      frame->dynamic[i] = 0;
    }
  }
}

double AlongM(const PositionCue& cue, const Scene& scene) {
  const Eigen::Vector3d view = *HorizontalView(scene.map_T_camera.position, scene.torso.position);
  return view.dot(cue.torso_map - scene.torso.position);
}

double AcrossM(const PositionCue& cue, const Scene& scene) {
  const Eigen::Vector3d view = *HorizontalView(scene.map_T_camera.position, scene.torso.position);
  return Eigen::Vector3d(-view.y(), view.x(), 0.0).dot(cue.torso_map - scene.torso.position);
}

int Rank(const Eigen::Matrix3d& information) {
  const Eigen::Vector3d values =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(information).eigenvalues();
  EXPECT_GT(values.minCoeff(), -1e-6);
  return static_cast<int>((values.array() > 1e-3).count());
}

TEST(FloorCue, FindsTheDistanceWhateverTheDetectionSays) {
  SCOPED_TRACE(testing::Message() << "seed " << kCueSeed);
  Random random(kCueSeed, 1);
  for (int i = 0; i < 100; ++i) {
    const Scene scene(random.Uniform(3.0, 8.0), random.Uniform(-1.5, 1.5),
                      random.Uniform(-3.0, 3.0));
    const auto cue = FloorContactCue(scene.Body(), 0.0);
    ASSERT_TRUE(cue.has_value());
    EXPECT_EQ(cue->kind, PositionCue::Kind::kFloorContact);
    EXPECT_LT(std::abs(AlongM(*cue, scene)), 0.4) << "at " << scene.torso.position.transpose();
    EXPECT_EQ(Rank(cue->information_map), 1);
    EXPECT_NEAR((cue->information_map * Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-9);
  }
}

TEST(FloorCue, IsSurerNearBy) {
  const auto near = FloorContactCue(Scene(3.0, 0.0).Body(), 0.0);
  const auto far = FloorContactCue(Scene(8.0, 0.0).Body(), 0.0);
  ASSERT_TRUE(near.has_value() && far.has_value());
  EXPECT_GT(near->information_map(0, 0), 2.0 * far->information_map(0, 0));
}

TEST(FloorCue, StaysSilentWithoutFeet) {
  Scene hidden(4.0, 0.0);
  hidden.detection.joint_visibility[10] = hidden.detection.joint_visibility[11] = 0.0;
  EXPECT_FALSE(FloorContactCue(hidden.Body(), 0.0).has_value());
  Scene cut(4.0, 0.0);
  cut.detection.box_px[3] = 478.0;
  EXPECT_FALSE(FloorContactCue(cut.Body(), 0.0).has_value());
  Scene below(4.0, 0.0);
  EXPECT_FALSE(FloorContactCue(below.Body(), 1.5).has_value()) << "a floor above the camera";
}

TEST(FloorCue, TrustsATallBoxWithoutJointsLess) {
  Scene scene(4.0, 0.0);
  const auto with = FloorContactCue(scene.Body(), 0.0);
  scene.detection.has_joints = false;
  const auto without = FloorContactCue(scene.Body(), 0.0);
  ASSERT_TRUE(with.has_value() && without.has_value());
  EXPECT_LT(without->information_map(0, 0), 0.5 * with->information_map(0, 0));
  EXPECT_LT(std::abs(AlongM(*without, scene)), 0.4);
  scene.detection.box_px[0] -= 100.0;
  EXPECT_FALSE(FloorContactCue(scene.Body(), 0.0).has_value()) << "half a person, or two";
}

TEST(FloorCue, FindsTheDistanceByTheHeadAndKnowsWhenNot) {
  Scene scene(4.0, 0.6);
  const auto cue = HeadTopCue(scene.Body(), 0.0);
  ASSERT_TRUE(cue.has_value());
  EXPECT_LT(std::abs(AlongM(*cue, scene)), 0.1);
  EXPECT_EQ(Rank(cue->information_map), 1);
  EXPECT_LT(cue->information_map.trace(),
            FloorContactCue(scene.Body(), 0.0)->information_map.trace());
  Scene level(4.0, 0.6);
  level.map_T_camera = LookAlongX(1.65);
  level.detection = PerfectDetection(level.camera, level.map_T_camera, level.torso);
  EXPECT_FALSE(HeadTopCue(level.Body(), 0.0).has_value());
  scene.detection.joint_visibility[15] = 0.0;
  EXPECT_FALSE(HeadTopCue(scene.Body(), 0.0).has_value());
}

TEST(FloorCue, KnowsTheHeightOfStandingAndOfBentLegs) {
  Scene scene(4.0, 0.0);
  const PositionCue standing = TorsoHeightCue(scene.Body(), 0.2, 0.95, 0.15);
  EXPECT_NEAR(standing.torso_map.z(), 0.2 + kSolesBelowPelvisM, 0.03);
  EXPECT_EQ(Rank(standing.information_map), 1);
  Joints sitting = StandingJoints();
  for (const size_t joint : {7u, 8u, 10u, 11u}) sitting[joint] += Eigen::Vector3d(0.4, 0, 0.4);
  scene.detection = PerfectDetection(scene.camera, scene.map_T_camera, scene.torso, sitting);
  const PositionCue seated = TorsoHeightCue(scene.Body(), 0.2, 0.95, 0.15);
  EXPECT_NEAR(seated.torso_map.z(), 0.2 + kSolesBelowPelvisM - 0.4, 0.03);
  scene.detection.has_joints = false;
  const PositionCue unknown = TorsoHeightCue(scene.Body(), 0.2, 0.95, 0.15);
  EXPECT_NEAR(unknown.torso_map.z(), 1.15, 1e-9);
  EXPECT_NEAR(unknown.information_map(2, 2), 1.0 / (0.15 * 0.15), 1e-6);
}

TEST(DepthCue, FindsDistanceAndSideWhateverTheDetectionSays) {
  SCOPED_TRACE(testing::Message() << "seed " << kCueSeed);
  Random random(kCueSeed, 2);
  for (int i = 0; i < 12; ++i) {
    const Scene scene(random.Uniform(2.5, 8.0), random.Uniform(-1.5, 1.5),
                      random.Uniform(-3.0, 3.0));
    const auto cue = DepthImageCue(scene.Body(), scene.Depth());
    ASSERT_TRUE(cue.has_value());
    EXPECT_LT(std::abs(AlongM(*cue, scene)), 0.1);
    EXPECT_LT(std::abs(AcrossM(*cue, scene)), 0.05);
    EXPECT_EQ(Rank(cue->information_map), 2);
    EXPECT_NEAR((cue->information_map * Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-9);
  }
}

TEST(DepthCue, IsNotFooledByWhatStandsBefore) {
  const Scene scene(5.0, 0.0);
  for (const bool has_labels : {true, false}) {
    DepthFrame frame = scene.Depth();
    Occlude(0, 355, &frame);
    if (!has_labels) frame.labels.clear();
    const auto cue = DepthImageCue(scene.Body(), frame);
    ASSERT_TRUE(cue.has_value());
    EXPECT_LT(std::abs(AlongM(*cue, scene)), 0.1);
    EXPECT_LT(std::abs(AcrossM(*cue, scene)), 0.15);
  }
}

TEST(DepthCue, ManagesWithDepthAlone) {
  const Scene scene(5.0, 0.5);
  DepthFrame frame = scene.Depth();
  frame.labels.clear();
  frame.dynamic.clear();
  const auto cue = DepthImageCue(scene.Body(), frame);
  ASSERT_TRUE(cue.has_value());
  EXPECT_LT(std::abs(AlongM(*cue, scene)), 0.1);
  EXPECT_LT(std::abs(AcrossM(*cue, scene)), 0.05);
}

TEST(DepthCue, KeepsOffTheInstancesOfOtherPictures) {
  const Scene scene(5.0, 0.5);
  DepthFrame frame = scene.Depth();
  // The number is the chair's there.
  for (size_t i = 0; i < frame.labels.size(); ++i) {
    frame.labels[i] = frame.dynamic[i] != 0 ? 60 << 8 | 9 : 11 << 8 | 5;
  }
  frame.time_ns = scene.detection.time_ns + 50'000'000;
  const auto cue = DepthImageCue(scene.Body(), frame);
  ASSERT_TRUE(cue.has_value());
  EXPECT_LT(std::abs(AlongM(*cue, scene)), 0.1);
}

TEST(DepthCue, UsesADepthCameraThatStandsElsewhere) {
  Scene scene(5.0, 0.5);
  Scene aside = scene;
  aside.map_T_camera.position += Eigen::Vector3d(0.0, 0.3, 0.1);
  aside.camera.fx = aside.camera.fy = 300.0;
  // On its true ray the far guess is off by a part of the baseline only.
  const auto cue = DepthImageCue(scene.Body(), aside.Depth());
  ASSERT_TRUE(cue.has_value());
  EXPECT_LT(std::abs(AlongM(*cue, scene)), 0.1);
  EXPECT_LT(std::abs(AcrossM(*cue, scene)), 0.08);
}

TEST(DepthCue, StaysSilentWithoutReadings) {
  const Scene scene(5.0, 0.5);
  DepthFrame empty = scene.Depth();
  std::fill(empty.depth_m.begin(), empty.depth_m.end(), 0.0f);
  EXPECT_FALSE(DepthImageCue(scene.Body(), empty).has_value());
  DepthFrame still = scene.Depth();
  std::fill(still.dynamic.begin(), still.dynamic.end(), uint8_t{0});
  still.labels.clear();
  EXPECT_FALSE(DepthImageCue(scene.Body(), still).has_value()) << "nothing moves there";
}

TEST(DepthCue, NeverCrashesOnBoxesOfAnyKind) {
  SCOPED_TRACE(testing::Message() << "seed " << kCueSeed);
  Random random(kCueSeed, 3);
  const double wild[] = {NAN, INFINITY, -1e300, 1e300, -50.0, 719.0, 479.0, 1e6};
  const Scene scene(5.0, 0.5);
  const DepthFrame frame = scene.Depth();
  for (int i = 0; i < 300; ++i) {
    Scene bad = scene;
    bad.detection.box_px[random.Index(4)] = wild[random.Index(8)];
    bad.detection.joints_px[static_cast<size_t>(random.Index(24))][0] = wild[random.Index(8)];
    bad.detection.mask_instance = random.Index(2) * 5;
    for (const auto& cue : {DepthImageCue(bad.Body(), frame), FloorContactCue(bad.Body(), 0.0),
                            HeadTopCue(bad.Body(), 0.0)}) {
      if (!cue.has_value()) continue;
      EXPECT_TRUE(cue->torso_map.allFinite());
      EXPECT_TRUE(cue->information_map.allFinite());
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
