// SPDX-License-Identifier: Apache-2.0
// Errors of bodies: against the pelvis only shape and turn count, in the map the place too.
#include "ingest/evaluation/bodies.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/temp_folder.h"

namespace dsg::evaluation {
namespace {

constexpr TimeNs kTimeNs = 5'000;
constexpr int64_t kId = 42;
const Eigen::Vector3d kPelvis(10.0, 20.0, 1.0);

// A body of two vertices whose joints all lie on its pelvis but the last one.
class BodyMetric : public testing::Test {
 protected:
  BodyMetric() {
    truth::HumanState state;
    state.time_ns = kTimeNs;
    state.human = 3;
    state.joints_map.fill(kPelvis);
    state.joints_map.back() += Eigen::Vector3d(0.0, 1.0, 0.0);
    truth_.human_states = {state};
    truth::DetectionTruth detection;
    detection.id = kId;
    detection.time_ns = kTimeNs;
    detection.human = 3;
    detection.torso_map = kPelvis;
    truth_.detections = {detection};
    auto file = truth::BodyFileWriter::Create(folder_.path(), 2);
    EXPECT_TRUE(file.ok() && file->Add(kId, {{0, 1, 0}, {0, 2, 0}}).ok() && file->Commit().ok());
    bodies_ = *truth::BodyFile::Open(folder_.path());
    body_.time_ns = kTimeNs;
    // The torso looks along y of the map, so that y of the map is its x.
    body_.map_T_torso = {kPelvis, Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * std::numbers::pi,
                                                                       Eigen::Vector3d::UnitZ()))};
    body_.joints.assign(3 * ingest::kJointCount, 0.0F);
    body_.joints[3 * (ingest::kJointCount - 1)] = 1.0F;
    body_.vertices = {1, 0, 0, 2, 0, 0};
  }

  HumanResult Score() {
    Estimate estimate;
    estimate.bodies = {body_};
    HumanResult result;
    result.detection_of[{kTimeNs, 0}] = kId;
    EXPECT_TRUE(ScoreBodies(estimate, truth_, &*bodies_, &result).ok());
    return result;
  }

  test::TempFolder folder_;
  truth::Truth truth_;
  std::optional<truth::BodyFile> bodies_;
  TrackedBody body_;
};

TEST_F(BodyMetric, IsZeroForTheTrueBody) {
  const HumanResult result = Score();
  EXPECT_EQ(result.joint_body_count, 1);
  EXPECT_EQ(result.vertex_body_count, 1);
  for (const auto& error :
       {result.joint_root_m, result.joint_m, result.vertex_root_m, result.vertex_m}) {
    EXPECT_NEAR(error.value_or(-1.0), 0.0, 1e-6);
  }
}

TEST_F(BodyMetric, OfAPlaceCountsInTheMapOnly) {
  body_.map_T_torso.position += Eigen::Vector3d(0.3, 0.0, 0.4);
  const HumanResult result = Score();
  EXPECT_NEAR(*result.joint_root_m, 0.0, 1e-6);
  EXPECT_NEAR(*result.vertex_root_m, 0.0, 1e-6);
  EXPECT_NEAR(*result.joint_m, 0.5, 1e-6);
  EXPECT_NEAR(*result.vertex_m, 0.5, 1e-6);
}

TEST_F(BodyMetric, IsTheMeanOverVertices) {
  body_.vertices[3] = 2.6F;
  EXPECT_NEAR(*Score().vertex_root_m, 0.3, 1e-6);
  body_.map_T_torso.orientation.setIdentity();
  // A quarter turn: one vertex is off by the root of 2, the joint at the end too.
  EXPECT_NEAR(*Score().joint_root_m, std::numbers::sqrt2 / ingest::kJointCount, 1e-6);
}

TEST_F(BodyMetric, LeavesOutWhatCannotBeCompared) {
  body_.vertices.assign(9, 0.0F);
  const HumanResult other_count = Score();
  EXPECT_EQ(other_count.vertex_body_count, 0);
  EXPECT_FALSE(other_count.vertex_m.has_value());
  EXPECT_EQ(other_count.joint_body_count, 1);
  body_.time_ns += 1;
  EXPECT_EQ(Score().joint_body_count, 0);
}

}  // namespace
}  // namespace dsg::evaluation
