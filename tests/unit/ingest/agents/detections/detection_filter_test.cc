// SPDX-License-Identifier: Apache-2.0
// The paper's rules, and numbers that no detector gives.
#include "ingest/agents/detections/detection_filter.h"

#include <cmath>

#include "tests/unit/ingest/agents/detections/detection_test_util.h"

namespace dsg::ingest {
namespace {

HumanDetection Good() {
  return PerfectDetection(TestCamera(), LookAlongX(1.2), Upright({5.0, 0.0, 0.93}, 1.0));
}

std::string Why(const HumanDetection& detection, const DetectionFilterOptions& options = {}) {
  const auto why = WhyRejected(detection, TestCamera(), options);
  return why.has_value() ? std::string(*why) : "";
}

std::string WhyBox(double left, double top, double right, double bottom) {
  HumanDetection detection = Good();
  detection.box_px = {left, top, right, bottom};
  return Why(detection);
}

TEST(DetectionFilter, KeepsAPersonInTheMiddle) { EXPECT_EQ(Why(Good()), ""); }

TEST(DetectionFilter, DropsBoxesAtTheBorder) {
  EXPECT_EQ(WhyBox(6, 6, 713, 473), "");
  for (const std::string& why : {WhyBox(5, 6, 713, 473), WhyBox(6, 5, 713, 473),
                                 WhyBox(6, 6, 714, 473), WhyBox(6, 6, 713, 474)}) {
    EXPECT_EQ(why, "box at the image's border");
  }
}

TEST(DetectionFilter, DropsBoxesOfAtMostThirtyPixels) {
  EXPECT_EQ(WhyBox(100, 100, 120, 130), "box too small");
  EXPECT_EQ(WhyBox(100, 100, 120, 130.5), "") << "the longer side counts";
  EXPECT_EQ(WhyBox(100, 100, 130.5, 110), "");
}

TEST(DetectionFilter, TellsImpossibleBoxesApart) {
  EXPECT_EQ(WhyBox(300, 100, 200, 200), "box inverted or empty");
  EXPECT_EQ(WhyBox(300, 200, 400, 200), "box inverted or empty");
  EXPECT_EQ(WhyBox(800, 100, 900, 200), "box outside the image");
  EXPECT_EQ(WhyBox(-200, 100, -10, 200), "box outside the image");
  EXPECT_EQ(WhyBox(100, 500, 200, 600), "box outside the image");
  EXPECT_EQ(WhyBox(100, NAN, 200, 600), "a number is not finite");
}

TEST(DetectionFilter, DropsWhatIsNotFiniteOrMiscounted) {
  HumanDetection detection = Good();
  detection.joints_root[3].y() = NAN;
  EXPECT_EQ(Why(detection), "a number is not finite");
  detection.has_joints = false;
  EXPECT_EQ(Why(detection), "") << "no field of joints says anything";
  detection.pelvis_camera = Eigen::Vector3d(0, INFINITY, 1);
  EXPECT_EQ(Why(detection), "a number is not finite");
  detection = Good();
  detection.vertices_root = {0.0f, NAN, 0.0f};
  EXPECT_EQ(Why(detection), "a number is not finite");
  detection.vertices_root = {0.0f, 0.0f};
  EXPECT_EQ(Why(detection), "wrong count of coefficients or vertices");
  detection = Good();
  detection.pose_coefficients.pop_back();
  EXPECT_EQ(Why(detection), "wrong count of coefficients or vertices");
  detection = Good();
  detection.shape_coefficients.resize(9);
  EXPECT_EQ(Why(detection), "wrong count of coefficients or vertices");
}

TEST(DetectionFilter, DropsLowScoresOnlyWhenAsked) {
  HumanDetection detection = Good();
  detection.score = 0.3;
  EXPECT_EQ(Why(detection), "");
  EXPECT_EQ(Why(detection, {.score_min = 0.5}), "score too low");
}

}  // namespace
}  // namespace dsg::ingest
