// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/image_codec.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "schema/base/random.h"
#include "tests/support/temp_folder.h"

namespace dsg::simulator {
namespace {

using ingest::Image;
using ingest::PixelFormat;

Image RandomImage(PixelFormat format) {
  Image image{33, 17, format, {}};
  image.bytes.resize(static_cast<size_t>(33 * 17 * BytesPerPixel(format)));
  Random random(11, static_cast<uint64_t>(format));
  for (uint8_t& byte : image.bytes) byte = static_cast<uint8_t>(random.Index(256));
  return image;
}

std::string Write(const test::TempFolder& folder, const std::string& name,
                  const std::string& bytes) {
  const std::string path = folder.path() + "/" + name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

TEST(ImageCodec, KeepsEachPixelInPng) {
  const test::TempFolder folder;
  for (const PixelFormat format :
       {PixelFormat::kGray8, PixelFormat::kRgb8, PixelFormat::kLabel16, PixelFormat::kDepth16}) {
    const Image image = RandomImage(format);
    const auto bytes = EncodePng(image);
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    const auto read = DecodeFile(Write(folder, "image.png", *bytes), format);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->bytes, image.bytes) << Name(format);
    EXPECT_EQ(read->width, 33);
    EXPECT_EQ(read->height, 17);
  }
}

TEST(ImageCodec, StaysCloseInJpeg) {
  const test::TempFolder folder;
  Image image{64, 48, PixelFormat::kRgb8, {}};
  for (int i = 0; i < 64 * 48; ++i) {
    for (const int value : {i % 64 * 3, 90, 200 - i / 64}) {
      image.bytes.push_back(static_cast<uint8_t>(value));
    }
  }
  const auto bytes = EncodeJpeg(image, 92);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const auto read = DecodeFile(Write(folder, "image.jpg", *bytes), PixelFormat::kRgb8);
  ASSERT_TRUE(read.ok()) << read.status();
  for (size_t i = 0; i < image.bytes.size(); ++i) {
    EXPECT_NEAR(read->bytes[i], image.bytes[i], 12) << i;
  }
}

TEST(ImageCodec, RefusesFilesThatAreNoImageOrAnother) {
  const test::TempFolder folder;
  EXPECT_FALSE(DecodeFile(folder.path() + "/missing.png", PixelFormat::kGray8).ok());
  EXPECT_FALSE(DecodeFile(Write(folder, "text.png", "no image"), PixelFormat::kGray8).ok());
  const auto gray = EncodePng(RandomImage(PixelFormat::kGray8));
  EXPECT_FALSE(DecodeFile(Write(folder, "gray.png", *gray), PixelFormat::kDepth16).ok());
}

}  // namespace
}  // namespace dsg::simulator
