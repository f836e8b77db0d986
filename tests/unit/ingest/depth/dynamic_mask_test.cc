// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/dynamic_mask.h"

#include <gtest/gtest.h>

#include "tests/unit/ingest/depth/depth_test_util.h"

namespace dsg::ingest {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr uint16_t kHuman = 60;
constexpr uint16_t kWall = 1;

bool IsPerson(int u, int v) { return u >= 60 && u < 90 && v >= 20 && v < 110; }

// A person 2 m away in front of a wall at 4 m, a table at 2 m beside it.
DepthFrame PlainScene() {
  DepthFrame frame;
  frame.camera = TestCamera("depth0", kWidth, kHeight);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const bool is_table = u >= 120 && v >= 80;
      frame.depth_m.push_back(IsPerson(u, v) || is_table ? 2.0f : 4.0f);
    }
  }
  return frame;
}

DepthFrame LabelledScene() {
  DepthFrame frame = PlainScene();
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      frame.labels.push_back(
          static_cast<uint16_t>((IsPerson(u, v) ? kHuman : kWall) << 8 | (v & 0xff)));
    }
  }
  return frame;
}

DepthOptions Options(int growth_px) {
  DepthOptions options;
  options.dynamic_classes = {kHuman};
  options.mask_growth_px = growth_px;
  return options;
}

HumanDetection Detection(bool has_joints) {
  HumanDetection detection;
  detection.camera = "depth0";
  detection.box_px = {55.0, 15.0, 95.0, 112.0};
  for (Eigen::Vector2d& joint : detection.joints_px) joint.setZero();
  if (!has_joints) return detection;
  detection.joint_visibility.fill(1.0);
  for (size_t i = 0; i < kJointCount; ++i) {
    detection.joints_px[i] = {75.0, 90.0 - 3.0 * static_cast<double>(i)};
  }
  return detection;
}

bool MaskAt(const std::vector<uint8_t>& mask, int u, int v) {
  return mask[static_cast<size_t>(v * kWidth + u)] != 0;
}

TEST(DynamicMask, IsEmptyWhereNobodyIs) {
  DepthFrame frame = PlainScene();
  EXPECT_TRUE(MaskPeople(frame, {}, Options(3)).empty());
  frame.labels.assign(frame.depth_m.size(), kWall << 8);
  EXPECT_TRUE(MaskPeople(frame, {}, Options(3)).empty());
}

TEST(DynamicMask, WithoutGrowthIsTheLabelsAndTheDepthEdgeBesideThem) {
  const std::vector<uint8_t> mask = MaskPeople(LabelledScene(), {}, Options(0));
  ASSERT_EQ(mask.size(), static_cast<size_t>(kWidth * kHeight));
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const bool is_rim = u >= 59 && u <= 90 && v >= 19 && v <= 110;
      if (IsPerson(u, v)) {
        EXPECT_TRUE(MaskAt(mask, u, v));
      } else if (!is_rim) {
        EXPECT_FALSE(MaskAt(mask, u, v)) << u << " " << v;
      }
    }
  }
  EXPECT_TRUE(MaskAt(mask, 59, 60)) << "an edge of 2 m";
}

TEST(DynamicMask, GrowsByThePixelsAskedFor) {
  DepthOptions options = Options(3);
  options.mask_edge_m = 100.0;
  const std::vector<uint8_t> mask = MaskPeople(LabelledScene(), {}, options);
  EXPECT_TRUE(MaskAt(mask, 57, 60));
  EXPECT_FALSE(MaskAt(mask, 56, 60));
  EXPECT_TRUE(MaskAt(mask, 92, 60));
  EXPECT_FALSE(MaskAt(mask, 93, 60));
}

TEST(DynamicMask, OutlineThatTheLabelsMissedIsFoundByItsDepthEdge) {
  // Labels that end 5 pixels inside the person: 3 are grown, the edge is within 3 more.
  DepthFrame frame = PlainScene();
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      frame.labels.push_back(
          static_cast<uint16_t>((IsPerson(u - 5, v) && IsPerson(u + 5, v) ? kHuman : kWall) << 8));
    }
  }
  const std::vector<uint8_t> mask = MaskPeople(frame, {}, Options(3));
  EXPECT_TRUE(MaskAt(mask, 60, 60)) << "the person's outermost pixel";
  EXPECT_FALSE(MaskAt(mask, 55, 60));
  DepthOptions no_edges = Options(3);
  no_edges.mask_edge_m = 100.0;
  EXPECT_FALSE(MaskAt(MaskPeople(frame, {}, no_edges), 60, 60));
}

TEST(DynamicMask, BoxesAloneMaskWhatIsAsFarAsTheTorso) {
  for (const bool has_joints : {true, false}) {
    const std::vector<uint8_t> mask = MaskPeople(PlainScene(), {Detection(has_joints)}, Options(0));
    ASSERT_FALSE(mask.empty());
    EXPECT_TRUE(MaskAt(mask, 62, 25));
    EXPECT_TRUE(MaskAt(mask, 75, 105));
    EXPECT_FALSE(MaskAt(mask, 56, 60)) << "the wall behind, inside the box";
    EXPECT_FALSE(MaskAt(mask, 130, 100)) << "the table, outside the box";
  }
}

TEST(DynamicMask, BoxIsIgnoredWhereLabelsShowThePersonAndUsedWhereTheyMissIt) {
  DepthFrame frame = LabelledScene();
  frame.depth_m[static_cast<size_t>(60 * kWidth + 93)] = 2.0f;
  DepthOptions options = Options(0);
  options.mask_edge_m = 100.0;
  EXPECT_FALSE(MaskAt(MaskPeople(frame, {Detection(true)}, options), 93, 60));
  frame.labels.assign(frame.labels.size(), kWall << 8);
  EXPECT_TRUE(MaskAt(MaskPeople(frame, {Detection(true)}, options), 93, 60));
}

TEST(DynamicMask, BoxesOutsideTheImageOrWithoutDepthDoNothing) {
  HumanDetection outside = Detection(false);
  outside.box_px = {-1e9, -1e9, -5.0, 1e9};
  HumanDetection broken = Detection(false);
  broken.box_px[2] = NAN;
  HumanDetection inverted = Detection(false);
  inverted.box_px = {90.0, 100.0, 20.0, 10.0};
  EXPECT_TRUE(MaskPeople(PlainScene(), {outside, broken, inverted}, Options(3)).empty());
  DepthFrame blind = PlainScene();
  blind.depth_m.assign(blind.depth_m.size(), 0.0f);
  EXPECT_TRUE(MaskPeople(blind, {Detection(true)}, Options(3)).empty());
}

TEST(DynamicMask, FrameMakerMasksByDetectionsOfTheStamp) {
  const auto make = [](TimeNs detection_ns, const std::string& camera) {
    PosedFrameMaker maker(TestRig(kWidth, kHeight), Options(0));
    maker.AddPose(0, At(0.0));
    maker.AddPicture(Shot(0, "depth0", Depth32Image(kWidth, kHeight, [](int u, int v) {
                            return IsPerson(u, v) ? 2.0f : 4.0f;
                          })));
    HumanDetection detection = Detection(true);
    detection.time_ns = detection_ns;
    detection.camera = camera;
    maker.AddDetection(detection);
    return Drain(&maker).at(0).dynamic;
  };
  const std::vector<uint8_t> mask = make(3 * kMs, "cam0");
  ASSERT_FALSE(mask.empty());
  EXPECT_TRUE(MaskAt(mask, 75, 60));
  EXPECT_TRUE(make(40 * kMs, "cam0").empty()) << "another instant";
  EXPECT_TRUE(make(0, "cam7").empty()) << "another camera";
}

}  // namespace
}  // namespace dsg::ingest
