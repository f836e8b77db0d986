// SPDX-License-Identifier: Apache-2.0
// Detections err as the design says, by the same luck whatever else is in the log.
#include "ingest/simulator/body/detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ingest/simulator/body/gait.h"
#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

constexpr int kPeople = 40;

ingest::CameraCalibration TestCamera() {
  ingest::CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 720;
  camera.height = 480;
  camera.fx = 415.692;
  camera.fy = 415.692;
  camera.cx = 360.0;
  camera.cy = 240.0;
  return camera;
}

// At the origin, 1.2 m up, looking along x.
Pose3d CameraPose(const BodyView&) {
  Eigen::Matrix3d map_R_camera;
  map_R_camera.col(0) = -Eigen::Vector3d::UnitY();
  map_R_camera.col(1) = -Eigen::Vector3d::UnitZ();
  map_R_camera.col(2) = Eigen::Vector3d::UnitX();
  return {{0.0, 0.0, 1.2}, Eigen::Quaterniond(map_R_camera)};
}

BodyView MakeView(const BodyModel& body, int64_t frame, double depth_m, double visibility,
                  double yaw) {
  BodyView view;
  view.time_ns = frame * 200'000'000;
  view.frame = frame;
  view.person = static_cast<int>(frame % kPeople);
  view.visibility = visibility;
  view.state.map_T_torso.position = {depth_m, 0.1 * depth_m, body.pelvis_height_m()};
  view.state.map_T_torso.orientation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  view.state.pose = TrunkPosture(body, GaitState());
  PlantFeet(body, GaitState(), &view.state.pose);
  view.state.joints_map = body.Joints(view.state.pose);
  Eigen::AlignedBox2d box;
  const Pose3d camera_T_map = CameraPose(view).Inverse();
  for (Eigen::Vector3d& joint : view.state.joints_map) {
    joint = view.state.map_T_torso * joint;
    box.extend(ingest::Project(TestCamera(), camera_T_map * joint));
  }
  view.box_px = {box.min().x(), box.min().y(), box.max().x(), box.max().y()};
  view.mask_instance = 7;
  return view;
}

// The mixture that the error model was made for: 58 % full, 22 % of 0.6 to 1, 12 % of 0.25 to 0.6,
// 8 % at the border. It leaves distances and the visibility at the border open: 2.5 to 11 m, and
// half a body at most.
std::vector<BodyView> Mixture(int count, double depth_factor) {
  const BodyModel body{ShapeCoefficients()};
  Random random(99, 0);
  std::vector<BodyView> views;
  for (int i = 0; i < count; ++i) {
    const double kind = random.Uniform();
    double visibility = 1.0;
    if (kind > 0.58) visibility = random.Uniform(0.6, 1.0);
    if (kind > 0.80) visibility = random.Uniform(0.25, 0.6);
    if (kind > 0.92) visibility = random.Uniform(0.08, 0.5);
    BodyView view = MakeView(body, i, depth_factor * random.Uniform(2.5, 11.0), visibility,
                             random.Uniform(-3.0, 3.0));
    // Boxes of near bodies leave the image; only those said to touch the border shall.
    view.box_px = view.box_px.cwiseMax(Eigen::Vector4d(10.0, 10.0, 10.0, 10.0))
                      .cwiseMin(Eigen::Vector4d(700.0, 460.0, 700.0, 460.0));
    if (kind > 0.92) view.box_px[0] = 1.0;
    view.touches_border = kind > 0.92;
    views.push_back(view);
  }
  return views;
}

DetectorResult Detect(const std::vector<BodyView>& views, const DetectorOptions& options,
                      uint64_t seed = 1) {
  return MakeDetections(views, CameraPose, TestCamera(),
                        std::vector<ShapeCoefficients>(kPeople, ShapeCoefficients()), seed,
                        options);
}

TEST(Detector, ErrsOnTheDesignsMixtureAsTheDesignSays) {
  DetectorOptions options;
  options.scale_outliers = false;
  const DetectorResult result = Detect(Mixture(8000, 1.0), options);
  SCOPED_TRACE(FormatDetectionStatistics(result.statistics));
  EXPECT_EQ(result.statistics.outlier_scale, 1.0);
  EXPECT_NEAR(result.statistics.raw.mean_m, 1.08, 0.12);
  EXPECT_NEAR(result.statistics.filtered.mean_m, 0.87, 0.12);
  // A heavy tail, as the paper's: most are far better than the mean.
  EXPECT_LT(result.statistics.raw.median_m, 0.7);
  EXPECT_GT(result.statistics.raw.std_m, 1.1);
  EXPECT_GT(result.statistics.raw.p99_m, 5.0);
  EXPECT_LT(result.statistics.raw.p99_m, 10.0);
}

TEST(Detector, ScalesTheOutlierRateUntilTheMeanIsThePapers) {
  for (const double depth_factor : {0.4, 0.7, 1.0}) {
    const DetectorResult result = Detect(Mixture(3000, depth_factor), {});
    SCOPED_TRACE(FormatDetectionStatistics(result.statistics));
    EXPECT_NEAR(result.statistics.raw.mean_m, 1.1, 0.1);
    EXPECT_FALSE(result.statistics.off_target);
    EXPECT_FALSE(result.statistics.low_statistics);
    if (depth_factor < 1.0) {
      EXPECT_GT(result.statistics.outlier_scale, 1.0);
    }
  }
}

TEST(Detector, BodiesChangeNothingElseAndErrAsJointsDo) {
  const std::vector<BodyView> views = Mixture(300, 1.0);
  DetectorOptions with;
  with.has_bodies = true;
  const DetectorResult a = Detect(views, {});
  const DetectorResult b = Detect(views, with);
  ASSERT_EQ(a.outputs.size(), b.outputs.size());
  double joint_sum_m = 0.0;
  for (size_t i = 0; i < a.outputs.size(); ++i) {
    const ingest::HumanDetection& detection = b.outputs[i].detection;
    EXPECT_EQ(a.outputs[i].detection.joints_root, detection.joints_root);
    EXPECT_FALSE(a.outputs[i].body.has_value());
    ASSERT_TRUE(b.outputs[i].body.has_value());
    const BodyView& view = views[static_cast<size_t>(detection.time_ns / 200'000'000)];
    const Pose3d camera_T_map = CameraPose(view).Inverse();
    for (int j = 0; j < ingest::kJointCount; ++j) {
      const Eigen::Vector3d true_root =
          camera_T_map.orientation * (view.state.joints_map[j] - view.state.joints_map[0]);
      joint_sum_m += (detection.joints_root[j] - true_root).norm() / ingest::kJointCount;
    }
  }
  EXPECT_EQ(a.statistics.skin.count, 0);
  EXPECT_EQ(b.statistics.skin.count, static_cast<int>(b.outputs.size()));
  // Vertices are between joints, whose errors cancel in part.
  const double joint_m = joint_sum_m / static_cast<double>(b.outputs.size());
  EXPECT_LT(b.statistics.skin.mean_m, joint_m);
  EXPECT_GT(b.statistics.skin.mean_m, 0.5 * joint_m);
}

TEST(Detector, SaysSoWhenNoOutlierRateHelps) {
  const DetectorResult far = Detect(Mixture(1000, 3.0), {});
  EXPECT_EQ(far.statistics.outlier_scale, 0.0);
  EXPECT_TRUE(far.statistics.off_target);
  const DetectorResult few = Detect(Mixture(50, 1.0), {});
  EXPECT_TRUE(few.statistics.low_statistics);
  EXPECT_EQ(Detect({}, {}).outputs.size(), 0u);
}

TEST(Detector, ScalingChangesOnlyWhichDetectionsAreOutliers) {
  const std::vector<BodyView> views = Mixture(1000, 0.5);
  DetectorOptions plain;
  plain.scale_outliers = false;
  const DetectorResult a = Detect(views, plain);
  const DetectorResult b = Detect(views, {});
  ASSERT_EQ(a.outputs.size(), b.outputs.size());
  int moved = 0;
  for (size_t i = 0; i < a.outputs.size(); ++i) {
    EXPECT_EQ(a.outputs[i].detection.joints_root, b.outputs[i].detection.joints_root);
    EXPECT_EQ(a.outputs[i].detection.shape_coefficients, b.outputs[i].detection.shape_coefficients);
    moved += a.outputs[i].truth.detected_torso_map != b.outputs[i].truth.detected_torso_map;
  }
  EXPECT_GT(moved, 50);
  EXPECT_LT(moved, 500);
}

TEST(Detector, PixelsAndWeakCameraAgreeWithTheDetectedBody) {
  const ingest::CameraCalibration camera = TestCamera();
  const DetectorResult result = Detect(Mixture(500, 1.0), {});
  double squares = 0.0;
  int count = 0;
  for (const DetectionOutput& output : result.outputs) {
    const ingest::HumanDetection& detection = output.detection;
    const Eigen::Vector3d torso =
        CameraPose(BodyView()).Inverse() * output.truth.detected_torso_map;
    EXPECT_EQ(detection.joints_root[0], Eigen::Vector3d::Zero());
    for (int j = 0; j < ingest::kJointCount; ++j) {
      const Eigen::Vector3d at = torso + detection.joints_root[j];
      if (at.z() < 0.5) continue;
      squares += (ingest::Project(camera, at) - detection.joints_px[j]).squaredNorm();
      count += 2;
    }
    const double tz = 2.0 * camera.fx / (detection.weak_scale * detection.crop_px);
    EXPECT_NEAR(tz, torso.z(), 1e-6);
    const Eigen::Vector2d px = detection.crop_center_px + detection.weak_scale *
                                                              detection.weak_translation *
                                                              detection.crop_px / 2.0;
    EXPECT_LT((px - ingest::Project(camera, torso)).norm(), 1e-6);
  }
  EXPECT_NEAR(std::sqrt(squares / count), 1.0, 0.05);
}

TEST(Detector, DetectedBodiesKeepAPersonsSize) {
  const DetectorResult result = Detect(Mixture(500, 1.0), {});
  for (const DetectionOutput& output : result.outputs) {
    if (output.truth.visibility < 0.99) continue;
    const double tall =
        (output.detection.joints_root[15] - output.detection.joints_root[10]).norm();
    EXPECT_NEAR(tall, 1.52, 0.3);
  }
}

TEST(Detector, PoseCoefficientsTurnTheBodyTheWayItStands) {
  DetectorOptions options;
  options.scale_outliers = false;
  const BodyModel body{ShapeCoefficients()};
  std::vector<BodyView> views;
  for (int i = 0; i < 200; ++i) views.push_back(MakeView(body, i, 5.0, 1.0, 0.03 * i));
  const DetectorResult result = Detect(views, options);
  ASSERT_EQ(result.outputs.size(), 200u);
  for (size_t i = 0; i < result.outputs.size(); ++i) {
    const ingest::HumanDetection& detection = result.outputs[i].detection;
    ASSERT_EQ(detection.pose_coefficients.size(), 72u);
    ASSERT_EQ(detection.shape_coefficients.size(), 10u);
    Posture posture;
    for (int j = 0; j < ingest::kJointCount; ++j) {
      const Eigen::Vector3d turn(detection.pose_coefficients[3 * j],
                                 detection.pose_coefficients[3 * j + 1],
                                 detection.pose_coefficients[3 * j + 2]);
      posture.rotations[j] = Eigen::AngleAxisd(turn.norm(), turn.normalized());
    }
    const auto joints = body.Joints(posture);
    double sum = 0.0;
    for (int j = 0; j < ingest::kJointCount; ++j) {
      sum += (joints[j] - detection.joints_root[j]).norm();
    }
    EXPECT_LT(sum / ingest::kJointCount, 0.25);
  }
}

TEST(Detector, SkipsHiddenAndTinyBodies) {
  const BodyModel body{ShapeCoefficients()};
  std::vector<BodyView> views = {MakeView(body, 0, 5.0, 0.02, 0.0),
                                 MakeView(body, 1, 5.0, 0.5, 0.0),
                                 MakeView(body, 2, 5.0, 1.0, 0.0)};
  views[2].box_px = {100.0, 100.0, 106.0, 109.0};
  const DetectorResult result = Detect(views, {});
  ASSERT_EQ(result.outputs.size(), 1u);
  EXPECT_EQ(result.outputs[0].truth.human, 1);
  EXPECT_EQ(result.outputs[0].detection.mask_instance, 7);
  EXPECT_EQ(result.statistics.dropped_view_count, 2);
}

TEST(Detector, IsTheSameInAnyOrderOfViews) {
  std::vector<BodyView> views = Mixture(300, 1.0);
  const DetectorResult a = Detect(views, {});
  std::reverse(views.begin(), views.end());
  const DetectorResult b = Detect(views, {});
  ASSERT_EQ(a.outputs.size(), b.outputs.size());
  for (size_t i = 0; i < a.outputs.size(); ++i) {
    EXPECT_EQ(a.outputs[i].detection.id, static_cast<int64_t>(i) + 1);
    EXPECT_EQ(b.outputs[i].detection.id, static_cast<int64_t>(i) + 1);
    EXPECT_EQ(a.outputs[i].detection.joints_px, b.outputs[i].detection.joints_px);
    EXPECT_EQ(a.outputs[i].truth.detected_torso_map, b.outputs[i].truth.detected_torso_map);
  }
  const DetectorResult other = Detect(views, {}, 2);
  EXPECT_NE(a.outputs[0].detection.joints_px, other.outputs[0].detection.joints_px);
}

TEST(Detector, FalsePositivesBelongToNobody) {
  DetectorOptions options;
  options.false_positive_rate = 0.3;
  const DetectorResult result = Detect(Mixture(500, 1.0), options);
  const int count = result.statistics.false_positive_count;
  EXPECT_NEAR(count, 150, 50);
  EXPECT_EQ(result.statistics.raw.count + count, static_cast<int>(result.outputs.size()));
  for (size_t i = 1; i < result.outputs.size(); ++i) {
    const DetectionOutput& output = result.outputs[i];
    EXPECT_LE(result.outputs[i - 1].detection.time_ns, output.detection.time_ns);
    EXPECT_EQ(output.detection.id, output.truth.id);
    EXPECT_GT(output.detection.box_px[2], output.detection.box_px[0]);
  }
}

}  // namespace
}  // namespace dsg::simulator
