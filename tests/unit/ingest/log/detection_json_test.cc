// SPDX-License-Identifier: Apache-2.0
// Detections from JSON: whole ones come through, wrong ones name their field.
#include "ingest/log/detection_json.h"

#include <gtest/gtest.h>

#include <random>

#include "absl/strings/escaping.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/detection_lines.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

absl::StatusOr<HumanDetection> ParseLine(const std::string& line) {
  const std::string file = "data.jsonl";
  return ParseDetection(LinePosition{file, 4}, line);
}

// The line with one piece replaced.
std::string LineWith(const std::string& from, const std::string& to) {
  return Changed(DetectionLine(1000, 7), from, to);
}

void ExpectLineError(const std::string& line, const std::string& field) {
  ExpectMalformedFile(ParseLine(line).status(), {"data.jsonl:4", field});
}

TEST(DetectionJson, ReadsEveryField) {
  const auto detection = ParseLine(DetectionLine(1000, 7));
  ASSERT_TRUE(detection.ok()) << detection.status();
  EXPECT_EQ(detection->time_ns, 1000);
  EXPECT_EQ(detection->id, 7);
  EXPECT_EQ(detection->camera, "cam0");
  EXPECT_EQ(detection->score, 0.9);
  EXPECT_EQ(detection->box_px, Eigen::Vector4d(10.5, 20, 30, 60));
  EXPECT_EQ(detection->mask_instance, 3);
  EXPECT_EQ(detection->joints_root[23], Eigen::Vector3d(0.1, -0.2, 0.3));
  EXPECT_EQ(detection->joints_px[23], Eigen::Vector2d(20, 40.5));
  EXPECT_EQ(detection->joint_visibility[23], 1.0);
  EXPECT_EQ(detection->pose_coefficients, std::vector<float>(72, 0.25f));
  EXPECT_EQ(detection->shape_coefficients, std::vector<float>(10, -0.5f));
  EXPECT_EQ(detection->weak_scale, 0.8);
  EXPECT_EQ(detection->weak_translation, Eigen::Vector2d(0.1, 0.2));
  EXPECT_EQ(detection->crop_center_px, Eigen::Vector2d(20, 40));
  EXPECT_EQ(detection->crop_px, 50.0);
}

TEST(DetectionJson, LetsPoseAndShapeBeMissing) {
  EXPECT_TRUE(ParseLine(LineWith("\"pose\"", "\"pose_\"")).ok());
  EXPECT_TRUE(ParseLine(LineWith("\"shape\"", "\"shape_\"")).ok());
}

TEST(DetectionJson, ReadsABoxAlone) {
  const auto detection = ParseLine(
      "{\"time_ns\":5,\"camera\":\"cam0\",\"id\":1,\"score\":0.5,\"box\":[1,2,3,4],"
      "\"mask_instance\":0}");
  ASSERT_TRUE(detection.ok()) << detection.status();
  EXPECT_FALSE(detection->has_joints);
  EXPECT_EQ(detection->joints_root[5], Eigen::Vector3d::Zero());
  EXPECT_EQ(detection->joint_visibility[5], 0.0);
  EXPECT_TRUE(ParseLine(DetectionLine(1000, 7))->has_joints);
  ExpectLineError(LineWith("\"joints\"", "\"joints_\""), "joints_px");
  ExpectLineError(LineWith("\"joints_px\"", "\"joints_px_\""), "joints_px");
}

TEST(DetectionJson, TakesThePelvisForTheWeakCamera) {
  const auto detection =
      ParseLine(LineWith("\"weak_camera\":", "\"pelvis\":[0.5,-1,4],\"weak_\":"));
  ASSERT_TRUE(detection.ok()) << detection.status();
  EXPECT_EQ(detection->pelvis_camera, Eigen::Vector3d(0.5, -1, 4));
  EXPECT_FALSE(ParseLine(DetectionLine(1000, 7))->pelvis_camera.has_value());
  ExpectLineError(LineWith("\"weak_camera\":", "\"pelvis\":[0.5,-1,-4],\"weak_\":"), "pelvis");
  ExpectLineError(LineWith("\"weak_camera\":", "\"pelvis\":[0.5,-1],\"weak_\":"), "pelvis");
  ExpectLineError(LineWith("\"weak_camera\":", "\"pelvis\":[0,0,1e9],\"weak_\":"), "pelvis");
}

TEST(DetectionJson, ReadsVerticesFlatOrInThrees) {
  const auto with = [](const std::string& vertices) {
    return LineWith("\"shape\"", "\"vertices\":" + vertices + ",\"shape\"");
  };
  const std::vector<float> expected = {0.5f, 1.0f, -2.0f, 3.0f, 4.0f, 5.0f};
  const auto threes = ParseLine(with("[[0.5,1,-2],[3,4,5]]"));
  ASSERT_TRUE(threes.ok()) << threes.status();
  EXPECT_EQ(threes->vertices_root, expected);
  const auto flat = ParseLine(with("[0.5,1,-2,3,4,5]"));
  ASSERT_TRUE(flat.ok()) << flat.status();
  EXPECT_EQ(flat->vertices_root, expected);
  EXPECT_TRUE(ParseLine(with("[]"))->vertices_root.empty());
  EXPECT_TRUE(ParseLine(with(Repeated("0.5", 60'000))).ok());
  ExpectLineError(with(Repeated("0.5", 60'003)), "vertices");
  ExpectLineError(with(Repeated("[0,0,0]", 20'001)), "vertices");
  ExpectLineError(with("[0.5,1]"), "vertices");
  ExpectLineError(with("[[0.5,1]]"), "vertices");
  ExpectLineError(with("[[0.5,1,null]]"), "vertices");
  ExpectLineError(with("[0.5,1,[2,3,4]]"), "vertices");
  ExpectLineError(with("[0.5,1,200]"), "vertices");
  ExpectLineError(with("7"), "vertices");
}

TEST(DetectionJson, ReadsVerticesInMillimetres) {
  const auto with = [](const std::string& text) {
    return LineWith("\"shape\"", "\"vertices_mm\":" + text + ",\"shape\"");
  };
  const auto encoded = [&with](const std::vector<int16_t>& millimetres) {
    std::string bytes;
    for (const int16_t mm : millimetres) {
      bytes.push_back(static_cast<char>(mm & 0xff));
      bytes.push_back(static_cast<char>(mm >> 8 & 0xff));
    }
    return with("\"" + absl::Base64Escape(bytes) + "\"");
  };
  const auto detection = ParseLine(encoded({500, 1000, -2000, 10'000, -1, 0}));
  ASSERT_TRUE(detection.ok()) << detection.status();
  const std::vector<float> expected = {0.5f, 1.0f, -2.0f, 10.0f, -0.001f, 0.0f};
  EXPECT_EQ(detection->vertices_root, expected);
  EXPECT_TRUE(ParseLine(encoded({}))->vertices_root.empty());
  // What `base64.b64encode(numpy.array([[500, 1000, -2000]], "<i2").tobytes())` gives.
  const auto from_python = ParseLine(with("\"9AHoAzD4\""));
  ASSERT_TRUE(from_python.ok()) << from_python.status();
  EXPECT_EQ(from_python->vertices_root, (std::vector<float>{0.5f, 1.0f, -2.0f}));
  EXPECT_TRUE(ParseLine(encoded(std::vector<int16_t>(60'000, 1))).ok());
  ExpectLineError(encoded(std::vector<int16_t>(60'003, 1)), "vertices_mm");
  ExpectLineError(encoded({500, 1000}), "vertices_mm");
  ExpectLineError(encoded({0, 0, 0, 0, 0, -10'001}), "vertex 1");
  ExpectLineError(with("\"%%%\""), "base64");
  ExpectLineError(with("[1,2,3]"), "vertices_mm");
  ExpectLineError(LineWith("\"shape\"", "\"vertices\":[],\"vertices_mm\":\"\",\"shape\""), "both");
}

TEST(DetectionJson, NamesTheFieldThatIsWrong) {
  ExpectLineError("", "JSON");
  ExpectLineError("[1]", "JSON");
  ExpectLineError("{\"time_ns\":1", "JSON");
  ExpectLineError("{}", "time_ns");
  ExpectLineError(LineWith("\"time_ns\":1000", "\"time_ns\":1000.5"), "time_ns");
  ExpectLineError(LineWith("\"time_ns\":1000", "\"time_ns\":-1"), "time_ns");
  ExpectLineError(LineWith("\"time_ns\":1000", "\"time_ns\":99999999999999999999"), "time_ns");
  ExpectLineError(LineWith("\"cam0\"", "7"), "camera");
  ExpectLineError(LineWith("\"score\":0.9", "\"score\":1.01"), "score");
  ExpectLineError(LineWith("\"score\":0.9", "\"score\":null"), "score");
  ExpectLineError(LineWith("[10.5,20,30,60]", "[30,20,10,60]"), "box");
  ExpectLineError(LineWith("[10.5,20,30,60]", "[10.5,20,30]"), "box");
  ExpectLineError(LineWith("\"mask_instance\":3", "\"mask_instance\":-3"), "mask_instance");
  ExpectLineError(LineWith("[0.1,-0.2,0.3]", "[0.1,-0.2]"), "joints");
  ExpectLineError(LineWith("[0.1,-0.2,0.3],", ""), "joints");
  ExpectLineError(LineWith("[0.1,-0.2,0.3]", "[0.1,-200,0.3]"), "joints");
  ExpectLineError(LineWith("[20,40.5,1]", "[20,40.5,2]"), "joints_px");
  ExpectLineError(LineWith("0.25,", ""), "pose");
  ExpectLineError(LineWith("\"weak_camera\":{", "\"weak\":{"), "weak_camera");
  ExpectLineError(LineWith("\"t\":[0.1,0.2]", "\"t\":[0.1]"), "field t");
}

TEST(DetectionJson, RefusesLinesThatAreTooLongOrTooDeep) {
  ExpectLineError(std::string((size_t{1} << 20) + 1, ' '), "bytes");
  ExpectLineError(std::string(100'000, '['), "deep");
  ExpectLineError("{\"a\":\"\xff\"}", "UTF-8");
  EXPECT_TRUE(ParseLine(LineWith("\"cam0\"", "\"[[[[[[[[[[[[\"")).ok()) << "brackets in text";
}

TEST(DetectionJson, SurvivesAnyCutAndAnyChangedByte) {
  constexpr unsigned kSeed = 20150711;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  const std::string line = DetectionLine(1000, 7);
  for (size_t size = 0; size < line.size(); ++size) {
    EXPECT_FALSE(ParseLine(line.substr(0, size)).ok());
  }
  for (int i = 0; i < 3000; ++i) {
    std::string changed = line;
    changed[random() % changed.size()] = static_cast<char>(random() % 256);
    const auto detection = ParseLine(changed);
    EXPECT_TRUE(detection.ok() || ReasonOf(detection.status()) == Reason::kFileMalformed);
  }
}

}  // namespace
}  // namespace dsg::ingest
