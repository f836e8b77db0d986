// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/moved_log.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "schema/base/status.h"
#include "tests/unit/ingest/log/given_log.h"

namespace dsg::ingest {
namespace {

const Pose3d kMapTLog{Eigen::Vector3d(10.0, 0.0, 1.0),
                      Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()))};

PoseMeasurement PoseAt(double x, uint32_t flags) {
  PoseMeasurement measurement;
  measurement.pose.map_T_agent.position = {x, 0.0, 0.0};
  measurement.pose.flags = flags;
  Covariance6 covariance{};
  covariance[0] = 4.0F;
  covariance[6] = 1.0F;
  measurement.pose.covariance = std::make_shared<const Covariance6>(covariance);
  return measurement;
}

TEST(MovedLog, MovesPosesAndTheAxesOfTheirCovariances) {
  auto log =
      MoveLog(std::make_unique<GivenLog>(
                  LogInfo(),
                  std::deque<Measurement>{PoseAt(2.0, 0), PoseAt(3.0, pose_flags::kNoOrientation),
                                          ImuMeasurement{5, {1, 2, 3}, Eigen::Vector3d::Zero()}}),
              kMapTLog);
  const ReadLog read = ReadAll(*log);
  ASSERT_EQ(read.measurements.size(), 3u);
  const TimedPose& first = std::get<PoseMeasurement>(read.measurements[0]).pose;
  EXPECT_TRUE(first.map_T_agent.position.isApprox(Eigen::Vector3d(10.0, 2.0, 1.0)));
  EXPECT_TRUE(first.map_T_agent.orientation.isApprox(kMapTLog.orientation));
  EXPECT_NEAR((*first.covariance)[0], 1.0, 1e-6);
  EXPECT_NEAR((*first.covariance)[6], 4.0, 1e-6);
  const TimedPose& second = std::get<PoseMeasurement>(read.measurements[1]).pose;
  EXPECT_TRUE(second.map_T_agent.position.isApprox(Eigen::Vector3d(10.0, 3.0, 1.0)));
  EXPECT_TRUE(second.map_T_agent.orientation.isApprox(Eigen::Quaterniond::Identity()));
  EXPECT_EQ(std::get<ImuMeasurement>(read.measurements[2]).angular_velocity_rad_s.x(), 1.0);
}

TEST(MovedLog, RefusesAGraph) {
  auto log = MoveLog(
      std::make_unique<GivenLog>(LogInfo(), std::deque<Measurement>{GraphMeasurement()}), kMapTLog);
  EXPECT_EQ(ReasonOf(log->Next().status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::ingest
