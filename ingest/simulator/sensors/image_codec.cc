// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/image_codec.h"

#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

using ingest::Image;
using ingest::PixelFormat;

int TypeOf(PixelFormat format) {
  switch (format) {
    case PixelFormat::kGray8:
      return CV_8UC1;
    case PixelFormat::kRgb8:
      return CV_8UC3;
    case PixelFormat::kLabel16:
    case PixelFormat::kDepth16:
      return CV_16UC1;
    case PixelFormat::kDepth32:
    case PixelFormat::kPoints32:
      break;
  }
  DSG_CHECK(false && "no codec for this pixel format");
  return 0;
}

absl::StatusOr<std::string> Encode(const char* ending, const Image& image,
                                   const std::vector<int>& parameters) {
  std::vector<uint8_t> bytes;
  try {
    // The library writes through no const view, but only reads.
    const cv::Mat view(image.height, image.width, TypeOf(image.format),
                       const_cast<uint8_t*>(image.bytes.data()));
    // Not assigned before: it would share the caller's bytes, and be turned in place.
    cv::Mat ordered;
    if (image.format == PixelFormat::kRgb8) {
      cv::cvtColor(view, ordered, cv::COLOR_RGB2BGR);
    } else {
      ordered = view;
    }
    if (cv::imencode(ending, ordered, bytes, parameters)) {
      return std::string(bytes.begin(), bytes.end());
    }
  } catch (const cv::Exception& error) {
    return absl::InternalError(absl::StrCat("cannot encode an image: ", error.what()));
  }
  return absl::InternalError(
      absl::StrCat("cannot encode a ", std::string(Name(image.format)), " image as ", ending));
}

// A PNG tells its size in its first bytes; what is larger than any camera's is not decoded.
absl::Status CheckPngSize(const std::string& path) {
  constexpr uint64_t kPixelsMax = 16'000'000;
  std::ifstream in(path, std::ios::binary);
  unsigned char head[24] = {};
  in.read(reinterpret_cast<char*>(head), sizeof head);
  if (!in || std::memcmp(head, "\x89PNG", 4) != 0) return absl::OkStatus();
  const auto number = [&head](int at) {
    return uint64_t{head[at]} << 24 | uint64_t{head[at + 1]} << 16 | uint64_t{head[at + 2]} << 8 |
           uint64_t{head[at + 3]};
  };
  if (number(16) * number(20) <= kPixelsMax) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(path, " has ", number(16), " x ", number(20),
                                          " pixels; at most 16 million are read"));
}

}  // namespace

absl::StatusOr<std::string> EncodePng(const Image& image) {
  return Encode(".png", image, {cv::IMWRITE_PNG_COMPRESSION, 1});
}

absl::StatusOr<std::string> EncodeJpeg(const Image& image, int quality) {
  return Encode(".jpg", image, {cv::IMWRITE_JPEG_QUALITY, quality});
}

absl::StatusOr<Image> DecodeFile(const std::string& path, PixelFormat format) {
  const int type = TypeOf(format);
  DSG_RETURN_IF_ERROR(CheckPngSize(path));
  cv::Mat mat;
  try {
    mat = cv::imread(path, type == CV_16UC1  ? cv::IMREAD_UNCHANGED
                           : type == CV_8UC1 ? cv::IMREAD_GRAYSCALE
                                             : cv::IMREAD_COLOR);
    if (!mat.empty() && type == CV_8UC3) cv::cvtColor(mat, mat, cv::COLOR_BGR2RGB);
  } catch (const cv::Exception& error) {
    return absl::DataLossError(absl::StrCat(path, ": cannot be decoded: ", error.what()));
  }
  if (mat.empty()) return absl::NotFoundError(absl::StrCat(path, " is missing or no image"));
  if (mat.type() != type || !mat.isContinuous()) {
    return absl::DataLossError(absl::StrCat(path, " is no ", std::string(Name(format)), " image"));
  }
  Image image{mat.cols, mat.rows, format, {}};
  image.bytes.assign(mat.datastart, mat.dataend);
  return image;
}

}  // namespace dsg::simulator
