// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/person_detector.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <opencv2/core.hpp>

#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/agents/detector/tiny_detector.h"

namespace dsg::ingest {
namespace {

using Output = TinyDetector::Output;

class PersonDetectorTest : public testing::Test {
 protected:
  PersonDetectorOptions Options(const TinyDetector& tiny) {
    const std::string file = folder_.path() + "/tiny.onnx";
    std::ofstream(file, std::ios::binary) << MakeTinyDetector(tiny);
    return {.model_file = file,
            .input_width_px = kTinyInputPx,
            .input_height_px = kTinyInputPx,
            .person_class = tiny.output == Output::kSsd ? 1 : 0};
  }

  std::unique_ptr<PersonDetector> Load(const PersonDetectorOptions& options) {
    auto detector = PersonDetector::Load(options);
    EXPECT_TRUE(detector.ok()) << detector.status();
    return detector.ok() ? *std::move(detector) : nullptr;
  }

 private:
  test::TempFolder folder_;
};

std::vector<HumanDetection> Detect(PersonDetector* detector, const Image& image) {
  auto detections = detector->Detect(image, 5, "cam0", 100);
  EXPECT_TRUE(detections.ok()) << detections.status();
  return detections.ok() ? *std::move(detections) : std::vector<HumanDetection>();
}

class EachOutput : public PersonDetectorTest, public testing::WithParamInterface<Output> {};

TEST_P(EachOutput, FindsTheRectangleWhereverItIs) {
  const auto detector = Load(Options({.output = GetParam()}));
  ASSERT_NE(detector, nullptr);
  for (int left = 6; left + 8 < kTinyInputPx - 4; left += 12) {
    for (int top = 6; top + 16 < kTinyInputPx - 4; top += 8) {
      Image image = BlankImage(kTinyInputPx, kTinyInputPx);
      PaintRectangle(&image, left, top, 1, 255, 0, 0);
      const std::vector<HumanDetection> detections = Detect(detector.get(), image);
      ASSERT_EQ(detections.size(), 1u) << left << " " << top;
      const Eigen::Vector4d truth_px(left, top, left + 8, top + 16);
      EXPECT_TRUE(detections[0].box_px.isApprox(truth_px, 1e-6)) << detections[0].box_px;
      EXPECT_GT(detections[0].score, 0.95);
    }
  }
}

TEST_P(EachOutput, FindsNobodyInAnEmptyImage) {
  const auto detector = Load(Options({.output = GetParam()}));
  ASSERT_NE(detector, nullptr);
  EXPECT_TRUE(Detect(detector.get(), BlankImage(kTinyInputPx, kTinyInputPx)).empty());
}

TEST_P(EachOutput, FindsTheRectangleInALargerImageOfAnotherShape) {
  const auto detector = Load(Options({.output = GetParam()}));
  ASSERT_NE(detector, nullptr);
  // A quarter of the size, with bars of 8 pixels above and below.
  Image image = BlankImage(256, 192);
  PaintRectangle(&image, 4 * 22, 4 * (18 - 8), 4, 255, 0, 0);
  const std::vector<HumanDetection> detections = Detect(detector.get(), image);
  ASSERT_EQ(detections.size(), 1u);
  EXPECT_TRUE(detections[0].box_px.isApprox(Eigen::Vector4d(88, 40, 120, 104), 1e-6))
      << detections[0].box_px;
}

INSTANTIATE_TEST_SUITE_P(PersonDetector, EachOutput,
                         testing::Values(Output::kRows, Output::kColumns, Output::kSsd));

TEST_F(PersonDetectorTest, GivesBoxesWithoutJointsBestFirst) {
  const auto detector = Load(Options({}));
  ASSERT_NE(detector, nullptr);
  Image image = BlankImage(kTinyInputPx, kTinyInputPx);
  PaintRectangle(&image, 10, 10, 1, 240, 0, 0);
  PaintRectangle(&image, 42, 30, 1, 255, 0, 0);
  const std::vector<HumanDetection> detections = Detect(detector.get(), image);
  ASSERT_EQ(detections.size(), 2u);
  EXPECT_GT(detections[0].score, detections[1].score);
  EXPECT_TRUE(detections[0].box_px.isApprox(Eigen::Vector4d(42, 30, 50, 46), 1e-6));
  EXPECT_EQ(detections[0].id, 100);
  EXPECT_EQ(detections[1].id, 101);
  for (const HumanDetection& detection : detections) {
    EXPECT_EQ(detection.time_ns, 5);
    EXPECT_EQ(detection.camera, "cam0");
    EXPECT_FALSE(detection.has_joints);
    EXPECT_EQ(detection.joints_root[kLeftHand], Eigen::Vector3d::Zero());
    EXPECT_TRUE(detection.shape_coefficients.empty());
  }
}

TEST_F(PersonDetectorTest, GivesRedGreenAndBlueInThisOrder) {
  Image image = BlankImage(kTinyInputPx, kTinyInputPx);
  PaintRectangle(&image, 10, 10, 1, 255, 0, 0);
  PaintRectangle(&image, 42, 10, 1, 0, 255, 0);
  PaintRectangle(&image, 42, 38, 1, 0, 0, 255);
  for (const int person_class : {0, 1}) {
    PersonDetectorOptions options = Options({.output = Output::kColumns});
    options.person_class = person_class;
    const auto detector = Load(options);
    ASSERT_NE(detector, nullptr);
    const std::vector<HumanDetection> detections = Detect(detector.get(), image);
    ASSERT_EQ(detections.size(), 1u);
    EXPECT_NEAR(detections[0].box_px[0], person_class == 0 ? 10.0 : 42.0, 1e-6);
    EXPECT_NEAR(detections[0].box_px[1], 10.0, 1e-6);
  }
}

TEST_F(PersonDetectorTest, ReadsGreyImages) {
  const auto detector = Load(Options({}));
  ASSERT_NE(detector, nullptr);
  Image image = BlankImage(kTinyInputPx, kTinyInputPx, PixelFormat::kGray8);
  PaintRectangle(&image, 22, 14, 1, 255, 255, 255);
  const std::vector<HumanDetection> detections = Detect(detector.get(), image);
  ASSERT_EQ(detections.size(), 1u);
  EXPECT_TRUE(detections[0].box_px.isApprox(Eigen::Vector4d(22, 14, 30, 30), 1e-6));
}

TEST_F(PersonDetectorTest, KeepsTheBestOfBoxesThatOverlap) {
  // Two pixels beside the grid, two boxes answer alike and share 60 % of their area or less.
  Image image = BlankImage(kTinyInputPx, kTinyInputPx);
  PaintRectangle(&image, 22, 16, 1, 255, 0, 0);
  PersonDetectorOptions options = Options({});
  options.score_min = 0.2;
  options.overlap_max = 0.9;
  const auto lenient = Load(options);
  options.overlap_max = 0.3;
  const auto strict = Load(options);
  ASSERT_NE(lenient, nullptr);
  ASSERT_NE(strict, nullptr);
  EXPECT_EQ(Detect(lenient.get(), image).size(), 2u);
  EXPECT_EQ(Detect(strict.get(), image).size(), 1u);
}

TEST_F(PersonDetectorTest, ChoosesTheOutputThatItKnowsAmongSeveral) {
  const auto detector = Load(Options({.has_raw_output = true}));
  ASSERT_NE(detector, nullptr);
  Image image = BlankImage(kTinyInputPx, kTinyInputPx);
  PaintRectangle(&image, 22, 14, 1, 255, 0, 0);
  EXPECT_EQ(Detect(detector.get(), image).size(), 1u);
}

TEST_F(PersonDetectorTest, RefusesImagesOfOtherKindsAndHalfImages) {
  const auto detector = Load(Options({}));
  ASSERT_NE(detector, nullptr);
  Image cut = BlankImage(64, 64);
  cut.bytes.pop_back();
  for (const Image& image : {BlankImage(64, 64, PixelFormat::kDepth16), Image{}, cut,
                             Image{.width = -1, .height = -1, .bytes = {0}}}) {
    const absl::Status status = detector->Detect(image, 0, "cam0", 0).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << status;
  }
}

TEST_F(PersonDetectorTest, SaysTheSameWithOneThreadAndWithTwo) {
  const uint64_t seed = test::TestSeed(61);
  Random random(seed, 0);
  PersonDetectorOptions options = Options({});
  options.score_min = 0.0;
  Image image = BlankImage(200, 150);
  for (uint8_t& byte : image.bytes) byte = static_cast<uint8_t>(random.Index(256));
  const int thread_count = cv::getNumThreads();
  std::vector<std::vector<HumanDetection>> answers;
  for (const int threads : {1, 2, 1}) {
    cv::setNumThreads(threads);
    const auto detector = Load(options);
    ASSERT_NE(detector, nullptr);
    answers.push_back(Detect(detector.get(), image));
    answers.push_back(Detect(detector.get(), image));
  }
  cv::setNumThreads(thread_count);
  ASSERT_GT(answers[0].size(), 10u);
  for (const std::vector<HumanDetection>& answer : answers) {
    ASSERT_EQ(answer.size(), answers[0].size());
    for (size_t i = 0; i < answer.size(); ++i) {
      EXPECT_EQ(answer[i].box_px, answers[0][i].box_px);
      EXPECT_EQ(answer[i].score, answers[0][i].score);
    }
  }
}

TEST_F(PersonDetectorTest, TellsItsTimeOnACameraImage) {
  const auto detector = Load(Options({}));
  ASSERT_NE(detector, nullptr);
  Image image = BlankImage(720, 480);
  PaintRectangle(&image, 200, 100, 11, 255, 0, 0);
  constexpr int kRoundCount = 50;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kRoundCount; ++i) Detect(detector.get(), image);
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
  std::printf("tiny network, 720 x 480: %.2f ms an image, %d threads\n",
              taken.count() / kRoundCount, cv::getNumThreads());
}

}  // namespace
}  // namespace dsg::ingest
