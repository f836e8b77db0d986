// SPDX-License-Identifier: Apache-2.0
// People of known places are found where they stand, by whatever the network gives.
#include "ingest/agents/detections/perspective.h"

#include <cmath>

#include "ingest/agents/detections/lens.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/agents/detections/detection_test_util.h"

namespace dsg::ingest {
namespace {

constexpr uint64_t kPerspectiveSeed = 20200513;

Pose3d RandomPerson(Random* random) {
  const double range_m = random->Uniform(2.0, 9.0);
  return Upright({range_m, random->Uniform(-0.4, 0.4) * range_m, 0.93},
                 random->Uniform(-std::numbers::pi, std::numbers::pi));
}

CameraCalibration Distorted(Distortion kind) {
  CameraCalibration camera = TestCamera();
  camera.distortion = kind;
  camera.distortion_coefficients = kind == Distortion::kEquidistant
                                       ? std::vector<double>{-0.02, 0.01, -0.003, 0.0}
                                       : std::vector<double>{-0.25, 0.07, 0.001, -0.001};
  return camera;
}

double PositionErrorM(const PersonInCamera& person, const Pose3d& map_T_camera,
                      const Pose3d& map_T_torso) {
  return (map_T_camera * person.camera_T_torso.position - map_T_torso.position).norm();
}

TEST(Perspective, FindsPlaceAndHeadingOfAPerfectDetection) {
  SCOPED_TRACE(testing::Message() << "seed " << kPerspectiveSeed);
  Random random(kPerspectiveSeed, 1);
  const Pose3d map_T_camera = LookAlongX(1.2, 0.1);
  for (int i = 0; i < 200; ++i) {
    const Pose3d torso = RandomPerson(&random);
    const auto person =
        PlaceInCamera(PerfectDetection(TestCamera(), map_T_camera, torso), TestCamera(), {});
    ASSERT_TRUE(person.ok()) << person.status();
    EXPECT_LT(PositionErrorM(*person, map_T_camera, torso), 1e-6);
    EXPECT_LT(AngleBetween(map_T_camera.orientation * person->camera_T_torso.orientation,
                           torso.orientation),
              1e-5);
    EXPECT_TRUE(person->has_heading);
    EXPECT_LT(person->reprojection_px, 1e-6);
  }
}

TEST(Perspective, TakesDistortionOff) {
  SCOPED_TRACE(testing::Message() << "seed " << kPerspectiveSeed);
  const Pose3d map_T_camera = LookAlongX(1.2);
  for (const Distortion kind : {Distortion::kRadialTangential, Distortion::kEquidistant}) {
    Random random(kPerspectiveSeed, 2);
    const CameraCalibration camera = Distorted(kind);
    for (int i = 0; i < 50; ++i) {
      const Pose3d torso = RandomPerson(&random);
      const HumanDetection detection = PerfectDetection(camera, map_T_camera, torso);
      const auto person = PlaceInCamera(detection, camera, {});
      ASSERT_TRUE(person.ok()) << person.status();
      EXPECT_LT(PositionErrorM(*person, map_T_camera, torso), 1e-5);
      const auto straight = PlaceInCamera(detection, TestCamera(), {});
      EXPECT_GT(PositionErrorM(*straight, map_T_camera, torso), 1e-3) << "distortion says nothing";
    }
  }
}

TEST(Perspective, InvertsTheLensAndKnowsItsEnd) {
  for (const Distortion kind : {Distortion::kRadialTangential, Distortion::kEquidistant}) {
    const CameraCalibration camera = Distorted(kind);
    for (double x = -0.8; x <= 0.8; x += 0.2) {
      const Eigen::Vector3d ray(x, 0.5 * x - 0.1, 1.0);
      const auto found = RayThrough(camera, Project(camera, ray));
      ASSERT_TRUE(found.has_value()) << x;
      EXPECT_LT((*found - ray).norm(), 1e-6);
    }
  }
  EXPECT_FALSE(RayThrough(Distorted(Distortion::kRadialTangential), {90'000, 0}).has_value());
  EXPECT_FALSE(RayThrough(TestCamera(), {NAN, 0}).has_value());
}

TEST(Perspective, StandsAFewWildJoints) {
  SCOPED_TRACE(testing::Message() << "seed " << kPerspectiveSeed);
  Random random(kPerspectiveSeed, 3);
  const Pose3d map_T_camera = LookAlongX(1.2);
  double sum_m = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Pose3d torso = RandomPerson(&random);
    HumanDetection detection = PerfectDetection(TestCamera(), map_T_camera, torso);
    for (auto& pixel : detection.joints_px) {
      pixel.x() += random.Normal();
      pixel.y() += random.Normal();
    }
    detection.joints_px[20].x() += 25.0;
    detection.joints_px[5].y() -= 15.0;
    const auto person = PlaceInCamera(detection, TestCamera(), {});
    ASSERT_TRUE(person.ok()) << person.status();
    sum_m += PositionErrorM(*person, map_T_camera, torso) / torso.position.norm();
  }
  EXPECT_LT(sum_m / 100, 0.02);
}

TEST(Perspective, TurnsABodyThatItsPixelsDoNotFit) {
  const Pose3d map_T_camera = LookAlongX(1.2);
  const Pose3d torso = Upright({3.0, 0.3, 0.93}, 2.5);
  HumanDetection detection = PerfectDetection(TestCamera(), map_T_camera, torso);
  const Eigen::Quaterniond wrong(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
  for (auto& joint : detection.joints_root) joint = wrong * joint;
  const auto person = PlaceInCamera(detection, TestCamera(), {});
  ASSERT_TRUE(person.ok()) << person.status();
  EXPECT_LT(person->reprojection_px, 0.1);
  EXPECT_LT(AngleBetween(person->joints_turn, wrong.conjugate()), 1e-3);
  EXPECT_LT(PositionErrorM(*person, map_T_camera, torso), 1e-3);
}

TEST(Perspective, FallsBackToTheWeakCameraWhenJointsAreHidden) {
  const Pose3d map_T_camera = LookAlongX(1.2);
  const Pose3d torso = Upright({5.0, -1.0, 0.93}, 1.0);
  HumanDetection detection = PerfectDetection(TestCamera(), map_T_camera, torso);
  detection.joint_visibility.fill(0.0);
  detection.joint_visibility[0] = detection.joint_visibility[1] = 1.0;
  const auto person = PlaceInCamera(detection, TestCamera(), {});
  ASSERT_TRUE(person.ok()) << person.status();
  EXPECT_LT(PositionErrorM(*person, map_T_camera, torso), 1e-6);
}

TEST(Perspective, TakesAFullTranslationAsItIs) {
  HumanDetection detection =
      PerfectDetection(TestCamera(), LookAlongX(1.2), Upright({5.0, -1.0, 0.93}, 1.0));
  detection.pelvis_camera = Eigen::Vector3d(0.5, 0.2, 3.0);
  const auto person = PlaceInCamera(detection, TestCamera(), {});
  ASSERT_TRUE(person.ok()) << person.status();
  EXPECT_EQ(person->camera_T_torso.position, *detection.pelvis_camera);
  EXPECT_GT(person->reprojection_px, 8.0) << "the joints' pixels say otherwise";
}

TEST(Perspective, PlacesABoxByTheHeightOfAMeanBody) {
  const Pose3d map_T_camera = LookAlongX(1.2);
  const Pose3d torso = Upright({6.0, 0.5, 0.93}, 1.0);
  HumanDetection detection = PerfectDetection(TestCamera(), map_T_camera, torso);
  detection.has_joints = false;
  detection.pose_coefficients.clear();
  detection.weak_scale = 0.0;
  const auto person = PlaceInCamera(detection, TestCamera(), {});
  ASSERT_TRUE(person.ok()) << person.status();
  EXPECT_LT(PositionErrorM(*person, map_T_camera, torso), 0.3);
  EXPECT_FALSE(person->has_heading);
  EXPECT_GT(person->heading_sigma_rad, 1.0);
}

TEST(Perspective, IsUnsureAlongTheRay) {
  const Pose3d torso = Upright({6.0, 2.0, 0.93}, 1.0);
  HumanDetection detection = PerfectDetection(TestCamera(), LookAlongX(1.2), torso);
  const auto person = PlaceInCamera(detection, TestCamera(), {});
  ASSERT_TRUE(person.ok()) << person.status();
  const Eigen::Vector3d ray = person->camera_T_torso.position.normalized();
  const Eigen::Vector3d across = ray.cross(Eigen::Vector3d::UnitY()).normalized();
  EXPECT_NEAR(std::sqrt(ray.dot(person->covariance_camera * ray)), 0.12 * 6.0 + 0.1, 0.05);
  const double seen_m = std::sqrt(across.dot(person->covariance_camera * across));
  EXPECT_NEAR(seen_m, 0.02 * 6.0 + 0.08, 0.02);
  detection.joint_visibility.fill(0.4);
  const auto hidden = PlaceInCamera(detection, TestCamera(), {});
  EXPECT_GT(across.dot(hidden->covariance_camera * across), 1.3 * seen_m * seen_m);
}

TEST(Perspective, ReadsTheAxesOfSmplToo) {
  const Pose3d map_T_camera = LookAlongX(1.2);
  const Pose3d torso = Upright({4.0, 0.0, 0.93}, 2.0);
  HumanDetection detection = PerfectDetection(TestCamera(), map_T_camera, torso);
  // Columns: SMPL's left, up and forward in the torso's axes.
  Eigen::Matrix3d torso_R_smpl;
  torso_R_smpl << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const Eigen::AngleAxisd turn(map_T_camera.orientation.conjugate() * torso.orientation *
                               Eigen::Quaterniond(torso_R_smpl));
  for (size_t i = 0; i < 3; ++i) {
    detection.pose_coefficients[i] =
        static_cast<float>(turn.angle() * turn.axis()[static_cast<int>(i)]);
  }
  const auto person = PlaceInCamera(detection, TestCamera(), {});
  ASSERT_TRUE(person.ok()) << person.status();
  EXPECT_LT(AngleBetween(map_T_camera.orientation * person->camera_T_torso.orientation,
                         torso.orientation),
            1e-5);
}

TEST(Perspective, FindsTheHeadingByJointsAlone) {
  const Pose3d map_T_camera = LookAlongX(1.2);
  const Pose3d torso = Upright({4.0, 0.0, 0.93}, -2.0);
  HumanDetection detection = PerfectDetection(TestCamera(), map_T_camera, torso);
  detection.pose_coefficients.clear();
  const auto person = PlaceInCamera(detection, TestCamera(), {});
  ASSERT_TRUE(person.ok()) << person.status();
  const Eigen::Vector3d forward =
      map_T_camera.orientation * (person->camera_T_torso.orientation * Eigen::Vector3d::UnitX());
  EXPECT_NEAR(std::atan2(forward.y(), forward.x()), -2.0, 1e-6);
}

TEST(Perspective, NamesTheDetectionThatItCannotPlace) {
  HumanDetection detection =
      PerfectDetection(TestCamera(), LookAlongX(1.2), Upright({4.0, 0.0, 0.93}, 0.0));
  const auto expect_refused = [](const HumanDetection& bad) {
    const auto person = PlaceInCamera(bad, TestCamera(), {});
    ASSERT_FALSE(person.ok());
    EXPECT_EQ(ReasonOf(person.status()), Reason::kFieldInvalid);
    EXPECT_NE(std::string(person.status().message()).find("detection 7"), std::string::npos);
  };
  HumanDetection behind = detection;
  behind.pelvis_camera = Eigen::Vector3d(0, 0, -2);
  expect_refused(behind);
  behind.pelvis_camera = Eigen::Vector3d(0, 0, NAN);
  expect_refused(behind);
  HumanDetection mirrored = detection;
  for (auto& joint : mirrored.joints_root) joint = -joint;
  expect_refused(mirrored);
  HumanDetection empty = detection;
  empty.has_joints = false;
  empty.weak_scale = 0.0;
  empty.box_px.setZero();
  expect_refused(empty);
}

TEST(Perspective, NeverCrashesOnNumbersOfAnyKind) {
  SCOPED_TRACE(testing::Message() << "seed " << kPerspectiveSeed);
  Random random(kPerspectiveSeed, 4);
  const double wild[] = {NAN, INFINITY, -INFINITY, 0.0, 1e300, -1e300, 1e-300, -5.0};
  const HumanDetection whole =
      PerfectDetection(TestCamera(), LookAlongX(1.2), Upright({4.0, 0.0, 0.93}, 0.0));
  for (int i = 0; i < 2000; ++i) {
    HumanDetection detection = whole;
    for (int k = 0; k < 4; ++k) {
      const double value = wild[random.Index(8)];
      const size_t joint = static_cast<size_t>(random.Index(kJointCount));
      switch (random.Index(7)) {
        case 0:
          detection.joints_root[joint][random.Index(3)] = value;
          break;
        case 1:
          detection.joints_px[joint][random.Index(2)] = value;
          break;
        case 2:
          detection.joint_visibility[joint] = value;
          break;
        case 3:
          detection.weak_scale = value;
          break;
        case 4:
          detection.box_px[random.Index(4)] = value;
          break;
        case 5:
          detection.pose_coefficients[0] = static_cast<float>(value);
          break;
        default:
          detection.joints_root.fill(Eigen::Vector3d::Constant(value));
          break;
      }
    }
    const auto person = PlaceInCamera(detection, TestCamera(), {});
    if (person.ok()) {
      EXPECT_TRUE(IsValidPose(person->camera_T_torso)) << i;
      EXPECT_TRUE(person->covariance_camera.allFinite()) << i;
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
