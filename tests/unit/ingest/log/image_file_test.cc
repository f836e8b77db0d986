// SPDX-License-Identifier: Apache-2.0
// Images: sizes from headers, pixels of each role, and broken files.
#include "ingest/log/image_file.h"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

std::string Encode(const std::string& ending, const cv::Mat& mat) {
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(ending, mat, bytes));
  return {bytes.begin(), bytes.end()};
}

ImageDecoding Decoding(ImageRole role) { return {.role = role}; }

// The header of a PNG that claims to be of a size.
std::string HugePng(uint32_t width, uint32_t height) {
  std::string bytes = Encode(".png", cv::Mat(2, 2, CV_8UC1, cv::Scalar(1)));
  for (int i = 0; i < 4; ++i) {
    bytes[16 + static_cast<size_t>(i)] = static_cast<char>(width >> (24 - 8 * i) & 0xff);
    bytes[20 + static_cast<size_t>(i)] = static_cast<char>(height >> (24 - 8 * i) & 0xff);
  }
  return bytes;
}

TEST(ImageHeader, ReadsSizesOfAllFormats) {
  const cv::Mat color(5, 7, CV_8UC3, cv::Scalar(10, 20, 30));
  for (const char* ending : {".png", ".jpg", ".tiff"}) {
    const auto header = ReadImageHeader(Encode(ending, color), "x");
    ASSERT_TRUE(header.ok()) << ending << header.status();
    EXPECT_EQ(header->width, 7);
    EXPECT_EQ(header->height, 5);
    EXPECT_EQ(header->channel_count, 3);
    EXPECT_EQ(header->bits_per_channel, 8);
  }
  const auto depth = ReadImageHeader(Encode(".png", cv::Mat(5, 7, CV_16UC1)), "x");
  EXPECT_EQ(depth->bits_per_channel, 16);
  const auto metres = ReadImageHeader(Encode(".tiff", cv::Mat(5, 7, CV_32FC1)), "x");
  EXPECT_EQ(metres->bits_per_channel, 32);
}

TEST(ImageHeader, RefusesHugeImagesBeforeTheyAreDecoded) {
  for (const auto& [width, height] : {std::pair(100'000u, 100'000u), std::pair(0xffffffffu, 1u),
                                      std::pair(0u, 5u), std::pair(4001u, 4000u)}) {
    const absl::Status status =
        DecodeImage(HugePng(width, height), "big.png", Decoding(ImageRole::kGray)).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << width;
  }
  EXPECT_TRUE(ReadImageHeader(HugePng(4000, 4000), "x").ok());
  EXPECT_FALSE(ReadImageHeader("BM this is a bitmap", "x").ok());
  EXPECT_FALSE(ReadImageHeader("", "x").ok());
}

TEST(ImageFile, GivesPixelsOfEachRole) {
  const TempFolder folder;
  const std::string color = Encode(".png", cv::Mat(2, 3, CV_8UC3, cv::Scalar(30, 20, 10)));
  const auto rgb = LoadImageFile(folder.Write("c.png", color), Decoding(ImageRole::kColor));
  ASSERT_TRUE(rgb.ok()) << rgb.status();
  EXPECT_EQ(rgb->bytes[0], 10);
  EXPECT_EQ(rgb->bytes[2], 30);
  const auto gray = LoadImageFile(folder.Path("c.png"), Decoding(ImageRole::kGray));
  ASSERT_TRUE(gray.ok()) << gray.status();
  EXPECT_EQ(gray->format, PixelFormat::kGray8);
  EXPECT_EQ(gray->bytes.size(), 6u);

  const std::string depth = Encode(".png", cv::Mat(2, 3, CV_16UC1, cv::Scalar(1234)));
  const auto millimetres = DecodeImage(depth, "d", Decoding(ImageRole::kDepth));
  ASSERT_TRUE(millimetres.ok()) << millimetres.status();
  EXPECT_EQ(millimetres->format, PixelFormat::kDepth16);
  EXPECT_FLOAT_EQ(DepthAt(*millimetres, 2, 1), 1.234f);
  const auto scaled =
      DecodeImage(depth, "d", {.role = ImageRole::kDepth, .depth_units_per_m = 6553.5});
  EXPECT_EQ(scaled->format, PixelFormat::kDepth32);
  EXPECT_FLOAT_EQ(DepthAt(*scaled, 2, 1), 1234.0f / 6553.5f);
  const auto label = DecodeImage(depth, "d", Decoding(ImageRole::kLabel));
  EXPECT_EQ(LabelAt(*label, 0, 0), 1234);

  const auto metres = DecodeImage(Encode(".tiff", cv::Mat(2, 3, CV_32FC1, cv::Scalar(2.5))), "d",
                                  Decoding(ImageRole::kDepth));
  ASSERT_TRUE(metres.ok()) << metres.status();
  EXPECT_EQ(DepthAt(*metres, 1, 1), 2.5f);
}

TEST(ImageFile, TakesTheLargestDepthForNoReadingWhereThatIsTheCustom) {
  const std::string bytes = Encode(".png", cv::Mat(1, 1, CV_16UC1, cv::Scalar(65535)));
  ImageDecoding decoding = Decoding(ImageRole::kDepth);
  EXPECT_GT(DepthAt(*DecodeImage(bytes, "d", decoding), 0, 0), 65.0f);
  decoding.is_max_no_reading = true;
  EXPECT_EQ(DepthAt(*DecodeImage(bytes, "d", decoding), 0, 0), 0.0f);
}

TEST(ImageFile, RefusesImagesThatAreNotWhatTheirChannelHas) {
  const std::string gray = Encode(".png", cv::Mat(2, 3, CV_8UC1, cv::Scalar(1)));
  const std::string deep = Encode(".png", cv::Mat(2, 3, CV_16UC1, cv::Scalar(1)));
  EXPECT_FALSE(DecodeImage(gray, "x", Decoding(ImageRole::kDepth)).ok());
  EXPECT_FALSE(DecodeImage(gray, "x", Decoding(ImageRole::kLabel)).ok());
  EXPECT_FALSE(DecodeImage(deep, "x", Decoding(ImageRole::kGray)).ok());
  EXPECT_FALSE(DecodeImage(deep, "x", Decoding(ImageRole::kColor)).ok());
  const TempFolder folder;
  EXPECT_FALSE(LoadImageFile(folder.Path("none.png"), Decoding(ImageRole::kGray)).ok());
}

TEST(ImageFile, SurvivesAnyCutAndAnyChangedByte) {
  constexpr unsigned kSeed = 19920918;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  cv::Mat noise(8, 9, CV_8UC3);
  for (int i = 0; i < noise.rows * noise.cols * 3; ++i) {
    noise.data[i] = static_cast<uint8_t>(random() % 256);
  }
  const std::pair<std::string, ImageRole> images[] = {
      {Encode(".png", noise), ImageRole::kColor},
      {Encode(".jpg", noise), ImageRole::kColor},
      {Encode(".tiff", cv::Mat(8, 9, CV_32FC1, cv::Scalar(1.5))), ImageRole::kDepth}};
  for (const auto& [bytes, role] : images) {
    ASSERT_TRUE(DecodeImage(bytes, "x", Decoding(role)).ok());
    for (size_t size = 0; size < bytes.size(); size += 3) {
      (void)DecodeImage(bytes.substr(0, size), "x", Decoding(role));
    }
    for (int i = 0; i < 400; ++i) {
      std::string changed = bytes;
      changed[random() % changed.size()] = static_cast<char>(random() % 256);
      const auto image = DecodeImage(changed, "x", Decoding(role));
      if (image.ok()) {
        EXPECT_LE(int64_t{image->width} * image->height, kImagePixelsMax);
      }
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
