// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/output_layout.h"

#include <gtest/gtest.h>

#include <limits>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(OutputLayout, IsToldByTheShape) {
  const OutputLayout rows = *LayoutOf({1, 25200, 85});
  EXPECT_EQ(rows.kind, OutputKind::kRows);
  EXPECT_EQ(rows.box_count, 25200);
  EXPECT_EQ(rows.class_count, 80);
  const OutputLayout columns = *LayoutOf({1, 84, 8400});
  EXPECT_EQ(columns.kind, OutputKind::kColumns);
  EXPECT_EQ(columns.box_count, 8400);
  EXPECT_EQ(columns.class_count, 80);
  const OutputLayout ssd = *LayoutOf({1, 1, 100, 7});
  EXPECT_EQ(ssd.kind, OutputKind::kSsd);
  EXPECT_EQ(ssd.box_count, 100);
  EXPECT_EQ(LayoutOf({1, 1, 0, 7})->box_count, 0);
  EXPECT_EQ(LayoutOf({1, 64, 6})->class_count, 1);
  EXPECT_EQ(LayoutOf({1, 5, 64})->class_count, 1);
}

TEST(OutputLayout, ThatMeansTwoThingsOrNoneIsRefusedWithItsShape) {
  const std::vector<std::vector<int>> shapes = {
      {1, 85, 85}, {1, 85, 100}, {1, 9, 6},     {1, 3, 8400},  {1, 8400, 5},       {2, 84, 8400},
      {1, 84},     {},           {1, 2, 50, 7}, {1, 1, 50, 6}, {1, 3, 80, 80, 85}, {0, 84, 8400}};
  for (const std::vector<int>& shape : shapes) {
    const absl::Status status = LayoutOf(shape).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << ShapeText(shape);
    EXPECT_EQ(MetadataOf(status)["shape"], ShapeText(shape));
    EXPECT_NE(status.message().find(ShapeText(shape)), std::string::npos) << status;
  }
}

constexpr OutputLayout kRowsOfTwoClasses = {
    .kind = OutputKind::kRows, .box_count = 2, .class_count = 2};

TEST(OutputLayout, OfRowsMultipliesTheScoresOfObjectAndClass) {
  const float values[] = {10, 20, 4, 8, 0.8f, 0.1f, 0.75f,  //
                          10, 20, 4, 8, 0.8f, 0.9f, 0.25f};
  const auto people = ReadCandidates(kRowsOfTwoClasses, values, {.person_class = 1});
  ASSERT_TRUE(people.ok()) << people.status();
  ASSERT_EQ(people->size(), 1u);
  EXPECT_NEAR(people->front().score, 0.6, 1e-6);
  EXPECT_EQ(people->front().box_input, Eigen::Vector4d(8, 16, 12, 24));
}

TEST(OutputLayout, OfColumnsReadsAcross) {
  const OutputLayout layout{.kind = OutputKind::kColumns, .box_count = 2, .class_count = 1};
  const float values[] = {10, 30, 20, 40, 4, 6, 8, 10, 0.7f, 0.9f};
  const auto people = ReadCandidates(layout, values, {});
  ASSERT_TRUE(people.ok()) << people.status();
  ASSERT_EQ(people->size(), 2u);
  EXPECT_EQ((*people)[0].box_input, Eigen::Vector4d(8, 16, 12, 24));
  EXPECT_EQ((*people)[1].box_input, Eigen::Vector4d(27, 35, 33, 45));
  EXPECT_NEAR((*people)[1].score, 0.9, 1e-6);
}

TEST(OutputLayout, OfSsdTakesOneClassAndUsedRows) {
  const OutputLayout layout{.kind = OutputKind::kSsd, .box_count = 3, .class_count = 0};
  const float values[] = {0,  1,  0.9f, 0.25f, 0.5f, 0.5f, 1.0f,  //
                          0,  15, 0.9f, 0.25f, 0.5f, 0.5f, 1.0f,  //
                          -1, 1,  0.9f, 0.25f, 0.5f, 0.5f, 1.0f};
  const auto people = ReadCandidates(
      layout, values, {.person_class = 1, .input_width_px = 200, .input_height_px = 100});
  ASSERT_TRUE(people.ok()) << people.status();
  ASSERT_EQ(people->size(), 1u);
  EXPECT_EQ(people->front().box_input, Eigen::Vector4d(50, 50, 100, 100));
}

TEST(OutputLayout, LeavesOutBoxesThatAreNoNumbersOrHaveNoArea) {
  const float no_number[] = {kNan, 20,   4, 8, 1, 1, 0,  //
                             10,   kNan, 4, 8, 1, 1, 0};
  EXPECT_TRUE(ReadCandidates(kRowsOfTwoClasses, no_number, {})->empty());
  const float no_area[] = {10, 20, 0,  8, 1, 1, 0,  //
                           10, 20, -4, 8, 1, 1, 0};
  EXPECT_TRUE(ReadCandidates(kRowsOfTwoClasses, no_area, {})->empty());
}

TEST(OutputLayout, RefusesScoresThatAreNoNumbers) {
  const float no_score[] = {10, 20, 4, 8, kNan, 1, 0,  //
                            10, 20, 4, 8, 1,    1, 0};
  EXPECT_EQ(ReadCandidates(kRowsOfTwoClasses, no_score, {}).status().code(),
            absl::StatusCode::kInternal);
}

TEST(OutputLayout, RefusesScoresBeyondOne) {
  const float logits[] = {10, 20, 4, 8, 1, 3.5f, 0,  //
                          10, 20, 4, 8, 1, 0.5f, 0};
  const absl::Status status = ReadCandidates(kRowsOfTwoClasses, logits, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_NE(status.message().find("3.5"), std::string::npos) << status;
}

}  // namespace
}  // namespace dsg::ingest
