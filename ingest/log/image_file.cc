// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/image_file.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// 16 Mpx of floats, not compressed, and their header.
constexpr uintmax_t kImageBytesMax = 80'000'000;
// JPEGs may carry a thumbnail and colour profiles before their size.
constexpr size_t kImageHeaderBytesMax = size_t{1} << 20;

int FlagsOf(ImageRole role) {
  switch (role) {
    case ImageRole::kGray:
      return cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION;
    case ImageRole::kColor:
      return cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION;
    case ImageRole::kDepth:
    case ImageRole::kLabel:
      return cv::IMREAD_UNCHANGED;
  }
  return cv::IMREAD_UNCHANGED;
}

// Every exception of OpenCV and its codecs ends here.
cv::Mat Decode(std::string_view bytes, ImageRole role) {
  try {
    // The caller reports; OpenCV's own lines on stderr would come on top.
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    const cv::Mat input(1, static_cast<int>(bytes.size()), CV_8UC1,
                        const_cast<char*>(bytes.data()));
    return cv::imdecode(input, FlagsOf(role));
  } catch (const std::exception&) {
    return {};
  }
}

Image Copy(const cv::Mat& mat, PixelFormat format) {
  Image image{.width = mat.cols, .height = mat.rows, .format = format, .bytes = {}};
  const size_t row_bytes = mat.elemSize() * static_cast<size_t>(mat.cols);
  image.bytes.resize(row_bytes * static_cast<size_t>(mat.rows));
  for (int row = 0; row < mat.rows; ++row) {
    std::memcpy(image.bytes.data() + image.Offset(0, row), mat.ptr(row), row_bytes);
  }
  return image;
}

void SwapRedAndBlue(Image* image) {
  for (size_t i = 0; i + 2 < image->bytes.size(); i += 3) {
    std::swap(image->bytes[i], image->bytes[i + 2]);
  }
}

// Requires: one channel, of 8 or 16 bits.
Image Labels(const cv::Mat& mat, const ImageDecoding& decoding) {
  cv::Mat numbers;
  mat.convertTo(numbers, CV_16U);
  Image image = Copy(numbers, PixelFormat::kLabel16);
  for (size_t i = 0; i + 1 < image.bytes.size(); i += 2) {
    uint16_t value = 0;
    std::memcpy(&value, image.bytes.data() + i, sizeof(value));
    value = (*decoding.label_of_id)[value];
    std::memcpy(image.bytes.data() + i, &value, sizeof(value));
  }
  return image;
}

absl::StatusOr<Image> Convert(const cv::Mat& mat, const std::string& origin,
                              const ImageDecoding& decoding) {
  switch (decoding.role) {
    case ImageRole::kGray:
      if (mat.type() == CV_8UC1) return Copy(mat, PixelFormat::kGray8);
      break;
    case ImageRole::kColor:
      if (mat.type() == CV_8UC3) {
        Image image = Copy(mat, PixelFormat::kRgb8);
        SwapRedAndBlue(&image);
        return image;
      }
      break;
    case ImageRole::kDepth:
      if (mat.type() == CV_32FC1) return Copy(mat, PixelFormat::kDepth32);
      if (mat.type() == CV_16UC1) return ScaleDepth(Copy(mat, PixelFormat::kDepth16), decoding);
      break;
    case ImageRole::kLabel:
      if (decoding.label_of_id != nullptr && (mat.type() == CV_8UC1 || mat.type() == CV_16UC1)) {
        return Labels(mat, decoding);
      }
      if (mat.type() == CV_16UC1) return Copy(mat, PixelFormat::kLabel16);
      break;
  }
  return MalformedFile(
      origin,
      absl::StrCat(
          "the image has ", mat.channels(), " channels of ", mat.elemSize1() * 8,
          " bits, which is not what its channel has: depth is 16 bit or "
          "float, labels are numbers of 16 bit (of a label folder also 8) in one channel, grey and "
          "colour 8 bit"));
}

absl::StatusOr<std::string> ReadBytes(const std::string& path, size_t byte_count_max) {
  std::error_code error;
  // Opening a pipe would wait for its other end.
  const uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream in;
  if (!error) in.open(path, std::ios::binary);
  if (!in.is_open()) return MalformedFile(path, "the image cannot be read; was it moved?");
  if (size > kImageBytesMax) {
    return MalformedFile(path, absl::StrCat("the image file has ", size, " bytes; at most ",
                                            kImageBytesMax, " are read"));
  }
  std::string bytes(std::min<size_t>(size, byte_count_max), '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<size_t>(in.gcount()));
  return bytes;
}

}  // namespace

Image ScaleDepth(const Image& image, const ImageDecoding& decoding) {
  Image result = image;
  const bool is_metres = decoding.depth_units_per_m != 1000.0;
  if (is_metres) {
    result.format = PixelFormat::kDepth32;
    result.bytes.resize(2 * image.bytes.size());
  }
  for (size_t i = 0; 2 * i + 1 < image.bytes.size(); ++i) {
    uint16_t raw = 0;
    std::memcpy(&raw, image.bytes.data() + 2 * i, sizeof(raw));
    if (raw == 65535 && decoding.is_max_no_reading) raw = 0;
    if (is_metres) {
      const float metres = static_cast<float>(raw / decoding.depth_units_per_m);
      std::memcpy(result.bytes.data() + 4 * i, &metres, sizeof(metres));
    } else {
      std::memcpy(result.bytes.data() + 2 * i, &raw, sizeof(raw));
    }
  }
  return result;
}

absl::StatusOr<Image> DecodeImage(std::string_view bytes, const std::string& origin,
                                  const ImageDecoding& decoding) {
  DSG_ASSIGN_OR_RETURN(const ImageHeader header, ReadImageHeader(bytes, origin));
  if (bytes.size() > kImageBytesMax) {
    return MalformedFile(origin, "the compressed image is too large");
  }
  const bool is_eight_bit = decoding.role == ImageRole::kGray || decoding.role == ImageRole::kColor;
  if (is_eight_bit && header.bits_per_channel > 8) {
    return MalformedFile(origin, absl::StrCat("the image has ", header.bits_per_channel,
                                              " bits a channel; grey and colour have 8"));
  }
  // A decoder spreads few bits over eight, and looks colours up in the palette.
  const bool has_numbers = header.bits_per_channel >= 8 && !header.is_palette;
  if (decoding.role == ImageRole::kLabel && !has_numbers) {
    return MalformedFile(
        origin,
        absl::StrCat("labels are numbers of 8 or 16 bits in one channel; these are ",
                     header.is_palette ? "colours of a palette"
                                       : absl::StrCat("of ", header.bits_per_channel, " bits"),
                     ": save the numbers themselves"));
  }
  const cv::Mat mat = Decode(bytes, decoding.role);
  if (mat.empty() || mat.cols != header.width || mat.rows != header.height) {
    return MalformedFile(origin,
                         "the image does not decode; it is damaged or cut short: copy it again");
  }
  return Convert(mat, origin, decoding);
}

absl::StatusOr<Image> LoadImageFile(const std::string& path, const ImageDecoding& decoding) {
  DSG_ASSIGN_OR_RETURN(const std::string bytes, ReadBytes(path, kImageBytesMax));
  return DecodeImage(bytes, path, decoding);
}

absl::StatusOr<ImageHeader> LoadImageHeader(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const std::string bytes, ReadBytes(path, kImageHeaderBytesMax));
  return ReadImageHeader(bytes, path);
}

}  // namespace dsg::ingest
