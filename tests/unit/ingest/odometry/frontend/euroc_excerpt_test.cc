// SPDX-License-Identifier: Apache-2.0
// The front-end on eight seconds of EuRoC's MH_01 beside their ground truth. Figures are printed;
// bounds are what the data's README allows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "ingest/depth/stereo.h"
#include "ingest/log/log_source.h"
#include "ingest/odometry/frontend/feature_tracker.h"
#include "ingest/odometry/frontend/image_rectifier.h"
#include "ingest/odometry/frontend/relative_pose.h"
#include "ingest/odometry/frontend/stereo_match.h"
#include "ingest/odometry/frontend/stereo_pose.h"
#include "ingest/sensor/pinhole.h"
#include "ingest/trajectory/robot_path.h"

namespace dsg::ingest {
namespace {

std::filesystem::path ExcerptFolder() {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  return folder / "euroc-mh01-stereo";
}

// Images 0.2 s apart are keyframes.
constexpr int kImagesOfKeyframe = 4;

struct RectifiedShot {
  TimeNs time_ns = 0;
  Image left;
  Image right;
  // As the cameras took them.
  Image raw_left;
  Image raw_right;
};

struct Excerpt {
  CameraCalibration left;
  CameraCalibration right;
  RectifiedPair pair;
  std::vector<uint8_t> unseen;
  std::vector<RectifiedShot> shots;
  RobotPath path;

  // Of the rectified left camera in that of another time; ground truth.
  Pose3d Between(TimeNs from_ns, TimeNs to_ns) const {
    Pose3d map_T_from;
    Pose3d map_T_to;
    EXPECT_EQ(path.At(from_ns, &map_T_from), RobotPath::Answer::kKnown);
    EXPECT_EQ(path.At(to_ns, &map_T_to), RobotPath::Answer::kKnown);
    const Pose3d& body_T_camera = pair.left.body_T_camera;
    return body_T_camera.Inverse() * map_T_from.Inverse() * map_T_to * body_T_camera;
  }
};

class EurocExcerpt : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(ExcerptFolder())) {
      GTEST_SKIP() << "the real data is not there; set DSG_DATA";
    }
    ReadImages();
  }

  void ReadImages() {
    absl::StatusOr<std::unique_ptr<LogSource>> log = OpenLog(ExcerptFolder().string(), {});
    ASSERT_TRUE(log.ok()) << log.status();
    const RigCalibration rig = (*log)->info().rig;
    const CameraCalibration* const left = rig.FindCamera("cam0");
    const CameraCalibration* const right = rig.FindCamera("cam1");
    ASSERT_TRUE(left != nullptr && right != nullptr);
    absl::StatusOr<RectifiedPair> pair = RectifiedPair::Make(*left, *right);
    ASSERT_TRUE(pair.ok()) << pair.status();
    excerpt_.pair = *pair;
    excerpt_.left = *left;
    excerpt_.right = *right;
    const ImageRectifier left_rectifier(pair->left, *left);
    const ImageRectifier right_rectifier(pair->right, *right);
    excerpt_.unseen = left_rectifier.unseen();
    std::map<TimeNs, RectifiedShot> shots;
    for (;;) {
      absl::StatusOr<std::optional<Measurement>> next = (*log)->Next();
      ASSERT_TRUE(next.ok()) << next.status();
      if (!next->has_value()) break;
      if (const auto* pose = std::get_if<PoseMeasurement>(&**next)) {
        excerpt_.path.Add(pose->pose);
      } else if (const auto* image = std::get_if<ImageMeasurement>(&**next)) {
        const bool is_left = image->channel == "cam0";
        absl::StatusOr<Image> loaded = image->load();
        ASSERT_TRUE(loaded.ok()) << loaded.status();
        absl::StatusOr<Image> rectified =
            (is_left ? left_rectifier : right_rectifier).Apply(*loaded);
        ASSERT_TRUE(rectified.ok()) << rectified.status();
        RectifiedShot& shot = shots[image->time_ns];
        shot.time_ns = image->time_ns;
        (is_left ? shot.left : shot.right) = *std::move(rectified);
        (is_left ? shot.raw_left : shot.raw_right) = *std::move(loaded);
      }
    }
    for (auto& [time_ns, shot] : shots) excerpt_.shots.push_back(std::move(shot));
    ASSERT_EQ(excerpt_.shots.size(), 160u);
  }

  Excerpt excerpt_;
};

double MedianOf(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double DegreesOff(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / M_PI;
}

std::vector<Eigen::Vector2d> PixelsOfFeatures(const FeatureTracker& tracker) {
  std::vector<Eigen::Vector2d> pixels;
  for (const Feature& feature : tracker.features()) pixels.push_back(feature.pixel);
  return pixels;
}

// Beside semi-global matching of whole images, which knows nothing of features.
TEST_F(EurocExcerpt, FeaturesAreMatchedAlongTheRows) {
  auto tracker = FeatureTracker::Make(excerpt_.pair.left);
  const auto matcher = StereoMatcher::Make(excerpt_.pair);
  StereoOptions dense_options;
  dense_options.nearest_m = StereoMatchOptions().nearest_m;
  const auto dense =
      StereoDepth::Make(excerpt_.left, excerpt_.right, /*range_m=*/10.0, dense_options);
  ASSERT_TRUE(tracker.ok() && matcher.ok() && dense.ok());
  const double scale = excerpt_.pair.left.fx * std::abs(excerpt_.pair.baseline_m);
  size_t feature_count = 0;
  std::map<int, int> outcomes;
  std::vector<double> rows_px;
  std::vector<double> depths_m;
  std::vector<double> dense_m;
  std::vector<double> apart_px;
  for (size_t i = 0; i < excerpt_.shots.size(); i += 8) {
    const RectifiedShot& shot = excerpt_.shots[i];
    tracker->Reset();
    ASSERT_TRUE(tracker->Track(shot.left).ok());
    ASSERT_TRUE(tracker->Detect(excerpt_.unseen).ok());
    const auto matches = matcher->Match(shot.left, shot.right, PixelsOfFeatures(*tracker));
    const auto depth_m = dense->Compute(shot.raw_left, shot.raw_right);
    ASSERT_TRUE(matches.ok() && depth_m.ok());
    feature_count += matches->size();
    for (size_t k = 0; k < matches->size(); ++k) {
      const StereoMatch& match = (*matches)[k];
      const Eigen::Vector2d& pixel = tracker->features()[k].pixel;
      const double known_m =
          (*depth_m)[shot.left.Offset(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))];
      if (known_m > 0.0) dense_m.push_back(known_m);
      ++outcomes[static_cast<int>(match.outcome)];
      if (match.outcome != StereoOutcome::kMatched) continue;
      rows_px.push_back(std::abs(match.row_offset_px));
      depths_m.push_back(scale / match.disparity_px);
      if (known_m > 0.0) apart_px.push_back(std::abs(match.disparity_px - scale / known_m));
    }
  }
  const double share = static_cast<double>(depths_m.size()) / static_cast<double>(feature_count);
  const double near_share =
      static_cast<double>(std::count_if(apart_px.begin(), apart_px.end(),
                                        [](double apart) { return apart < 1.0; })) /
      static_cast<double>(apart_px.size());
  std::cout << "euroc: " << feature_count << " features of 20 pairs, matched " << share
            << ", median row offset " << MedianOf(rows_px) << " px, median depth "
            << MedianOf(depths_m) << " m; dense stereo knows " << dense_m.size()
            << " of them, median depth " << MedianOf(dense_m) << " m, and of " << apart_px.size()
            << " disparities " << near_share << " are within a pixel of it, outcomes "
            << testing::PrintToString(outcomes) << "\n";
  EXPECT_GT(feature_count, 20u * 120);
  // The rest lies along edges of the rows, repeats, or is dark.
  EXPECT_GT(share, 0.4);
  EXPECT_NEAR(MedianOf(depths_m), MedianOf(dense_m), 0.15);
  EXPECT_LT(MedianOf(rows_px), 0.4);
  EXPECT_GT(near_share, 0.9);
}

// What is learnt of one method at all keyframes.
struct MonoFigures {
  int found_count = 0;
  int none_count = 0;
  int other_count = 0;
  std::vector<double> inlier_shares;
  std::vector<double> way_errors_deg;
  std::vector<double> turn_errors_deg;
  int draw_count = 0;

  void Take(const MonoPose& pose, const Pose3d& truth, size_t pair_count) {
    draw_count += pose.draw_count;
    if (pose.outcome == PoseOutcome::kFound) {
      ++found_count;
    } else {
      ++(pose.outcome == PoseOutcome::kNoTranslation ? none_count : other_count);
      return;
    }
    inlier_shares.push_back(static_cast<double>(pose.inliers.size()) /
                            static_cast<double>(pair_count));
    way_errors_deg.push_back(DegreesOff(pose.first_T_second.position, truth.position));
    turn_errors_deg.push_back(AngleBetween(pose.first_T_second.orientation, truth.orientation) *
                              180.0 / M_PI);
  }

  void Print(const char* name) const {
    std::cout << "euroc " << name << ": found " << found_count << ", no translation " << none_count
              << ", other " << other_count << ", inliers " << MedianOf(inlier_shares)
              << ", translation off by " << MedianOf(way_errors_deg) << " degrees, rotation by "
              << MedianOf(turn_errors_deg) << ", samples " << draw_count << "\n";
  }
};

// Bearings of the features that two images have in common.
struct SharedFeatures {
  std::map<int64_t, Eigen::Vector2d> first;

  std::vector<BearingPair> PairsWith(const std::vector<Feature>& features,
                                     const CameraCalibration& camera) const {
    std::vector<BearingPair> pairs;
    for (const Feature& feature : features) {
      const auto before = first.find(feature.id);
      if (before == first.end()) continue;
      pairs.push_back({PinholeRay(camera, before->second.x(), before->second.y()).normalized(),
                       PinholeRay(camera, feature.pixel.x(), feature.pixel.y()).normalized()});
    }
    return pairs;
  }
};

TEST_F(EurocExcerpt, MotionBetweenKeyframesIsThatOfTheGroundTruth) {
  const CameraCalibration& camera = excerpt_.pair.left;
  auto tracker = FeatureTracker::Make(camera);
  ASSERT_TRUE(tracker.ok());
  MonoFigures five;
  MonoFigures two;
  SharedFeatures shared;
  std::vector<double> kept_shares;
  TimeNs keyframe_ns = 0;
  TimeNs last_ns = 0;
  for (size_t i = 0; i < excerpt_.shots.size(); ++i) {
    const RectifiedShot& shot = excerpt_.shots[i];
    const Pose3d last_T_now = i == 0 ? Pose3d() : excerpt_.Between(last_ns, shot.time_ns);
    last_ns = shot.time_ns;
    ASSERT_TRUE(tracker->Track(shot.left, last_T_now.orientation, excerpt_.unseen).ok());
    if (i % kImagesOfKeyframe != 0) continue;
    if (i > 0) {
      const Pose3d truth = excerpt_.Between(keyframe_ns, shot.time_ns);
      const std::vector<BearingPair> pairs = shared.PairsWith(tracker->features(), camera);
      kept_shares.push_back(static_cast<double>(pairs.size()) /
                            static_cast<double>(shared.first.size()));
      // The direction of a way of millimetres is not known to the ground truth either.
      if (truth.position.norm() > 0.02) {
        five.Take(FivePointPose(pairs, camera.fx), truth, pairs.size());
        two.Take(TwoPointPose(pairs, truth.orientation, camera.fx), truth, pairs.size());
      }
    }
    keyframe_ns = shot.time_ns;
    ASSERT_TRUE(tracker->Detect(excerpt_.unseen).ok());
    shared.first.clear();
    for (const Feature& feature : tracker->features()) shared.first[feature.id] = feature.pixel;
  }
  std::cout << "euroc: followed over 0.2 s " << MedianOf(kept_shares) << "\n";
  five.Print("5pt");
  two.Print("2pt");
  EXPECT_GT(MedianOf(kept_shares), 0.75);
  for (const MonoFigures* figures : {&five, &two}) {
    EXPECT_GT(figures->found_count, 20);
    EXPECT_EQ(figures->other_count, 0);
    EXPECT_GT(MedianOf(figures->inlier_shares), 0.85);
  }
  EXPECT_LT(MedianOf(five.turn_errors_deg), 0.3);
  EXPECT_LT(MedianOf(five.way_errors_deg), 6.0);
  EXPECT_LT(MedianOf(two.way_errors_deg), 4.0);
}

// Points of both pairs of two keyframes, and the motion of the rig in metres.
TEST_F(EurocExcerpt, MotionOfTheRigIsThatOfTheGroundTruth) {
  const CameraCalibration& camera = excerpt_.pair.left;
  auto tracker = FeatureTracker::Make(camera);
  const auto matcher = StereoMatcher::Make(excerpt_.pair);
  ASSERT_TRUE(tracker.ok() && matcher.ok());
  std::map<int64_t, StereoPoint> before;
  TimeNs keyframe_ns = 0;
  std::vector<double> three_errors_m;
  std::vector<double> one_errors_m;
  std::vector<double> ways_m;
  for (size_t i = 0; i < excerpt_.shots.size(); ++i) {
    const RectifiedShot& shot = excerpt_.shots[i];
    ASSERT_TRUE(tracker->Track(shot.left).ok());
    if (i % kImagesOfKeyframe != 0) continue;
    ASSERT_TRUE(tracker->Detect(excerpt_.unseen).ok());
    const auto matches = matcher->Match(shot.left, shot.right, PixelsOfFeatures(*tracker));
    ASSERT_TRUE(matches.ok());
    std::map<int64_t, StereoPoint> now;
    std::vector<StereoPointPair> pairs;
    for (size_t k = 0; k < matches->size(); ++k) {
      if ((*matches)[k].outcome != StereoOutcome::kMatched) continue;
      const Feature& feature = tracker->features()[k];
      now[feature.id] = StereoPointOf(camera, excerpt_.pair.baseline_m, feature.pixel,
                                      (*matches)[k].disparity_px);
      const auto found = before.find(feature.id);
      if (found != before.end()) pairs.push_back({found->second, now[feature.id]});
    }
    if (i > 0) {
      const Pose3d truth = excerpt_.Between(keyframe_ns, shot.time_ns);
      const StereoPose three = ThreePointPose(pairs);
      const StereoPose one = OnePointPose(pairs, truth.orientation);
      ASSERT_EQ(three.outcome, PoseOutcome::kFound) << i;
      ASSERT_EQ(one.outcome, PoseOutcome::kFound) << i;
      three_errors_m.push_back((three.first_T_second.position - truth.position).norm());
      one_errors_m.push_back((one.first_T_second.position - truth.position).norm());
      ways_m.push_back(truth.position.norm());
    }
    keyframe_ns = shot.time_ns;
    before = std::move(now);
  }
  std::cout << "euroc: ways of " << MedianOf(ways_m) << " m, 3pt off by "
            << MedianOf(three_errors_m) << " m, 1pt by " << MedianOf(one_errors_m) << " m\n";
  EXPECT_LT(MedianOf(three_errors_m), 0.015);
  EXPECT_LT(MedianOf(one_errors_m), 0.01);
}

}  // namespace
}  // namespace dsg::ingest
