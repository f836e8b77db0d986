// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/imu_samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "schema/base/status.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"

namespace dsg::ingest {
namespace {

constexpr TimeNs kGapNs = 50'000'000;

// Every 5 ms from 0 to 0.1 s.
std::vector<ImuMeasurement> Given() { return SwungSamples(0.1, 200.0); }

void ExpectRefused(const absl::Status& status, Reason reason,
                   const std::vector<std::string>& parts) {
  EXPECT_EQ(ReasonOf(status), reason) << status;
  for (const std::string& part : parts) {
    EXPECT_NE(std::string(status.message()).find(part), std::string::npos)
        << "no \"" << part << "\" in: " << status.message();
  }
}

TEST(CutSamples, InterpolatesAtBothEnds) {
  const std::vector<ImuMeasurement> samples = Given();
  const auto cut = CutSamples(samples, 6'000'000, 22'500'000, "imu0", kGapNs);
  ASSERT_TRUE(cut.ok()) << cut.status();
  ASSERT_EQ(cut->size(), 5u);
  EXPECT_EQ(cut->front().time_ns, 6'000'000);
  EXPECT_EQ((*cut)[1].time_ns, 10'000'000);
  EXPECT_EQ((*cut)[3].time_ns, 20'000'000);
  EXPECT_EQ(cut->back().time_ns, 22'500'000);
  const Eigen::Vector3d first =
      0.8 * samples[1].acceleration_m_s2 + 0.2 * samples[2].acceleration_m_s2;
  EXPECT_LT((cut->front().acceleration_m_s2 - first).norm(), 1e-14);
  const Eigen::Vector3d last =
      0.5 * (samples[4].angular_velocity_rad_s + samples[5].angular_velocity_rad_s);
  EXPECT_LT((cut->back().angular_velocity_rad_s - last).norm(), 1e-14);
}

TEST(CutSamples, TakesSamplesAtTheEndsAsTheyAre) {
  const std::vector<ImuMeasurement> samples = Given();
  const auto all = CutSamples(samples, 0, 100'000'000, "imu0", kGapNs);
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_EQ(all->size(), samples.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ((*all)[i].time_ns, samples[i].time_ns);
    EXPECT_EQ((*all)[i].acceleration_m_s2, samples[i].acceleration_m_s2);
  }
  // Within one step between two samples.
  const auto one = CutSamples(samples, 6'000'000, 7'000'000, "imu0", kGapNs);
  ASSERT_TRUE(one.ok()) << one.status();
  EXPECT_EQ(one->size(), 2u);
}

TEST(CutSamples, RefusesIntervalsThatAreNone) {
  for (const TimeNs to_ns : {TimeNs{5'000'000}, TimeNs{0}}) {
    ExpectRefused(CutSamples(Given(), 5'000'000, to_ns, "imu0", kGapNs).status(),
                  Reason::kTimeRangeInverted, {"imu0", "5000000", "later"});
  }
}

TEST(CutSamples, RefusesWhatIsNotCoveredYet) {
  ExpectRefused(CutSamples({}, 0, 1, "imu0", kGapNs).status(), Reason::kTimeOutsideTrack,
                {"0 samples"});
  ExpectRefused(CutSamples(Given(), -1, 50'000'000, "imu0", kGapNs).status(),
                Reason::kTimeOutsideTrack, {"imu0", "from 0 to 100000000", "-1 to 50000000"});
  ExpectRefused(CutSamples(Given(), 0, 100'000'001, "imu0", kGapNs).status(),
                Reason::kTimeOutsideTrack, {"100000001", "wait"});
}

TEST(CutSamples, RefusesRepeatsAndStepsBack) {
  std::vector<ImuMeasurement> samples = Given();
  samples[7].time_ns = samples[6].time_ns;
  ExpectRefused(CutSamples(samples, 0, 100'000'000, "imu0", kGapNs).status(), Reason::kFieldInvalid,
                {"imu0", "30000000", "ascend"});
  std::swap(samples[7], samples[9]);
  ExpectRefused(CutSamples(samples, 0, 100'000'000, "imu0", kGapNs).status(), Reason::kFieldInvalid,
                {"ascend"});
}

TEST(CutSamples, RefusesGapsAboveTheBound) {
  std::vector<ImuMeasurement> samples = Given();
  // 55 ms without a sample; 50 ms are bridged.
  samples.erase(samples.begin() + 5, samples.begin() + 15);
  ExpectRefused(CutSamples(samples, 0, 100'000'000, "imu0", kGapNs).status(), Reason::kFieldInvalid,
                {"20000000", "75000000", "50000000 ns can be bridged"});
  // Also when the interval ends within the gap, but not beside it.
  EXPECT_FALSE(CutSamples(samples, 0, 21'000'000, "imu0", kGapNs).ok());
  EXPECT_TRUE(CutSamples(samples, 0, 20'000'000, "imu0", kGapNs).ok());
  samples.insert(samples.begin() + 5, SwungSample(0.025));
  EXPECT_TRUE(CutSamples(samples, 0, 100'000'000, "imu0", kGapNs).ok());
}

TEST(CutSamples, RefusesWhatIsNotFiniteWhereItMatters) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    std::vector<ImuMeasurement> samples = Given();
    samples[10].acceleration_m_s2.y() = bad;
    ExpectRefused(CutSamples(samples, 0, 100'000'000, "imu0", kGapNs).status(),
                  Reason::kFieldInvalid, {"imu0", "50000000", "m/s^2"});
    samples = Given();
    samples[10].angular_velocity_rad_s.z() = bad;
    EXPECT_FALSE(CutSamples(samples, 0, 46'000'000, "imu0", kGapNs).ok());
    EXPECT_TRUE(CutSamples(samples, 0, 45'000'000, "imu0", kGapNs).ok());
    EXPECT_TRUE(CutSamples(samples, 55'000'000, 100'000'000, "imu0", kGapNs).ok());
  }
}

TEST(CutSamples, StampsAtTheLimitsOf64BitsAreAGap) {
  std::vector<ImuMeasurement> samples = Given();
  samples.front().time_ns = kTimeMin;
  samples.back().time_ns = kTimeMax;
  ExpectRefused(CutSamples(samples, 0, 50'000'000, "imu0", kGapNs).status(), Reason::kFieldInvalid,
                {"bridged"});
  EXPECT_NEAR(SecondsBetween(kTimeMin, kTimeMax), 1.8446744073709552e10, 1.0);
}

}  // namespace
}  // namespace dsg::ingest
