// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/ros_image.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

/// Where the parts of a pixel lie.
struct Encoding {
  int byte_count = 0;
  /// Offsets of red, green and blue; all zero for one channel.
  int red = 0;
  int green = 0;
  int blue = 0;
  bool is_color = false;
  bool is_float = false;
};

std::optional<Encoding> FindEncoding(const std::string& name) {
  if (name == "mono8" || name == "8UC1") return Encoding{.byte_count = 1};
  if (name == "mono16" || name == "16UC1") return Encoding{.byte_count = 2};
  if (name == "32FC1") return Encoding{.byte_count = 4, .is_float = true};
  if (name == "rgb8") {
    return Encoding{.byte_count = 3, .red = 0, .green = 1, .blue = 2, .is_color = true};
  }
  if (name == "bgr8" || name == "8UC3") {
    return Encoding{.byte_count = 3, .red = 2, .green = 1, .blue = 0, .is_color = true};
  }
  if (name == "rgba8") {
    return Encoding{.byte_count = 4, .red = 0, .green = 1, .blue = 2, .is_color = true};
  }
  if (name == "bgra8") {
    return Encoding{.byte_count = 4, .red = 2, .green = 1, .blue = 0, .is_color = true};
  }
  return std::nullopt;
}

absl::Status CheckSize(const RosImage& image, const Encoding& encoding, const std::string& origin) {
  const uint64_t pixel_count = uint64_t{image.width} * image.height;
  if (pixel_count < 1 || pixel_count > static_cast<uint64_t>(kImagePixelsMax)) {
    return MalformedFile(origin, absl::StrCat("the image is ", image.width, " x ", image.height,
                                              " pixels; 1 to ", kImagePixelsMax, " are read"));
  }
  const uint64_t row_bytes = uint64_t{image.width} * static_cast<uint64_t>(encoding.byte_count);
  if (image.step < row_bytes || uint64_t{image.step} * image.height != image.data.size()) {
    return MalformedFile(
        origin,
        absl::StrCat("the image has ", image.data.size(), " bytes and rows of ", image.step, "; ",
                     image.width, " x ", image.height, " ", image.encoding, " needs others"));
  }
  return absl::OkStatus();
}

// Calls visit(source pixel, index of the pixel), row by row.
template <typename Visit>
void ForEachPixel(const RosImage& image, const Encoding& encoding, const Visit& visit) {
  size_t index = 0;
  for (uint32_t row = 0; row < image.height; ++row) {
    const char* pixel = image.data.data() + size_t{row} * image.step;
    for (uint32_t column = 0; column < image.width; ++column) {
      visit(reinterpret_cast<const uint8_t*>(pixel), index++);
      pixel += encoding.byte_count;
    }
  }
}

Image EmptyImage(const RosImage& image, PixelFormat format) {
  Image result{.width = static_cast<int>(image.width),
               .height = static_cast<int>(image.height),
               .format = format,
               .bytes = {}};
  result.bytes.resize(static_cast<size_t>(BytesPerPixel(format)) * image.width * image.height);
  return result;
}

Image CopyRows(const RosImage& image, const Encoding& encoding, PixelFormat format) {
  Image result = EmptyImage(image, format);
  const size_t row_bytes = size_t{image.width} * static_cast<size_t>(encoding.byte_count);
  for (uint32_t row = 0; row < image.height; ++row) {
    std::memcpy(result.bytes.data() + row * row_bytes, image.data.data() + size_t{row} * image.step,
                row_bytes);
  }
  if (image.is_big_endian && encoding.byte_count > 1) {
    const auto size = static_cast<size_t>(encoding.byte_count);
    for (size_t i = 0; i + size <= result.bytes.size(); i += size) {
      std::reverse(result.bytes.begin() + static_cast<std::ptrdiff_t>(i),
                   result.bytes.begin() + static_cast<std::ptrdiff_t>(i + size));
    }
  }
  return result;
}

// The weights of ITU-R BT.601, which OpenCV has too.
Image ToGray(const RosImage& image, const Encoding& e) {
  if (!e.is_color) return CopyRows(image, e, PixelFormat::kGray8);
  Image result = EmptyImage(image, PixelFormat::kGray8);
  ForEachPixel(image, e, [&](const uint8_t* pixel, size_t i) {
    const int sum = 299 * pixel[e.red] + 587 * pixel[e.green] + 114 * pixel[e.blue];
    result.bytes[i] = static_cast<uint8_t>((sum + 500) / 1000);
  });
  return result;
}

Image ToColor(const RosImage& image, const Encoding& e) {
  Image result = EmptyImage(image, PixelFormat::kRgb8);
  ForEachPixel(image, e, [&](const uint8_t* pixel, size_t i) {
    result.bytes[3 * i] = pixel[e.red];
    result.bytes[3 * i + 1] = pixel[e.green];
    result.bytes[3 * i + 2] = pixel[e.blue];
  });
  return result;
}

Image ToLabel(const RosImage& image, const Encoding& e,
              const std::map<uint32_t, int32_t>& class_of_color) {
  Image result = EmptyImage(image, PixelFormat::kLabel16);
  // Neighbours mostly have one colour.
  uint32_t last_rgb = UINT32_MAX;
  uint8_t last_class = 0;
  ForEachPixel(image, e, [&](const uint8_t* pixel, size_t i) {
    const uint32_t rgb =
        static_cast<uint32_t>(pixel[e.red] << 16 | pixel[e.green] << 8 | pixel[e.blue]);
    if (rgb != last_rgb) {
      const auto found = class_of_color.find(rgb);
      last_rgb = rgb;
      last_class = found == class_of_color.end() ? 0 : static_cast<uint8_t>(found->second);
    }
    result.bytes[2 * i] = 0;
    result.bytes[2 * i + 1] = last_class;
  });
  return result;
}

// What compressed_depth_image_transport puts before its PNG: a number, and the two parameters of
// inverse depth, each of four bytes.
constexpr size_t kDepthHeaderBytes = 12;

float FloatAt(std::string_view bytes, size_t at) {
  float value = 0.0f;
  std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

// Zero stays what it is: no reading.
Image FromInverseDepth(const Image& inverse, float a, float b) {
  Image result{.width = inverse.width,
               .height = inverse.height,
               .format = PixelFormat::kDepth32,
               .bytes = std::vector<uint8_t>(2 * inverse.bytes.size())};
  for (size_t i = 0; 2 * i + 1 < inverse.bytes.size(); ++i) {
    uint16_t raw = 0;
    std::memcpy(&raw, inverse.bytes.data() + 2 * i, sizeof(raw));
    const float depth = raw == 0 ? 0.0f : a / (static_cast<float>(raw) - b);
    const float metres = std::isfinite(depth) && depth > 0.0f ? depth : 0.0f;
    std::memcpy(result.bytes.data() + 4 * i, &metres, sizeof(metres));
  }
  return result;
}

}  // namespace

absl::StatusOr<Image> ToImage(const RosCompressedImage& image, const ImageDecoding& decoding,
                              const std::string& origin) {
  if (image.format.find("compressedDepth") == std::string::npos) {
    return DecodeImage(image.data, origin, decoding);
  }
  if (decoding.role != ImageRole::kDepth) {
    return MalformedFile(origin, "the image is compressed depth, which its channel does not have");
  }
  if (image.format.find("rvl") != std::string::npos) {
    return MalformedFile(origin,
                         "the depth is compressed by RVL, which is not read; record it as PNG");
  }
  if (image.data.size() <= kDepthHeaderBytes) {
    return MalformedFile(origin, "the compressed depth is cut short");
  }
  const std::string_view png = image.data.substr(kDepthHeaderBytes);
  if (!image.format.starts_with("32FC1")) return DecodeImage(png, origin, decoding);
  ImageDecoding plain = decoding;
  plain.depth_units_per_m = 1000.0;
  plain.is_max_no_reading = false;
  DSG_ASSIGN_OR_RETURN(const Image inverse, DecodeImage(png, origin, plain));
  if (inverse.format != PixelFormat::kDepth16) {
    return MalformedFile(origin, "inverse depth has 16 bits; the message is of another kind");
  }
  return FromInverseDepth(inverse, FloatAt(image.data, 4), FloatAt(image.data, 8));
}

absl::StatusOr<Image> ToImage(const RosImage& image, const ImageDecoding& decoding,
                              const std::map<uint32_t, int32_t>& class_of_color,
                              const std::string& origin) {
  const std::optional<Encoding> encoding = FindEncoding(image.encoding);
  if (!encoding.has_value()) {
    return MalformedFile(origin,
                         absl::StrCat("the image's encoding is \"", image.encoding.substr(0, 32),
                                      "\"; mono8, rgb8, bgr8, rgba8, bgra8, 16UC1, mono16 and "
                                      "32FC1 are known"));
  }
  DSG_RETURN_IF_ERROR(CheckSize(image, *encoding, origin));
  const bool is_eight_bit = encoding->byte_count == 1 || encoding->is_color;
  const bool is_sixteen_bit = encoding->byte_count == 2;
  switch (decoding.role) {
    case ImageRole::kGray:
      if (is_eight_bit) return ToGray(image, *encoding);
      break;
    case ImageRole::kColor:
      if (is_eight_bit) return ToColor(image, *encoding);
      break;
    case ImageRole::kDepth:
      if (encoding->is_float) return CopyRows(image, *encoding, PixelFormat::kDepth32);
      if (is_sixteen_bit) {
        return ScaleDepth(CopyRows(image, *encoding, PixelFormat::kDepth16), decoding);
      }
      break;
    case ImageRole::kLabel:
      if (is_sixteen_bit) return CopyRows(image, *encoding, PixelFormat::kLabel16);
      if (encoding->is_color) return ToLabel(image, *encoding, class_of_color);
      break;
  }
  return MalformedFile(origin, absl::StrCat("the image's encoding ", image.encoding,
                                            " does not fit what its channel measures"));
}

}  // namespace dsg::ingest
