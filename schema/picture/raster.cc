// SPDX-License-Identifier: Apache-2.0
#include "schema/picture/raster.h"

#include <png.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "schema/base/check.h"
#include "schema/picture/font.h"

namespace dsg::picture {
namespace {

double DistanceToStroke(const Eigen::Vector2d& point, const Eigen::Vector2d& from,
                        const Eigen::Vector2d& to) {
  const Eigen::Vector2d step = to - from;
  const double length_squared = step.squaredNorm();
  const double along =
      length_squared == 0.0 ? 0.0 : std::clamp((point - from).dot(step) / length_squared, 0.0, 1.0);
  return (point - from - along * step).norm();
}

/// Where the row `y` cuts the outline, ascending.
void FindCrossings(const std::vector<Eigen::Vector2d>& corners, double y,
                   std::vector<double>* crossings) {
  crossings->clear();
  for (size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& from = corners[i];
    const Eigen::Vector2d& to = corners[i + 1 == corners.size() ? 0 : i + 1];
    if ((from.y() <= y) == (to.y() <= y)) continue;
    const double fraction = (y - from.y()) / (to.y() - from.y());
    crossings->push_back(from.x() + fraction * (to.x() - from.x()));
  }
  std::sort(crossings->begin(), crossings->end());
}

/// Pixels whose middles may lie in [low, high], cut at the picture.
struct PixelRange {
  PixelRange(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int width, int height)
      : x_begin(Cut(std::floor(low.x()), width)),
        x_end(Cut(std::ceil(high.x()) + 1.0, width)),
        y_begin(Cut(std::floor(low.y()), height)),
        y_end(Cut(std::ceil(high.y()) + 1.0, height)) {}
  static int Cut(double pixel, int size) {
    return static_cast<int>(std::clamp(pixel, 0.0, static_cast<double>(size)));
  }
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

Canvas::Canvas(const Picture& background)
    : Canvas(2 * background.width, 2 * background.height, Paint()) {
  DSG_CHECK(4 * background.rgb.size() == pixels_.size());
  for (size_t i = 0; i < pixels_.size(); ++i) {
    const size_t channel = i % 3;
    const size_t column = i / 3 % static_cast<size_t>(width_) / 2;
    const size_t row = i / 3 / static_cast<size_t>(width_) / 2;
    const size_t from = row * static_cast<size_t>(background.width) + column;
    pixels_[i] = static_cast<float>(background.rgb[3 * from + channel]) / 255.0f;
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

void Canvas::FillPolygon(const std::vector<Eigen::Vector2d>& corners, const Paint& paint) {
  if (corners.size() < 3) return;
  Eigen::AlignedBox2d bounds;
  for (const Eigen::Vector2d& corner : corners) bounds.extend(corner);
  const PixelRange range(bounds.min(), bounds.max(), width_, height_);
  std::vector<double> crossings;
  for (int y = range.y_begin; y < range.y_end; ++y) {
    FindCrossings(corners, y + 0.5, &crossings);
    for (size_t i = 0; i + 1 < crossings.size(); i += 2) {
      // Pixels whose middles lie in [from, to), so that neighbours neither overlap nor gape.
      const double width = width_;
      const int begin = static_cast<int>(std::ceil(std::clamp(crossings[i] - 0.5, 0.0, width)));
      const int end = static_cast<int>(std::ceil(std::clamp(crossings[i + 1] - 0.5, 0.0, width)));
      for (int x = begin; x < end; ++x) Blend(x, y, paint);
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

void Canvas::DrawOutline(std::vector<Eigen::Vector2d> corners, double width, const Paint& paint) {
  if (corners.empty()) return;
  corners.push_back(corners.front());
  DrawPolyline(corners, width, paint);
}

void Canvas::DrawText(const Eigen::Vector2d& low, std::string_view text, double dot,
                      const Paint& paint) {
  // Farther away than any picture is wide.
  constexpr double kFarPx = 1e6;
  if (!(low.cwiseAbs().maxCoeff() < kFarPx)) return;
  double begin = low.x();
  const auto line = static_cast<int>(std::lround(low.y() + kCapHeightDots * dot));
  for (const auto& letter : LettersOf(text, kCapHeightDots * dot)) {
    if (begin > width_) return;
    const int left = static_cast<int>(std::lround(begin)) + letter->left_px;
    for (int y = 0; y < letter->height; ++y) {
      for (int x = 0; x < letter->width; ++x) {
        const uint8_t covered = letter->coverage[static_cast<size_t>(y * letter->width + x)];
        const int column = left + x;
        const int row = line - letter->top_px + y;
        const bool is_inside = column >= 0 && column < width_ && row >= 0 && row < height_;
        if (covered == 0 || !is_inside) continue;
        Paint part = paint;
        part.opacity *= static_cast<float>(covered) / 255.0f;
        Blend(column, row, part);
      }
    }
    begin += letter->advance_px;
  }
}

double Canvas::TextWidth(std::string_view text, double dot) {
  double width = 0.0;
  for (const auto& letter : LettersOf(text, kCapHeightDots * dot)) width += letter->advance_px;
  return width;
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

}  // namespace dsg::picture
