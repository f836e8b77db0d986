// SPDX-License-Identifier: Apache-2.0
// Pixels are found where they are, and readings that are none read as zero.
#include "ingest/sensor/image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace dsg::ingest {
namespace {

Image MakeImage(int width, int height, PixelFormat format) {
  Image image{width, height, format, {}};
  image.bytes.resize(static_cast<size_t>(width * height * BytesPerPixel(format)));
  return image;
}

void SetFloat(Image* image, int column, int row, float value) {
  std::memcpy(image->bytes.data() + image->Offset(column, row), &value, sizeof value);
}

TEST(Image, TellsBytesAndNameOfEachFormat) {
  EXPECT_EQ(BytesPerPixel(PixelFormat::kGray8), 1);
  EXPECT_EQ(BytesPerPixel(PixelFormat::kRgb8), 3);
  EXPECT_EQ(BytesPerPixel(PixelFormat::kLabel16), 2);
  EXPECT_EQ(BytesPerPixel(PixelFormat::kDepth16), 2);
  EXPECT_EQ(BytesPerPixel(PixelFormat::kDepth32), 4);
  EXPECT_EQ(Name(PixelFormat::kGray8), "gray8");
  EXPECT_EQ(Name(PixelFormat::kRgb8), "rgb8");
  EXPECT_EQ(Name(PixelFormat::kLabel16), "label16");
  EXPECT_EQ(Name(PixelFormat::kDepth16), "depth16");
  EXPECT_EQ(Name(PixelFormat::kDepth32), "depth32");
}

TEST(Image, OffsetsRunAlongRowsFromTheTop) {
  const Image image = MakeImage(5, 4, PixelFormat::kRgb8);
  EXPECT_EQ(image.Offset(0, 0), 0u);
  EXPECT_EQ(image.Offset(1, 0), 3u);
  EXPECT_EQ(image.Offset(0, 1), 15u);
  EXPECT_EQ(image.Offset(4, 3) + 3, image.bytes.size());
}

TEST(Image, OffsetsOfTheLargestImageDoNotOverflow) {
  const Image image{16384, 16384, PixelFormat::kDepth32, {}};
  EXPECT_EQ(image.Offset(16383, 16383), size_t{4} * 16384 * 16384 - 4);
}

TEST(Image, DepthInMillimetresIsLittleEndian) {
  Image image = MakeImage(3, 2, PixelFormat::kDepth16);
  const size_t at = image.Offset(2, 1);
  image.bytes[at] = 0x34;
  image.bytes[at + 1] = 0x12;
  EXPECT_FLOAT_EQ(DepthAt(image, 2, 1), 4.660f);
  EXPECT_EQ(DepthAt(image, 0, 0), 0.0f);
  image.bytes[at] = image.bytes[at + 1] = 0xff;
  EXPECT_FLOAT_EQ(DepthAt(image, 2, 1), 65.535f);
}

TEST(Image, DepthInMetresTakesNothingButPositiveNumbers) {
  Image image = MakeImage(3, 2, PixelFormat::kDepth32);
  SetFloat(&image, 1, 1, 2.5f);
  EXPECT_EQ(DepthAt(image, 1, 1), 2.5f);
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float none : {NAN, infinity, -infinity, -1.0f, 0.0f}) {
    SetFloat(&image, 1, 1, none);
    EXPECT_EQ(DepthAt(image, 1, 1), 0.0f) << none;
  }
}

TEST(Image, LabelsHoldClassAboveInstance) {
  Image image = MakeImage(2, 2, PixelFormat::kLabel16);
  const size_t at = image.Offset(1, 0);
  image.bytes[at] = 7;       // instance
  image.bytes[at + 1] = 20;  // class
  EXPECT_EQ(LabelAt(image, 1, 0), 20 << 8 | 7);
  EXPECT_EQ(LabelAt(image, 0, 1), 0);
}

TEST(ImageDeathTest, RefusesToReadDepthOrLabelsFromOtherFormats) {
  const Image gray = MakeImage(2, 2, PixelFormat::kGray8);
  const Image depth = MakeImage(2, 2, PixelFormat::kDepth16);
  EXPECT_DEATH(DepthAt(gray, 0, 0), "broken invariant");
  EXPECT_DEATH(LabelAt(depth, 0, 0), "broken invariant");
}

}  // namespace
}  // namespace dsg::ingest
