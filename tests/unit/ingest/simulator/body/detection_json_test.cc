// SPDX-License-Identifier: Apache-2.0
// A line of detections has every field of docs/sensor_logs.md and always the same bytes.
#include "ingest/simulator/body/detection_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace dsg::simulator {
namespace {

ingest::HumanDetection Example() {
  ingest::HumanDetection detection;
  detection.time_ns = 1'403'715'524'907'143'168;
  detection.camera = "cam0";
  detection.id = 42;
  detection.score = 0.875;
  detection.box_px = {10.5, 20.25, 110.0, 220.0};
  detection.mask_instance = 3;
  for (int j = 0; j < ingest::kJointCount; ++j) {
    detection.joints_root[j] = {0.01 * j, -0.02 * j, 0.5};
    detection.joints_px[j] = {100.0 + j, 200.5};
    detection.joint_visibility[j] = 0.5;
  }
  detection.pose_coefficients.assign(72, 0.25f);
  detection.shape_coefficients.assign(10, -1.5f);
  detection.weak_scale = 0.912345;
  detection.weak_translation = {0.1, -0.2};
  detection.crop_center_px = {60.25, 120.0};
  detection.crop_px = 240.0;
  return detection;
}

TEST(DetectionJson, HasEveryFieldOfTheFormat) {
  const std::string line = DetectionJson(Example());
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const nlohmann::json json = nlohmann::json::parse(line);
  EXPECT_EQ(json.at("time_ns").get<int64_t>(), 1'403'715'524'907'143'168);
  EXPECT_EQ(json.at("camera"), "cam0");
  EXPECT_EQ(json.at("id"), 42);
  EXPECT_DOUBLE_EQ(json.at("score"), 0.875);
  EXPECT_EQ(json.at("box").size(), 4u);
  EXPECT_DOUBLE_EQ(json.at("box")[1], 20.25);
  EXPECT_EQ(json.at("mask_instance"), 3);
  ASSERT_EQ(json.at("joints").size(), 24u);
  EXPECT_DOUBLE_EQ(json.at("joints")[5][1], -0.1);
  ASSERT_EQ(json.at("joints_px").size(), 24u);
  EXPECT_DOUBLE_EQ(json.at("joints_px")[5][0], 105.0);
  EXPECT_DOUBLE_EQ(json.at("joints_px")[5][2], 0.5);
  EXPECT_EQ(json.at("pose").size(), 72u);
  EXPECT_EQ(json.at("shape").size(), 10u);
  EXPECT_DOUBLE_EQ(json.at("weak_camera").at("scale"), 0.912345);
  EXPECT_DOUBLE_EQ(json.at("weak_camera").at("t")[1], -0.2);
  EXPECT_DOUBLE_EQ(json.at("weak_camera").at("crop_center")[0], 60.25);
  EXPECT_DOUBLE_EQ(json.at("weak_camera").at("crop_px"), 240.0);
}

TEST(DetectionJson, LeavesOutWhatTheNetworkDoesNotSay) {
  ingest::HumanDetection detection = Example();
  detection.pose_coefficients.clear();
  detection.shape_coefficients.clear();
  const nlohmann::json json = nlohmann::json::parse(DetectionJson(detection));
  EXPECT_FALSE(json.contains("pose"));
  EXPECT_FALSE(json.contains("shape"));
}

TEST(DetectionJson, WritesVerticesInMillimetresOnlyIfThereAreSome) {
  ingest::HumanDetection detection = Example();
  EXPECT_EQ(DetectionJson(detection).find("vertices"), std::string::npos);
  detection.vertices_root = {0.5f, 1.0f, -2.0004f, 77.0f, -77.0f, 0.0f};
  const nlohmann::json json = nlohmann::json::parse(DetectionJson(detection));
  // 500, 1000, -2000, and what no body has as the farthest that readers take.
  EXPECT_EQ(json.at("vertices_mm"), "9AHoAzD4ECfw2AAA");
}

TEST(DetectionJson, WritesFacesAsTheFormatSays) {
  EXPECT_EQ(TopologyJson(4, {{0, 1, 2}, {1, 2, 3}}),
            "{\"vertex_count\":4,\"faces\":[[0,1,2],[1,2,3]]}\n");
}

TEST(DetectionJson, SpellsZeroInOneWayAndEscapesNames) {
  ingest::HumanDetection detection = Example();
  detection.joints_root[0] = {-0.0, -1e-9, 0.0};
  detection.camera = "cam\"0\\\n";
  const std::string line = DetectionJson(detection);
  EXPECT_NE(line.find("[0.0000,0.0000,0.0000]"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(line).at("camera"), "cam\"0\\\n");
}

}  // namespace
}  // namespace dsg::simulator
