// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/picture/raster.h"

#include <png.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

using Glyph = std::array<uint8_t, 7>;

// Rows from the top, five dots each, the leftmost in bit 4; g, p, q and y hang lower.
constexpr std::array<Glyph, 26> kLetters = {{
    {0x00, 0x00, 0x0e, 0x01, 0x0f, 0x11, 0x0f},  // a
    {0x10, 0x10, 0x1e, 0x11, 0x11, 0x11, 0x1e},  // b
    {0x00, 0x00, 0x0e, 0x11, 0x10, 0x11, 0x0e},  // c
    {0x01, 0x01, 0x0f, 0x11, 0x11, 0x11, 0x0f},  // d
    {0x00, 0x00, 0x0e, 0x11, 0x1f, 0x10, 0x0e},  // e
    {0x06, 0x08, 0x1e, 0x08, 0x08, 0x08, 0x08},  // f
    {0x0f, 0x11, 0x11, 0x11, 0x0f, 0x01, 0x0e},  // g
    {0x10, 0x10, 0x1e, 0x11, 0x11, 0x11, 0x11},  // h
    {0x04, 0x00, 0x0c, 0x04, 0x04, 0x04, 0x0e},  // i
    {0x02, 0x00, 0x06, 0x02, 0x02, 0x12, 0x0c},  // j
    {0x10, 0x10, 0x12, 0x14, 0x18, 0x14, 0x12},  // k
    {0x0c, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0e},  // l
    {0x00, 0x00, 0x1a, 0x15, 0x15, 0x15, 0x15},  // m
    {0x00, 0x00, 0x1e, 0x11, 0x11, 0x11, 0x11},  // n
    {0x00, 0x00, 0x0e, 0x11, 0x11, 0x11, 0x0e},  // o
    {0x1e, 0x11, 0x11, 0x11, 0x1e, 0x10, 0x10},  // p
    {0x0f, 0x11, 0x11, 0x11, 0x0f, 0x01, 0x01},  // q
    {0x00, 0x00, 0x16, 0x19, 0x10, 0x10, 0x10},  // r
    {0x00, 0x00, 0x0f, 0x10, 0x0e, 0x01, 0x1e},  // s
    {0x08, 0x08, 0x1e, 0x08, 0x08, 0x08, 0x06},  // t
    {0x00, 0x00, 0x11, 0x11, 0x11, 0x11, 0x0f},  // u
    {0x00, 0x00, 0x11, 0x11, 0x11, 0x0a, 0x04},  // v
    {0x00, 0x00, 0x15, 0x15, 0x15, 0x15, 0x0a},  // w
    {0x00, 0x00, 0x11, 0x0a, 0x04, 0x0a, 0x11},  // x
    {0x11, 0x11, 0x11, 0x11, 0x0f, 0x01, 0x0e},  // y
    {0x00, 0x00, 0x1f, 0x02, 0x04, 0x08, 0x1f},  // z
}};
constexpr std::array<Glyph, 10> kDigits = {{
    {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e},  // 0
    {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e},  // 1
    {0x0e, 0x11, 0x01, 0x06, 0x08, 0x10, 0x1f},  // 2
    {0x1e, 0x01, 0x01, 0x0e, 0x01, 0x01, 0x1e},  // 3
    {0x02, 0x06, 0x0a, 0x12, 0x1f, 0x02, 0x02},  // 4
    {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e},  // 5
    {0x0e, 0x10, 0x1e, 0x11, 0x11, 0x11, 0x0e},  // 6
    {0x1f, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08},  // 7
    {0x0e, 0x11, 0x11, 0x0e, 0x11, 0x11, 0x0e},  // 8
    {0x0e, 0x11, 0x11, 0x0f, 0x01, 0x01, 0x0e},  // 9
}};
constexpr Glyph kBlank = {};
constexpr Glyph kDash = {0x00, 0x00, 0x00, 0x0e, 0x00, 0x00, 0x00};
constexpr Glyph kDot = {0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c};
constexpr int kAdvanceDots = 6;
constexpr int kDescentDots = 2;

const Glyph& GlyphOf(char c) {
  if (c >= 'a' && c <= 'z') return kLetters[static_cast<size_t>(c - 'a')];
  if (c >= '0' && c <= '9') return kDigits[static_cast<size_t>(c - '0')];
  if (c == '-') return kDash;
  return c == '.' ? kDot : kBlank;
}

double DistanceToStroke(const Eigen::Vector2d& point, const Eigen::Vector2d& from,
                        const Eigen::Vector2d& to) {
  const Eigen::Vector2d step = to - from;
  const double length_squared = step.squaredNorm();
  const double along =
      length_squared == 0.0 ? 0.0 : std::clamp((point - from).dot(step) / length_squared, 0.0, 1.0);
  return (point - from - along * step).norm();
}

/// Pixels whose middles may lie in [low, high], cut at the picture.
struct PixelRange {
  PixelRange(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int width, int height)
      : x_begin(std::clamp(static_cast<int>(std::floor(low.x())), 0, width)),
        x_end(std::clamp(static_cast<int>(std::ceil(high.x())) + 1, 0, width)),
        y_begin(std::clamp(static_cast<int>(std::floor(low.y())), 0, height)),
        y_end(std::clamp(static_cast<int>(std::ceil(high.y())) + 1, 0, height)) {}
  int x_begin;
  int x_end;
  int y_begin;
  int y_end;
};

}  // namespace

Paint MakePaint(uint32_t rgb, float opacity) {
  const auto channel = [&](int shift) { return static_cast<float>(rgb >> shift & 0xff) / 255.0f; };
  return {channel(16), channel(8), channel(0), opacity};
}

Canvas::Canvas(int width, int height, const Paint& background) : width_(width), height_(height) {
  DSG_CHECK(width >= 1 && width <= 16384 && height >= 1 && height <= 16384);
  pixels_.resize(3 * static_cast<size_t>(width) * static_cast<size_t>(height));
  for (size_t i = 0; i < pixels_.size(); i += 3) {
    pixels_[i] = background.red;
    pixels_[i + 1] = background.green;
    pixels_[i + 2] = background.blue;
  }
}

void Canvas::Blend(int x, int y, const Paint& paint) {
  float* pixel =
      &pixels_[3 * (static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x))];
  pixel[0] += paint.opacity * (paint.red - pixel[0]);
  pixel[1] += paint.opacity * (paint.green - pixel[1]);
  pixel[2] += paint.opacity * (paint.blue - pixel[2]);
}

void Canvas::FillRect(const Eigen::Vector2d& low, const Eigen::Vector2d& high, const Paint& paint) {
  const PixelRange range(low, high, width_, height_);
  for (int y = range.y_begin; y < range.y_end; ++y) {
    if (y + 0.5 < low.y() || y + 0.5 >= high.y()) continue;
    for (int x = range.x_begin; x < range.x_end; ++x) {
      if (x + 0.5 >= low.x() && x + 0.5 < high.x()) Blend(x, y, paint);
    }
  }
}

void Canvas::FillCircle(const Eigen::Vector2d& center, double radius, const Paint& paint) {
  DrawPolyline({center}, 2.0 * radius, paint);
}

void Canvas::DrawPolyline(const std::vector<Eigen::Vector2d>& points, double width,
                          const Paint& paint) {
  if (points.empty()) return;
  const Eigen::Vector2d reach(0.5 * width, 0.5 * width);
  Eigen::AlignedBox2d bounds;
  for (const Eigen::Vector2d& point : points) bounds.extend(point);
  const PixelRange all(bounds.min() - reach, bounds.max() + reach, width_, height_);
  const auto columns = static_cast<size_t>(all.x_end - all.x_begin);
  // Marked first and painted once, so that a half-transparent stroke is even.
  std::vector<bool> covered(columns * static_cast<size_t>(all.y_end - all.y_begin), false);
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d& from = points[i == 0 ? 0 : i - 1];
    const Eigen::Vector2d& to = points[i];
    const PixelRange range(from.cwiseMin(to) - reach, from.cwiseMax(to) + reach, width_, height_);
    for (int y = range.y_begin; y < range.y_end; ++y) {
      for (int x = range.x_begin; x < range.x_end; ++x) {
        const Eigen::Vector2d middle(x + 0.5, y + 0.5);
        if (DistanceToStroke(middle, from, to) > 0.5 * width) continue;
        const size_t index =
            static_cast<size_t>(y - all.y_begin) * columns + static_cast<size_t>(x - all.x_begin);
        if (!covered[index]) Blend(x, y, paint);
        covered[index] = true;
      }
    }
  }
}

void Canvas::DrawText(const Eigen::Vector2d& low, std::string_view text, double dot,
                      const Paint& paint) {
  Eigen::Vector2d corner = low;
  for (const char c : text) {
    const Glyph& glyph = GlyphOf(c);
    const bool hangs = c == 'g' || c == 'p' || c == 'q' || c == 'y';
    const Eigen::Vector2d top = corner + Eigen::Vector2d(0.0, hangs ? kDescentDots * dot : 0.0);
    for (int row = 0; row < 7; ++row) {
      for (int column = 0; column < 5; ++column) {
        if ((glyph[static_cast<size_t>(row)] >> (4 - column) & 1) == 0) continue;
        const Eigen::Vector2d begin = top + dot * Eigen::Vector2d(column, row);
        FillRect(begin, begin + Eigen::Vector2d(dot, dot), paint);
      }
    }
    corner.x() += kAdvanceDots * dot;
  }
}

double Canvas::TextWidth(std::string_view text, double dot) {
  if (text.empty()) return 0.0;
  return dot * (kAdvanceDots * static_cast<double>(text.size()) - 1.0);
}

Picture Canvas::Halved() const {
  Picture out{std::max(1, width_ / 2), std::max(1, height_ / 2), {}};
  out.rgb.reserve(3 * static_cast<size_t>(out.width) * static_cast<size_t>(out.height));
  const auto at = [&](int x, int y, int channel) {
    const auto column = static_cast<size_t>(std::min(x, width_ - 1));
    const auto row = static_cast<size_t>(std::min(y, height_ - 1));
    return pixels_[3 * (row * static_cast<size_t>(width_) + column) + static_cast<size_t>(channel)];
  };
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const float mean = 0.25f * (at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) +
                                    at(2 * x, 2 * y + 1, c) + at(2 * x + 1, 2 * y + 1, c));
        out.rgb.push_back(static_cast<uint8_t>(std::clamp(std::lround(255.0f * mean), 0l, 255l)));
      }
    }
  }
  return out;
}

absl::StatusOr<std::string> EncodePng(const Picture& picture) {
  png_image image;
  std::memset(&image, 0, sizeof(image));
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  std::string out(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = out.size();
  if (png_image_write_to_memory(&image, out.data(), &size, 0, picture.rgb.data(), 0, nullptr) ==
      0) {
    return absl::InternalError(absl::StrCat("cannot encode a picture as PNG: ", image.message));
  }
  out.resize(size);
  return out;
}

}  // namespace dsg::simulator
