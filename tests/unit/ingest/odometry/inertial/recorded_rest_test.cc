// SPDX-License-Identifier: Apache-2.0
// Standing still, told apart in recorded samples (EuRoC): V1_02 stands on the floor with its motors
// running before it flies, MH_01 is carried about.
#include <gtest/gtest.h>

#include <algorithm>

#include "ingest/odometry/inertial/alignment.h"
#include "schema/model/rotation.h"
#include "tests/unit/ingest/odometry/inertial/euroc_tables.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"

namespace dsg::ingest {
namespace {

// Of the second that begins with a sample.
absl::StatusOr<AlignedState> AlignedSecond(const EurocTables& log, size_t first) {
  return AlignAtRest(std::span(log.samples).subspan(first, 201), Adis16448(), 0.0, {});
}

TEST(RecordedRest, IsFoundBeforeAndAfterTheFlight) {
  const EurocTables log = ReadEuroc("euroc-imu-groundtruth/V1_02_medium");
  if (log.samples.empty()) GTEST_SKIP() << "the recorded samples are not there; set DSG_DATA";
  for (const size_t first : {size_t{400}, log.samples.size() - 201}) {
    SCOPED_TRACE(testing::Message() << "from sample " << first);
    const auto aligned = AlignedSecond(log, first);
    ASSERT_TRUE(aligned.ok()) << aligned.status();
    const TimeNs middle_ns = log.samples[first + 100].time_ns;
    const auto near = std::min_element(
        log.truth.begin(), log.truth.end(), [middle_ns](const TrueState& a, const TrueState& b) {
          return std::abs(a.time_ns - middle_ns) < std::abs(b.time_ns - middle_ns);
        });
    const auto up_of = [](const InertialState& state) -> Eigen::Vector3d {
      return state.map_T_imu.orientation.conjugate() * Eigen::Vector3d::UnitZ();
    };
    // Two standard deviations of what an unknown bias of the accelerometer tilts.
    EXPECT_LT((up_of(aligned->state) - up_of(near->state)).norm(), 0.0204);
    EXPECT_LT((aligned->state.bias.gyro_rad_s - near->state.bias.gyro_rad_s).norm(), 0.005);
  }
}

TEST(RecordedRest, IsNotFoundInFlight) {
  const EurocTables log = ReadEuroc("euroc-imu-groundtruth/V1_02_medium");
  if (log.samples.empty()) GTEST_SKIP() << "the recorded samples are not there; set DSG_DATA";
  for (size_t first = 800; first + 201 < log.samples.size() - 600; first += 100) {
    EXPECT_FALSE(AlignedSecond(log, first).ok()) << "from sample " << first;
  }
}

TEST(RecordedRest, IsNotFoundInAHand) {
  const EurocTables log = ReadEuroc("euroc-mh01-stereo/mav0");
  if (log.samples.empty()) GTEST_SKIP() << "the recorded samples are not there; set DSG_DATA";
  for (size_t first = 0; first + 201 <= log.samples.size(); first += 10) {
    EXPECT_FALSE(AlignedSecond(log, first).ok()) << "from sample " << first;
  }
}

}  // namespace
}  // namespace dsg::ingest
