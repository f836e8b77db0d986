// SPDX-License-Identifier: Apache-2.0
// Noise, jitter and losses are as large and as frequent as asked.
#include "ingest/simulator/tracks/track_sensor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg::simulator {
namespace {

const AgentSpec kPerson = {"alice", false, 1};
const AgentSpec kRobot = {"robot", true, 0};

TEST(TrackSensor, AddsNoiseOfTheGivenDeviation) {
  TrackSensorOptions options;
  options.position_noise_m = 0.05;
  options.yaw_noise_rad = 0.02;
  TrackSensor sensor(options, kPerson, 1);
  const FloorPose truth{Point(3.0, 4.0), 3.13};
  const Pose3d true_pose = BodyPose(truth, false);
  constexpr int kCount = 50'000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double yaw_squares = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const Pose3d seen = sensor.Measure(truth);
    ASSERT_TRUE(IsValidPose(seen));
    const Eigen::Vector3d error = seen.position - true_pose.position;
    sum += error;
    squares += error.cwiseProduct(error);
    yaw_squares += std::pow(AngleBetween(seen.orientation, true_pose.orientation), 2);
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sum[axis] / kCount, 0.0, 0.001);
    EXPECT_NEAR(std::sqrt(squares[axis] / kCount), 0.05, 0.001);
  }
  EXPECT_NEAR(std::sqrt(yaw_squares / kCount), 0.02, 0.0005);
}

TEST(TrackSensor, StampsStrictlyGrowUnderAnyJitter) {
  for (const double jitter_s : {0.0, 0.0005, 1.0}) {
    TrackSensorOptions options;
    options.clock_jitter_s = jitter_s;
    TrackSensor sensor(options, kPerson, 2);
    TimeNs last = -1;
    double squares = 0.0;
    constexpr int kCount = 20'000;
    for (int tick = 0; tick < kCount; ++tick) {
      const TimeNs time_ns = sensor.SampleTime(tick);
      ASSERT_GT(time_ns, last) << "tick " << tick;
      last = time_ns;
      const double off_s = static_cast<double>(time_ns - tick * 100'000'000ll) * 1e-9;
      ASSERT_LE(std::abs(off_s), 0.04 + 1e-9);
      squares += off_s * off_s;
    }
    if (jitter_s < 0.01) {
      EXPECT_NEAR(std::sqrt(squares / kCount), jitter_s, 0.05 * jitter_s);
    }
  }
}

TEST(TrackSensor, LosesPeopleAsOftenAndAsLongAsAsked) {
  TrackSensorOptions options;
  options.gap_rate_per_min = 1.0;
  TrackSensor sensor(options, kPerson, 3);
  constexpr TimeNs kStep = 100'000'000;
  int64_t tracked = 0;
  int64_t run = 0;
  for (int64_t tick = 0; tick < 20'000'000; ++tick) {
    if (sensor.IsLost(tick * kStep)) {
      ++run;
      continue;
    }
    ++tracked;
    if (run > 0) {
      // Two losses in a row may look like one.
      EXPECT_GE(run, 29);
    }
    run = 0;
  }
  const double tracked_min = static_cast<double>(tracked) / 600.0;
  EXPECT_NEAR(static_cast<double>(sensor.loss_count()) / tracked_min, 1.0, 0.03);
  // 11.5 s lost on average after 60 s tracked on average.
  EXPECT_NEAR(static_cast<double>(tracked) / 20e6, 60.0 / 71.5, 0.01);
}

TEST(TrackSensor, NeverLosesTheRobotNorAnybodyAtRateZero) {
  TrackSensorOptions options;
  options.gap_rate_per_min = 60.0;
  TrackSensor robot(options, kRobot, 4);
  options.gap_rate_per_min = 0.0;
  TrackSensor person(options, kPerson, 4);
  for (TimeNs t = 0; t < 100'000 * kNsPerSecond; t += kNsPerSecond) {
    ASSERT_FALSE(robot.IsLost(t));
    ASSERT_FALSE(person.IsLost(t));
  }
}

TEST(TickCount, CountsWholeSamples) {
  EXPECT_EQ(TickCount(300.0, 10.0), 3000);
  EXPECT_EQ(TickCount(1.0, 0.1), 0);
  EXPECT_EQ(TickCount(0.3, 10.0), 3);
}

}  // namespace
}  // namespace dsg::simulator
