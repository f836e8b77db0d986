// SPDX-License-Identifier: Apache-2.0
#include "ingest/sensor/image.h"

#include <cmath>
#include <cstring>

#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

uint16_t Read16(const Image& image, int column, int row) {
  const uint8_t* at = image.bytes.data() + image.Offset(column, row);
  return static_cast<uint16_t>(at[0] | (at[1] << 8));
}

}  // namespace

int BytesPerPixel(PixelFormat format) {
  switch (format) {
    case PixelFormat::kGray8:
      return 1;
    case PixelFormat::kLabel16:
    case PixelFormat::kDepth16:
      return 2;
    case PixelFormat::kRgb8:
      return 3;
    case PixelFormat::kDepth32:
      return 4;
    case PixelFormat::kPoints32:
      return 12;
  }
  DSG_CHECK(false && "no such pixel format");
  return 0;
}

std::string_view Name(PixelFormat format) {
  switch (format) {
    case PixelFormat::kGray8:
      return "gray8";
    case PixelFormat::kRgb8:
      return "rgb8";
    case PixelFormat::kLabel16:
      return "label16";
    case PixelFormat::kDepth16:
      return "depth16";
    case PixelFormat::kDepth32:
      return "depth32";
    case PixelFormat::kPoints32:
      return "points32";
  }
  DSG_CHECK(false && "no such pixel format");
  return "";
}

float DepthAt(const Image& image, int column, int row) {
  if (image.format == PixelFormat::kDepth16) {
    return 0.001f * static_cast<float>(Read16(image, column, row));
  }
  DSG_CHECK(image.format == PixelFormat::kDepth32);
  float metres = 0.0f;
  std::memcpy(&metres, image.bytes.data() + image.Offset(column, row), sizeof metres);
  return metres > 0.0f && metres <= kDepthMaxM ? metres : 0.0f;
}

Eigen::Vector3f PointAt(const Image& image, int column, int row) {
  DSG_CHECK(image.format == PixelFormat::kPoints32);
  Eigen::Vector3f point;
  std::memcpy(point.data(), image.bytes.data() + image.Offset(column, row), 3 * sizeof(float));
  return point;
}

uint16_t LabelAt(const Image& image, int column, int row) {
  DSG_CHECK(image.format == PixelFormat::kLabel16);
  return Read16(image, column, row);
}

}  // namespace dsg::ingest
