// SPDX-License-Identifier: Apache-2.0
// The robot's CAD model from a file.
#include "ingest/pipeline/robot_model.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "schema/base/status.h"
#include "schema/codec/checksum.h"

namespace dsg::ingest {
namespace {

std::string Write(const std::string& name, const std::string& bytes) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path.string();
}

constexpr char kWedge[] =
    "v -0.3 -0.2 0\nv 0.4 -0.2 0\nv 0.4 0.2 0\nv 0 0 0.5\nv 90 90 90\nf 1 2 3\nf 1 2 4\n";

TEST(RobotModel, IsKeptAsTheFileHoldsItAndBoundsTheRobot) {
  const auto model = ReadRobotModel(Write("robot_wedge.OBJ", kWedge));
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(model->asset.content, kWedge);
  EXPECT_EQ(model->asset.media_type, "model/obj");
  EXPECT_EQ(model->asset.sha256, ComputeSha256(kWedge));
  // A vertex without faces is no part of the shape.
  EXPECT_EQ(model->box_robot.min(), Eigen::Vector3d(-0.3, -0.2, 0.0));
  EXPECT_EQ(model->box_robot.max(), Eigen::Vector3d(0.4, 0.2, 0.5));
  Node robot;
  SetRobotModel(*model, &robot);
  EXPECT_EQ(robot.agent->body_model, model->asset.sha256);
  EXPECT_EQ(robot.box_node.max().z(), 0.5);
}

TEST(RobotModel, RefusesWhatIsNoModelOfARobot) {
  const auto reason = [](const std::string& path) {
    return ReasonOf(ReadRobotModel(path).status());
  };
  EXPECT_TRUE(absl::IsNotFound(ReadRobotModel("/nowhere/robot.ply").status()));
  EXPECT_EQ(reason(Write("robot_a.stl", kWedge)), Reason::kFileMalformed);
  EXPECT_EQ(reason(Write("robot_b.obj", "v 0 0 0\n")), Reason::kFileMalformed);
  EXPECT_EQ(reason(Write("robot_c.ply", "ply\n")), Reason::kFileMalformed);
  EXPECT_EQ(reason(Write("robot_d.obj", "")), Reason::kFileMalformed);
  EXPECT_EQ(reason(Write("robot_e.obj", "v 0 0 0\nv 900 0 0\nv 0 900 0\nf 1 2 3\n")),
            Reason::kFileMalformed);
}

}  // namespace
}  // namespace dsg::ingest
