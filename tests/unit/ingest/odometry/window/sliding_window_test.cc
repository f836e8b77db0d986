// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/sliding_window.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <optional>
#include <vector>

#include "tests/unit/ingest/odometry/window/swinging_rig.h"

namespace dsg::ingest {
namespace {

constexpr double kPeriodS = 0.2;

struct Passage {
  std::vector<InertialState> states;
  std::vector<Matrix15d> covariances;
  int dropped_count = 0;
  SlidingWindow window;
};

struct Noise {
  double pixel_px = 0.7;
  double disparity_px = 0.7;
  bool has_unit_noise = true;
  /// Of all disparities, which the calibration does not know of.
  double offset_px = 0.0;
  /// Of the features, so many in a hundred are followed wrongly, each keyframe anew.
  int wrong_percent = 0;
  /// Of the gyroscope, before the last keyframe alone.
  double turn_error_rad_s = 0.0;
  /// Of the images, after their stamps.
  double late_s = 0.0;
};

void Turn(TimeNs from_ns, double error_rad_s, std::vector<ImuMeasurement>* samples) {
  for (ImuMeasurement& sample : *samples) {
    if (sample.time_ns >= from_ns) sample.angular_velocity_rad_s.z() += error_rad_s;
  }
}

Passage PassageOf(double seconds, uint64_t seed, const Noise& noise, WindowOptions options = {}) {
  Random random(seed, 0);
  const StereoModel model = TestModel();
  const std::vector<Eigen::Vector3d> points = RoomPoints(700, &random);
  std::vector<ImuMeasurement> samples = SwungMeasurements(seconds + 0.1);
  ImuBias bias;
  if (noise.has_unit_noise) samples = Noisy(std::move(samples), Adis16448(), &random, &bias);
  Passage run{{}, {}, 0, SlidingWindow(model, kGravity, options)};
  const auto sights_at = [&](double t) {
    auto sights = SightsAt(model, SwungPose(t + noise.late_s), points, noise.pixel_px,
                           noise.disparity_px, &random);
    for (FeatureSight& sight : sights) {
      if (sight.sight.disparity_px.has_value()) *sight.sight.disparity_px += noise.offset_px;
      if (random.Uniform(0.0, 100.0) >= noise.wrong_percent) continue;
      sight.sight.pixel += Eigen::Vector2d(random.Uniform(-40, 40), random.Uniform(-40, 40));
    }
    return sights;
  };
  EXPECT_TRUE(run.window.Begin(0, BeginAt(0.0), sights_at(0.0)).ok());
  for (int i = 1; i * kPeriodS <= seconds; ++i) {
    const TimeNs from_ns = std::llround(1e9 * kPeriodS * (i - 1));
    const TimeNs to_ns = std::llround(1e9 * kPeriodS * i);
    if ((i + 1) * kPeriodS > seconds) Turn(from_ns, noise.turn_error_rad_s, &samples);
    auto measured = Preintegration::Make(samples, from_ns, to_ns, run.window.newest().bias,
                                         Adis16448(), InertialOptions());
    EXPECT_TRUE(measured.ok()) << measured.status();
    const absl::Status added = run.window.Add(to_ns, *std::move(measured), sights_at(i * kPeriodS));
    EXPECT_TRUE(added.ok()) << added;
    run.dropped_count += static_cast<int>(run.window.dropped_features().size());
    run.states.push_back(run.window.newest());
    const auto covariance = run.window.NewestCovariance();
    EXPECT_TRUE(covariance.ok()) << covariance.status();
    run.covariances.push_back(*covariance);
  }
  return run;
}

double EndErrorM(const Passage& run, double seconds) {
  return (run.states.back().map_T_imu.position - SwungPose(seconds).position).norm();
}

TEST(SlidingWindow, FollowsWithoutNoiseExactly) {
  const Passage run = PassageOf(6.0, 1, {0.0, 0.0, false, 0.0, 0});
  EXPECT_LT(EndErrorM(run, 6.0), 2e-3);
  EXPECT_LT(AngleBetween(run.states.back().map_T_imu.orientation, SwungPose(6.0).orientation),
            1e-3);
  EXPECT_EQ(run.dropped_count, 0);
  EXPECT_EQ(run.window.keyframe_count(), WindowOptions().keyframe_count);
}

TEST(SlidingWindow, TellsWhereItsLandmarksAre) {
  const Passage run = PassageOf(6.0, 1, {0.0, 0.0, false, 0.0, 0});
  Random random(1, 0);
  const std::vector<Eigen::Vector3d> points = RoomPoints(700, &random);
  std::map<int64_t, Eigen::Vector2d> pixels;
  for (const FeatureSight& sight :
       SightsAt(TestModel(), SwungPose(30 * kPeriodS), points, 0.0, 0.0, &random)) {
    pixels[sight.feature_id] = sight.sight.pixel;
  }
  const std::vector<SeenLandmark>& landmarks = run.window.landmarks();
  EXPECT_GT(landmarks.size(), 100u);
  size_t seen_count = 0;
  int most_sights = 0;
  for (size_t i = 0; i < landmarks.size(); ++i) {
    const SeenLandmark& landmark = landmarks[i];
    const auto index = static_cast<size_t>(landmark.feature_id);
    EXPECT_LT((landmark.position_odom - points[index]).norm(), 0.1) << landmark.feature_id;
    if (i > 0) {
      EXPECT_LT(landmarks[i - 1].feature_id, landmark.feature_id);
    }
    most_sights = std::max(most_sights, landmark.sight_count);
    const auto pixel = pixels.find(landmark.feature_id);
    ASSERT_EQ(landmark.pixel.has_value(), pixel != pixels.end());
    if (!landmark.pixel.has_value()) continue;
    ++seen_count;
    EXPECT_LT((*landmark.pixel - pixel->second).norm(), 1e-6);
  }
  EXPECT_GT(seen_count, 50u);
  EXPECT_LT(seen_count, landmarks.size());
  // Before the oldest keyframe left.
  EXPECT_EQ(most_sights, WindowOptions().keyframe_count + 1);
}

TEST(SlidingWindow, DriftsByCentimetresWithNoise) {
  std::vector<double> errors;
  for (uint64_t seed = 1; seed <= 5; ++seed)
    errors.push_back(EndErrorM(PassageOf(10.0, seed, {}), 10.0));
  std::sort(errors.begin(), errors.end());
  std::cout << "after 10 s: " << testing::PrintToString(errors) << " m\n";
  EXPECT_LT(errors[2], 0.03);
  EXPECT_LT(errors[4], 0.06);
}

// Position and heading are off by as much as the covariance says.
TEST(SlidingWindow, KnowsHowSureItIs) {
  WindowOptions options;
  options.pixel_sigma_px = 0.7;
  options.disparity_sigma_px = 0.7;
  double position_sum = 0.0;
  double turn_sum = 0.0;
  int count = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const Passage run = PassageOf(8.0, seed, {}, options);
    for (const size_t i : {19ul, 39ul}) {
      const double t = kPeriodS * static_cast<double>(i + 1);
      const Vector15d error = StepBetween(SwungState(t), run.states[i]);
      const auto share = [&](int row) {
        const Eigen::Vector3d part = error.segment<3>(row);
        return part.dot(run.covariances[i].block<3, 3>(row, row).inverse() * part) / 3.0;
      };
      position_sum += share(kPositionRow);
      turn_sum += share(kRotationRow);
      ++count;
    }
  }
  std::cout << "squared errors in units of the covariance: position " << position_sum / count
            << ", rotation " << turn_sum / count << "\n";
  // 60 numbers each, two by two dependent: 95 % within 0.55 and 1.6.
  EXPECT_GT(position_sum / count, 0.5);
  EXPECT_LT(position_sum / count, 1.8);
  EXPECT_GT(turn_sum / count, 0.5);
  EXPECT_LT(turn_sum / count, 1.8);
}

TEST(SlidingWindow, LearnsThatAllDisparitiesAreTooLarge) {
  const Passage passage = PassageOf(10.0, 2, {0.7, 0.7, true, 0.6, 0});
  EXPECT_NEAR(passage.window.calibration_error()[0], 0.6, 0.1);
  EXPECT_LT(EndErrorM(passage, 10.0), 0.05);
  // Without that it is worse.
  WindowOptions trusting;
  trusting.disparity_offset_px = 1e-3;
  trusting.baseline_share = 1e-4;
  const Passage trusted = PassageOf(10.0, 2, {0.7, 0.7, true, 0.6, 0}, trusting);
  EXPECT_GT(EndErrorM(trusted, 10.0), 2.0 * EndErrorM(passage, 10.0));
}

TEST(SlidingWindow, LearnsThatImagesAreLate) {
  for (const double late_s : {0.02, -0.01}) {
    Noise noise;
    noise.late_s = late_s;
    const Passage passage = PassageOf(10.0, 2, noise);
    EXPECT_NEAR(passage.window.calibration_error()[2], late_s, 1e-3);
    EXPECT_LT(EndErrorM(passage, 10.0), 0.05);
    // Without that it is worse.
    WindowOptions trusting;
    trusting.clock_s = 1e-6;
    EXPECT_GT(EndErrorM(PassageOf(10.0, 2, noise, trusting), 10.0), 1.5 * EndErrorM(passage, 10.0));
  }
}

TEST(SlidingWindow, DropsFeaturesThatAreFollowedWrongly) {
  const Passage run = PassageOf(8.0, 3, {0.7, 0.7, true, 0.0, 10});
  EXPECT_GT(run.dropped_count, 20);
  EXPECT_LT(EndErrorM(run, 8.0), 0.1);
}

TEST(SlidingWindow, TellsHowFarUnitAndImagesMissEachOther) {
  EXPECT_LT(PassageOf(6.0, 1, {}).window.misfit(), 1.5);
  Noise noise;
  noise.turn_error_rad_s = 1.0;
  EXPECT_GT(PassageOf(6.0, 1, noise).window.misfit(), 5.0);
}

TEST(SlidingWindow, LeadsOnByTheUnitAloneWhenNothingIsSeen) {
  const StereoModel model = TestModel();
  SlidingWindow window(model, kGravity, {});
  ASSERT_TRUE(window.Begin(0, BeginAt(0.0), {}).ok());
  const std::vector<ImuMeasurement> samples = SwungMeasurements(1.1);
  double sigma_before = 0.0;
  for (int i = 1; i <= 5; ++i) {
    auto measured = Preintegration::Make(samples, 200'000'000ll * (i - 1), 200'000'000ll * i, {},
                                         Adis16448(), InertialOptions());
    ASSERT_TRUE(measured.ok());
    ASSERT_TRUE(window.Add(200'000'000ll * i, *std::move(measured), {}).ok());
    const auto covariance = window.NewestCovariance();
    ASSERT_TRUE(covariance.ok());
    EXPECT_GT((*covariance)(0, 0), sigma_before);
    sigma_before = (*covariance)(0, 0);
  }
  EXPECT_LT((window.newest().map_T_imu.position - SwungPose(1.0).position).norm(), 1e-3);
}

struct ImagePassage {
  std::vector<Pose3d> poses;
  std::vector<Matrix6d> covariances;
};

// The same way without a unit; guesses are off by a hand's breadth and some degrees.
ImagePassage ImagePassageOf(double seconds, uint64_t seed, double noise_px) {
  Random random(seed, 1);
  const StereoModel model = TestModel();
  const std::vector<Eigen::Vector3d> points = RoomPoints(700, &random);
  WindowOptions options;
  if (noise_px > 0.0) options.pixel_sigma_px = options.disparity_sigma_px = noise_px;
  // As it is: nothing tells it.
  options.disparity_offset_px = 0.01;
  options.baseline_share = 1e-4;
  SlidingWindow window(model, kGravity, options);
  ImagePassage run;
  const auto sights_at = [&](double t) {
    return SightsAt(model, SwungPose(t), points, noise_px, noise_px, &random);
  };
  const Matrix6d sure = 1e-8 * Matrix6d::Identity();
  EXPECT_TRUE(window.BeginByImages(0, SwungPose(0.0), sure, sights_at(0.0)).ok());
  for (int i = 1; i * kPeriodS <= seconds; ++i) {
    const Pose3d truth = SwungPose(i * kPeriodS);
    Vector6d off;
    off << NormalVector(0.05, &random), NormalVector(0.03, &random);
    const absl::Status added = window.AddByImages(std::llround(1e9 * kPeriodS * i),
                                                  Stepped(truth, off), sights_at(i * kPeriodS));
    EXPECT_TRUE(added.ok()) << added;
    run.poses.push_back(window.newest().map_T_imu);
    const auto covariance = window.NewestPoseCovariance();
    EXPECT_TRUE(covariance.ok()) << covariance.status();
    run.covariances.push_back(*covariance);
  }
  return run;
}

TEST(SlidingWindow, FollowsByImagesAlone) {
  const ImagePassage exact = ImagePassageOf(6.0, 1, 0.0);
  EXPECT_LT(StepBetween(SwungPose(6.0), exact.poses.back()).norm(), 2e-3);
  std::vector<double> errors;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    errors.push_back(
        (ImagePassageOf(10.0, seed, 0.7).poses.back().position - SwungPose(10.0).position).norm());
  }
  std::sort(errors.begin(), errors.end());
  std::cout << "by images, after 10 s: " << testing::PrintToString(errors) << " m\n";
  EXPECT_LT(errors[2], 0.03);
  EXPECT_LT(errors[4], 0.06);
}

TEST(SlidingWindow, KnowsHowSureImagesAreOfThePose) {
  double sum = 0.0;
  int count = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const ImagePassage run = ImagePassageOf(8.0, seed, 0.7);
    for (const size_t i : {19ul, 39ul}) {
      const Vector6d error =
          StepBetween(SwungPose(kPeriodS * static_cast<double>(i + 1)), run.poses[i]);
      sum += error.dot(run.covariances[i].inverse() * error) / 6.0;
      ++count;
    }
  }
  std::cout << "by images: squared errors in units of the covariance: " << sum / count << "\n";
  EXPECT_GT(sum / count, 0.5);
  EXPECT_LT(sum / count, 1.8);
}

TEST(SlidingWindow, TellsWhereLandmarksAre) {
  Random random(1, 0);
  const StereoModel model = TestModel();
  const std::vector<Eigen::Vector3d> points = RoomPoints(200, &random);
  SlidingWindow window(model, kGravity, {});
  const auto sights = SightsAt(model, SwungPose(0.0), points, 0.0, 0.0, &random);
  ASSERT_TRUE(window.BeginByImages(0, SwungPose(0.0), 1e-8 * Matrix6d::Identity(), sights).ok());
  for (const FeatureSight& sight : sights) {
    const std::optional<Eigen::Vector3d> point = window.PointOf(sight.feature_id);
    ASSERT_EQ(point.has_value(), sight.sight.disparity_px.has_value());
    if (!point.has_value()) continue;
    EXPECT_LT((*point - points[static_cast<size_t>(sight.feature_id)]).norm(), 1e-6);
  }
  EXPECT_FALSE(window.PointOf(1000).has_value());
}

TEST(SlidingWindow, DoesNotMixKeyframesWithAndWithoutAUnit) {
  SlidingWindow window(TestModel(), kGravity, {});
  EXPECT_FALSE(window.AddByImages(1, Pose3d(), {}).ok());
  EXPECT_FALSE(window.BeginByImages(0, Pose3d(), Matrix6d::Zero(), {}).ok());
  ASSERT_TRUE(window.BeginByImages(0, Pose3d(), Matrix6d::Identity(), {}).ok());
  const std::vector<ImuMeasurement> samples = SwungMeasurements(1.0);
  const auto measured =
      Preintegration::Make(samples, 0, 200'000'000, {}, Adis16448(), InertialOptions());
  ASSERT_TRUE(measured.ok());
  EXPECT_FALSE(window.Add(200'000'000, *measured, {}).ok());
  ASSERT_TRUE(window.Begin(0, BeginAt(0.0), {}).ok());
  EXPECT_FALSE(window.AddByImages(200'000'000, Pose3d(), {}).ok());
  EXPECT_TRUE(window.Add(200'000'000, *measured, {}).ok());
}

TEST(SlidingWindow, GivesTheSameNumbersTwice) {
  const Passage a = PassageOf(4.0, 5, {});
  const Passage b = PassageOf(4.0, 5, {});
  for (size_t i = 0; i < a.states.size(); ++i) {
    EXPECT_EQ(StepBetween(a.states[i], b.states[i]).norm(), 0.0);
  }
}

TEST(SlidingWindow, RefusesSamplesOfOtherTimes) {
  SlidingWindow window(TestModel(), kGravity, {});
  const std::vector<ImuMeasurement> samples = SwungMeasurements(1.0);
  const auto measured =
      Preintegration::Make(samples, 0, 200'000'000, {}, Adis16448(), InertialOptions());
  ASSERT_TRUE(measured.ok());
  EXPECT_FALSE(window.Add(200'000'000, *measured, {}).ok());
  ASSERT_TRUE(window.Begin(0, BeginAt(0.0), {}).ok());
  EXPECT_FALSE(window.Add(300'000'000, *measured, {}).ok());
  EXPECT_TRUE(window.Add(200'000'000, *measured, {}).ok());
}

TEST(SlidingWindow, RefusesACovarianceThatIsNone) {
  SlidingWindow window(TestModel(), kGravity, {});
  AlignedState aligned = BeginAt(0.0);
  aligned.covariance(3, 3) = -1.0;
  EXPECT_FALSE(window.Begin(0, aligned, {}).ok());
}

}  // namespace
}  // namespace dsg::ingest
