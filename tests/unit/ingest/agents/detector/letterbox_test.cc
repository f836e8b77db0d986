// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/letterbox.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

TEST(Letterbox, LaysAWideImageInTheMiddleWithBarsAboveAndBelow) {
  const Letterbox letterbox = FitLetterbox(720, 480, 640, 640);
  EXPECT_EQ(letterbox.left_px, 0);
  EXPECT_EQ(letterbox.width_px, 640);
  EXPECT_EQ(letterbox.height_px, 427);
  EXPECT_EQ(letterbox.top_px, 106);
}

TEST(Letterbox, TakesTheWholeInputBackToTheWholeImage) {
  const Letterbox letterbox = FitLetterbox(480, 720, 640, 320);
  const Eigen::Vector4d image = letterbox.ToImage(
      {static_cast<double>(letterbox.left_px), static_cast<double>(letterbox.top_px),
       static_cast<double>(letterbox.left_px + letterbox.width_px),
       static_cast<double>(letterbox.top_px + letterbox.height_px)});
  EXPECT_TRUE(image.isApprox(Eigen::Vector4d(0, 0, 480, 720)));
}

TEST(Letterbox, CutsBoxesAtTheEdgesOfTheImage) {
  const Letterbox letterbox = FitLetterbox(100, 100, 200, 200);
  EXPECT_TRUE(letterbox.ToImage({-50, 20, 500, 60}).isApprox(Eigen::Vector4d(0, 10, 100, 30)));
}

TEST(Letterbox, LeavesAPixelOfTheThinnestImage) {
  const Letterbox letterbox = FitLetterbox(100000, 1, 64, 64);
  EXPECT_EQ(letterbox.width_px, 64);
  EXPECT_EQ(letterbox.height_px, 1);
}

}  // namespace
}  // namespace dsg::ingest
