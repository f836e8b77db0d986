// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/visual_inertial_odometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "ingest/odometry/estimator/stereo_eye.h"
#include "tests/unit/ingest/odometry/estimator/textured_room.h"

namespace dsg::ingest {
namespace {

constexpr double kFrameS = 0.05;

const TexturedRoom& Room() {
  static const TexturedRoom* const room = new TexturedRoom();
  return *room;
}

struct Session {
  double seconds = 8.0;
  Carried carried;
  OdometryMethod method = OdometryMethod::kDynamic;
  // When the lens is covered, and when the unit says nothing.
  std::function<bool(double)> is_covered = [](double) { return false; };
  std::function<bool(double)> is_silent = [](double) { return false; };
  bool has_noise = true;
  // What the unit's driver makes of a sample.
  std::function<void(ImuMeasurement*)> spoil = [](ImuMeasurement*) {};
  OdometryOptions options;
};

struct Outcome {
  std::vector<OdometryPose> poses;
  OdometryCounts counts;
};

Outcome RunSession(Session session) {
  const RoomRig rig;
  session.options.method = session.method;
  auto eye = MakeStereoEye(rig.left, rig.right(), session.options.frontend.stereo);
  EXPECT_TRUE(eye.ok()) << eye.status();
  auto odometry = VisualInertialOdometry::Make((*eye)->camera(), rig.imu, session.options);
  EXPECT_TRUE(odometry.ok()) << odometry.status();
  Random random(7, 0);
  std::vector<ImuMeasurement> samples;
  const int sample_count = static_cast<int>(std::lround(200.0 * session.seconds));
  for (int i = 0; i <= sample_count; ++i) samples.push_back(session.carried.Measured(i / 200.0));
  ImuBias bias;
  if (session.has_noise) samples = Noisy(std::move(samples), rig.imu, &random, &bias);
  size_t next = 0;
  Outcome outcome;
  for (double t = kFrameS; t <= session.seconds; t += kFrameS) {
    const TimeNs time_ns = std::llround(1e9 * t);
    while (next < samples.size() && samples[next].time_ns <= time_ns) {
      if (!session.is_silent(1e-9 * static_cast<double>(samples[next].time_ns))) {
        session.spoil(&samples[next]);
        odometry->AddSample(samples[next]);
      }
      ++next;
    }
    if (!odometry->Covers(time_ns)) continue;
    const Pose3d map_T_imu = session.carried.At(t);
    const auto seen = [&](const CameraCalibration& camera) {
      if (session.is_covered(t)) {
        return PaintedImage(camera.width, camera.height, [](int, int) { return 12.0; });
      }
      return Room().Seen(camera, map_T_imu * camera.body_T_camera);
    };
    const ImageLoad load_right = [&]() -> absl::StatusOr<Image> { return seen(rig.right()); };
    auto frame = (*eye)->FrameOf(time_ns, seen(rig.left), load_right, {});
    EXPECT_TRUE(frame.ok()) << frame.status();
    auto poses = odometry->AddFrame(*frame);
    EXPECT_TRUE(poses.ok()) << poses.status();
    outcome.poses.insert(outcome.poses.end(), poses->begin(), poses->end());
  }
  outcome.counts = odometry->counts();
  return outcome;
}

// Errors against the truth, moved so that the first pose agrees in position and heading.
std::vector<double> ErrorsM(const Outcome& outcome, const Carried& carried) {
  std::vector<double> errors;
  const OdometryPose& first = outcome.poses.front();
  const auto truth_at = [&](const OdometryPose& pose) {
    return carried.At(1e-9 * static_cast<double>(pose.time_ns));
  };
  const Pose3d truth = truth_at(first);
  const Eigen::Matrix3d turn =
      (truth.orientation * first.map_T_body.orientation.conjugate()).toRotationMatrix();
  const double yaw = std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
  const Eigen::Quaterniond heading = RotationOf(yaw * Eigen::Vector3d::UnitZ());
  for (const OdometryPose& pose : outcome.poses) {
    const Eigen::Vector3d moved =
        heading * (pose.map_T_body.position - first.map_T_body.position) + truth.position;
    errors.push_back((moved - truth_at(pose).position).norm());
  }
  return errors;
}

double Largest(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

TEST(VisualInertialOdometry, StartsAtRestAndFollowsWithEachMethod) {
  for (const auto method :
       {OdometryMethod::kFivePoint, OdometryMethod::kTwoPoint, OdometryMethod::kDynamic}) {
    Session session;
    session.method = method;
    const Outcome outcome = RunSession(session);
    ASSERT_FALSE(outcome.poses.empty());
    EXPECT_EQ(outcome.counts.starts_at_rest, 1);
    EXPECT_EQ(outcome.counts.starts_in_motion, 0);
    EXPECT_TRUE(outcome.counts.losses.empty());
    EXPECT_LT(outcome.poses.front().time_ns, 1'500'000'000);
    const double error_m = Largest(ErrorsM(outcome, session.carried));
    std::cout << "method " << static_cast<int>(method) << ": largest error " << error_m << " m, "
              << outcome.counts.keyframes << " keyframes\n";
    EXPECT_LT(error_m, 0.05);
  }
}

TEST(VisualInertialOdometry, StartsInMotionAndTellsThePosesBefore) {
  Session session;
  session.carried.rest_s = -3.0;
  const Outcome outcome = RunSession(session);
  ASSERT_FALSE(outcome.poses.empty());
  EXPECT_EQ(outcome.counts.starts_in_motion, 1);
  EXPECT_EQ(outcome.counts.starts_at_rest, 0);
  EXPECT_LT(outcome.poses.front().time_ns, 500'000'000);
  EXPECT_GT(outcome.poses.size(), 145u);
  const double error_m = Largest(ErrorsM(outcome, session.carried));
  std::cout << "in motion: largest error " << error_m << " m\n";
  EXPECT_LT(error_m, 0.08);
}

TEST(VisualInertialOdometry, PosesAscend) {
  Session session;
  session.carried.rest_s = -3.0;
  session.seconds = 4.0;
  const Outcome outcome = RunSession(session);
  for (size_t i = 1; i < outcome.poses.size(); ++i) {
    EXPECT_LT(outcome.poses[i - 1].time_ns, outcome.poses[i].time_ns);
  }
}

TEST(VisualInertialOdometry, LeadsOnWhileTheLensIsCoveredForASecond) {
  Session session;
  session.is_covered = [](double t) { return t > 4.0 && t < 5.0; };
  const Outcome outcome = RunSession(session);
  ASSERT_FALSE(outcome.poses.empty());
  EXPECT_TRUE(outcome.counts.losses.empty());
  EXPECT_LT(Largest(ErrorsM(outcome, session.carried)), 0.25);
}

TEST(VisualInertialOdometry, IsLostWhileTheLensIsCoveredForLongAndStartsAnew) {
  Session session;
  session.seconds = 15.0;
  session.is_covered = [](double t) { return t > 4.0 && t < 9.0; };
  const Outcome outcome = RunSession(session);
  ASSERT_FALSE(outcome.poses.empty());
  EXPECT_EQ(outcome.counts.losses.at("blind"), 1);
  EXPECT_EQ(outcome.counts.starts_at_rest + outcome.counts.starts_in_motion, 2);
  // Nothing is told while nothing is known.
  for (const OdometryPose& pose : outcome.poses) {
    EXPECT_FALSE(pose.time_ns > 7'000'000'000 && pose.time_ns < 8'900'000'000) << pose.time_ns;
  }
  // Then it is as unsure as it may be.
  EXPECT_GT(outcome.poses.back().covariance(0, 0), 1.0);
  EXPECT_GT(outcome.poses.back().time_ns, 14'900'000'000);
}

TEST(VisualInertialOdometry, StartsAnewAfterAGapOfTheUnit) {
  Session session;
  session.seconds = 10.0;
  session.is_silent = [](double t) { return t > 4.0 && t < 4.5; };
  const Outcome outcome = RunSession(session);
  EXPECT_EQ(outcome.counts.losses.at("inertial gap"), 1);
  EXPECT_GT(outcome.poses.back().time_ns, 9'900'000'000);
  EXPECT_EQ(outcome.counts.starts_at_rest + outcome.counts.starts_in_motion, 2);
}

TEST(VisualInertialOdometry, SaysWhatIsWrongWithTheSamples) {
  struct Fault {
    std::function<void(ImuMeasurement*)> spoil;
    std::string text;
  };
  const std::vector<Fault> faults = {
      {[](ImuMeasurement* sample) { sample->acceleration_m_s2 /= 9.80665; }, "look like g"},
      {[](ImuMeasurement* sample) { sample->acceleration_m_s2 *= 1000.0 / 9.80665; },
       "look like mg"},
      {[](ImuMeasurement* sample) { sample->angular_velocity_rad_s *= 180.0 / M_PI; }, "deg"},
      {[](ImuMeasurement* sample) {
         std::swap(sample->angular_velocity_rad_s.x(), sample->angular_velocity_rad_s.z());
       },
       "axes"},
      {[](ImuMeasurement* sample) { sample->angular_velocity_rad_s *= -1.0; }, "axes"}};
  for (const Fault& fault : faults) {
    Session session;
    session.carried.rest_s = -3.0;
    session.spoil = fault.spoil;
    const Outcome outcome = RunSession(session);
    EXPECT_TRUE(outcome.poses.empty());
    EXPECT_THAT(outcome.counts.failed_start + outcome.counts.gyro_fault,
                testing::HasSubstr(fault.text));
  }
}

TEST(VisualInertialOdometry, GivesTheSamePosesTwice) {
  Session session;
  session.seconds = 4.0;
  const Outcome a = RunSession(session);
  const Outcome b = RunSession(session);
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(StepBetween(a.poses[i].map_T_body, b.poses[i].map_T_body).norm(), 0.0);
  }
}

TEST(VisualInertialOdometry, LeavesOutSamplesThatNoUnitMeasures) {
  const auto with = [](double spike) {
    Session session;
    session.seconds = 4.0;
    session.spoil = [spike](ImuMeasurement* sample) {
      if (sample->time_ns == 3'000'000'000) sample->acceleration_m_s2.x() += spike;
    };
    return Largest(ErrorsM(RunSession(session), session.carried));
  };
  EXPECT_LT(with(1e6), 0.05);
  EXPECT_LT(with(std::numeric_limits<double>::infinity()), 0.05);
}

// Wrong samples from the fourth second on.
struct UnitFault {
  std::string name;
  std::function<void(ImuMeasurement*)> spoil;
};

Outcome RunWithFault(const UnitFault& fault) {
  Session session;
  session.seconds = 10.0;
  session.spoil = [&](ImuMeasurement* sample) {
    if (sample->time_ns > 4'000'000'000 && sample->time_ns < 4'300'000'000) fault.spoil(sample);
  };
  return RunSession(session);
}

TEST(VisualInertialOdometry, IsLostWhereSamplesAreClippedOrStandStill) {
  ImuMeasurement still;
  const std::vector<UnitFault> faults = {
      {"clipped samples",
       [](ImuMeasurement* sample) { sample->angular_velocity_rad_s.z() = 4.36; }},
      {"samples that stand still", [&still](ImuMeasurement* sample) {
         if (still.time_ns == 0) still = *sample;
         sample->angular_velocity_rad_s = still.angular_velocity_rad_s;
         sample->acceleration_m_s2 = still.acceleration_m_s2;
       }}};
  for (const UnitFault& fault : faults) {
    const Outcome outcome = RunWithFault(fault);
    ASSERT_FALSE(outcome.poses.empty());
    EXPECT_TRUE(outcome.counts.losses.contains(fault.name))
        << fault.name << " of " << testing::PrintToString(outcome.counts.losses);
    EXPECT_EQ(outcome.counts.starts_at_rest + outcome.counts.starts_in_motion, 2);
    EXPECT_GT(outcome.poses.back().time_ns, 9'900'000'000);
    EXPECT_GT(outcome.poses.back().covariance(0, 0), 0.01) << fault.name;
  }
}

// Its values are the same while it rests.
TEST(VisualInertialOdometry, FollowsAUnitWithoutNoise) {
  Session session;
  session.has_noise = false;
  session.carried.rest_s = 3.0;
  const Outcome outcome = RunSession(session);
  ASSERT_FALSE(outcome.poses.empty());
  EXPECT_TRUE(outcome.counts.losses.empty()) << testing::PrintToString(outcome.counts.losses);
  EXPECT_LT(Largest(ErrorsM(outcome, session.carried)), 0.05);
}

TEST(VisualInertialOdometry, LearnsHowLateItsImagesAre) {
  Session session;
  session.spoil = [](ImuMeasurement* sample) { sample->time_ns += 15'000'000; };
  const Outcome outcome = RunSession(session);
  ASSERT_FALSE(outcome.poses.empty());
  EXPECT_NEAR(outcome.counts.image_late_s, 0.015, 2e-3);
  EXPECT_LT(Largest(ErrorsM(outcome, session.carried)), 0.1);
}

// It is wrong for some tenths of a second, and possible.
TEST(VisualInertialOdometry, DoubtsThePathWhereTheUnitTellsAnotherOne) {
  const std::vector<UnitFault> faults = {
      {"turns", [](ImuMeasurement* sample) { sample->angular_velocity_rad_s *= -6.0; }},
      {"forces", [](ImuMeasurement* sample) { sample->acceleration_m_s2.x() += 60.0; }}};
  for (const UnitFault& fault : faults) {
    const Outcome outcome = RunWithFault(fault);
    ASSERT_FALSE(outcome.poses.empty());
    EXPECT_GT(outcome.counts.doubts, 0) << fault.name;
    EXPECT_GT(outcome.poses.back().time_ns, 9'900'000'000);
    const std::vector<double> errors = ErrorsM(outcome, Carried());
    double worst = 0.0;
    for (size_t i = 0; i < errors.size(); ++i) {
      // Until a keyframe comes, nothing contradicts the unit.
      if (outcome.poses[i].time_ns < 4'700'000'000) continue;
      const double variance = outcome.poses[i].covariance.topLeftCorner<3, 3>().trace();
      worst = std::max(worst, errors[i] / std::sqrt(variance));
    }
    std::cout << fault.name << ": error at the end " << errors.back() << " m, largest " << worst
              << " standard deviations\n";
    EXPECT_LT(worst, 4.0) << fault.name;
  }
  EXPECT_EQ(RunWithFault({"none", [](ImuMeasurement*) {}}).counts.doubts, 0);
}

TEST(VisualInertialOdometry, RefusesImagesOutOfOrderAndOfOtherSizes) {
  const RoomRig rig;
  auto odometry = VisualInertialOdometry::Make({rig.left, rig.baseline_m}, rig.imu, {});
  ASSERT_TRUE(odometry.ok());
  OdometryFrame frame;
  frame.time_ns = 100;
  frame.left = PaintedImage(10, 10, [](int, int) { return 0.0; });
  EXPECT_EQ(odometry->AddFrame(frame).status().code(), absl::StatusCode::kInvalidArgument);
  frame.time_ns = 50;
  frame.left = PaintedImage(rig.left.width, rig.left.height, [](int, int) { return 0.0; });
  EXPECT_EQ(odometry->AddFrame(frame).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(odometry->AddSample({1, {NAN, 0, 0}, {0, 0, 9.81}}));
  EXPECT_TRUE(odometry->AddSample({1, {0, 0, 0}, {0, 0, 9.81}}));
  EXPECT_FALSE(odometry->AddSample({1, {0, 0, 0}, {0, 0, 9.81}}));
}

TEST(VisualInertialOdometry, RefusesAnUnknownMethod) {
  EXPECT_EQ(*ParseOdometryMethod("2pt"), OdometryMethod::kTwoPoint);
  EXPECT_FALSE(ParseOdometryMethod("3pt").ok());
}

}  // namespace
}  // namespace dsg::ingest
