// SPDX-License-Identifier: Apache-2.0
// Logs that lie on their side are turned; nonsense is refused by name.
#include "ingest/pipeline/upright.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

class OnePose : public LogSource {
 public:
  const LogInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (is_read_) return std::nullopt;
    is_read_ = true;
    PoseMeasurement pose;
    pose.pose.map_T_agent.position = {1.0, 2.0, 3.0};
    return Measurement(pose);
  }

 private:
  LogInfo info_;
  bool is_read_ = false;
};

Pose3d PoseOf(LogSource& log) {
  const auto measurement = log.Next();
  return std::get<PoseMeasurement>(**measurement).pose.map_T_agent;
}

TEST(TurnUpright, TakesTheNamedAxisToZ) {
  std::string note;
  auto log = TurnUpright(std::make_unique<OnePose>(), "log", {}, "-y", {}, &note);
  ASSERT_TRUE(log.ok()) << log.status();
  const Pose3d pose = PoseOf(**log);
  EXPECT_NEAR(pose.position.z(), -2.0, 1e-12);
  EXPECT_TRUE((pose.orientation * -Eigen::Vector3d::UnitY()).isApprox(Eigen::Vector3d::UnitZ()));
  EXPECT_NE(note, "");
}

TEST(TurnUpright, LeavesUprightLogsAlone) {
  for (const std::string up : {"auto", "none", "z", "0,0,7"}) {
    std::string note;
    auto log = TurnUpright(std::make_unique<OnePose>(), "log", {}, up, {}, &note);
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(PoseOf(**log).position, Eigen::Vector3d(1.0, 2.0, 3.0)) << up;
    EXPECT_EQ(note, "");
  }
}

TEST(TurnUpright, RefusesWhatIsNoDirection) {
  for (const std::string up : {"", "w", "1,2", "0,0,0", "nan,0,1", "1,2,3,4", "--z"}) {
    EXPECT_EQ(ReasonOf(CheckUp(up)), Reason::kFieldInvalid) << up;
  }
}

TEST(ParseTransform, TakesAShiftAndATurnAboutTheVertical) {
  const auto transform = ParseTransform("1,-2.5,0.25,1.5707963267948966");
  ASSERT_TRUE(transform.ok()) << transform.status();
  EXPECT_EQ(transform->position, Eigen::Vector3d(1.0, -2.5, 0.25));
  EXPECT_TRUE((transform->orientation * Eigen::Vector3d::UnitX())
                  .isApprox(Eigen::Vector3d::UnitY(), 1e-12));
  for (const std::string text :
       {"", "1,2,3", "1,2,3,4,5", "1,2,3,inf", "1,2,three,4", "1;2;3;4", "1e7,0,0,0", "0,0,0,90"}) {
    EXPECT_EQ(ReasonOf(ParseTransform(text).status()), Reason::kFieldInvalid) << text;
  }
}

}  // namespace
}  // namespace dsg::ingest
