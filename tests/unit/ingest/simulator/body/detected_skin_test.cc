// SPDX-License-Identifier: Apache-2.0
// The skin of a detection errs where and as much as its joints do.
#include "ingest/simulator/body/detected_skin.h"

#include <gtest/gtest.h>

#include "ingest/simulator/body/body_skin.h"
#include "ingest/simulator/body/gait.h"

namespace dsg::simulator {
namespace {

using JointPoints = std::array<Eigen::Vector3d, ingest::kJointCount>;

class DetectedSkin : public testing::Test {
 protected:
  DetectedSkin() {
    body_.posture = TrunkPosture(model_, GaitState());
    body_.map_T_torso = {{3.0, -1.0, 0.9},
                         Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()))};
    body_.camera_R_map = Eigen::AngleAxisd(-1.2, Eigen::Vector3d(1.0, 2.0, -1.0).normalized());
    joints_ = model_.Joints(body_.posture);
    const Eigen::Vector3d pelvis = joints_[ingest::kPelvis];
    for (Eigen::Vector3d& joint : joints_) {
      joint = body_.camera_R_map * (body_.map_T_torso.orientation * (joint - pelvis));
    }
  }

  const BodyModel model_{ShapeCoefficients{0.5, -1.0}};
  DetectedBody body_;
  /// As a detector without errors says them.
  JointPoints joints_;
};

TEST_F(DetectedSkin, OfADetectorWithoutErrorsIsTheTrueOne) {
  const SkinPair skins = MakeSkins(body_, model_, joints_);
  ASSERT_EQ(skins.true_root_map.size(), SkinTopologyOfAll().bindings.size());
  ASSERT_EQ(skins.detected_root_camera.size(), skins.true_root_map.size());
  EXPECT_LT(MeanSkinErrorM(body_, skins), 1e-6);
  TriangleMesh skin;
  model_.Skin(body_.posture, &skin);
  const Eigen::Vector3d pelvis = model_.Joints(body_.posture)[ingest::kPelvis];
  const Eigen::Vector3d vertex_map =
      body_.map_T_torso.orientation * (skin.vertices[700].cast<double>() - pelvis);
  EXPECT_LT((vertex_map - skins.true_root_map[700].cast<double>()).norm(), 1e-6);
}

TEST_F(DetectedSkin, MovesWithAllJointsAsFarAsThey) {
  for (Eigen::Vector3d& joint : joints_) joint += Eigen::Vector3d(0.03, 0.0, -0.04);
  EXPECT_NEAR(MeanSkinErrorM(body_, MakeSkins(body_, model_, joints_)), 0.05, 1e-6);
}

TEST_F(DetectedSkin, ErrsOnlyAboutTheJointThatErrs) {
  joints_[ingest::kLeftHand] += Eigen::Vector3d(0.2, 0.0, 0.0);
  const SkinPair skins = MakeSkins(body_, model_, joints_);
  double largest_m = 0.0;
  double head_m = 0.0;
  for (size_t i = 0; i < skins.true_root_map.size(); ++i) {
    const double error_m = (skins.detected_root_camera[i].cast<double>() -
                            body_.camera_R_map * skins.true_root_map[i].cast<double>())
                               .norm();
    largest_m = std::max(largest_m, error_m);
    if (BodyModel::VertexJoints()[i] == 15) head_m = std::max(head_m, error_m);
  }
  EXPECT_GT(largest_m, 0.15);
  EXPECT_LT(largest_m, 0.2 + 1e-6);
  EXPECT_LT(head_m, 1e-6);
}

}  // namespace
}  // namespace dsg::simulator
