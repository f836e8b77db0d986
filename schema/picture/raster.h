// SPDX-License-Identifier: Apache-2.0
// A raster image: filled shapes, thick lines, small text, and PNG encoding.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::picture {

/// 0 to 1 each; opacity 1 covers what is below.
struct Paint {
  float red = 0.0f;
  float green = 0.0f;
  float blue = 0.0f;
  float opacity = 1.0f;
};

/// From 0xRRGGBB.
Paint MakePaint(uint32_t rgb, float opacity = 1.0f);

/// Rows from the top; three bytes a pixel: red, green, blue.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgb;
};

/// Pixels count from the top left corner, y down; shapes are cut at the border.
class Canvas {
 public:
  /// Requires: both sizes from 1 to 16384.
  Canvas(int width, int height, const Paint& background);
  /// Twice as wide and high: each pixel becomes four, and Halved gives the picture back.
  /// Requires: both sizes of the picture from 1 to 8192, and all its bytes are there.
  explicit Canvas(const Picture& background);

  int width() const { return width_; }
  int height() const { return height_; }

  void FillRect(const Eigen::Vector2d& low, const Eigen::Vector2d& high, const Paint& paint);
  /// Inside by the even-odd rule. Fewer than three corners fill nothing.
  void FillPolygon(const std::vector<Eigen::Vector2d>& corners, const Paint& paint);
  void FillCircle(const Eigen::Vector2d& center, double radius, const Paint& paint);
  /// One stroke through all points with round joints. It does not darken where it crosses itself.
  void DrawPolyline(const std::vector<Eigen::Vector2d>& points, double width, const Paint& paint);
  /// As DrawPolyline, back to the first point.
  void DrawOutline(std::vector<Eigen::Vector2d> corners, double width, const Paint& paint);
  /// UTF-8 text in the letters of font.h, whose capitals are kCapHeightDots times `dot` pixels
  /// high. `low` is the top left corner of a capital; some letters hang up to kDescentDots below.
  void DrawText(const Eigen::Vector2d& low, std::string_view text, double dot, const Paint& paint);
  static double TextWidth(std::string_view text, double dot);

  /// Averages two by two pixels to one, which smooths the edges.
  Picture Halved() const;

 private:
  void Blend(int x, int y, const Paint& paint);

  int width_;
  int height_;
  std::vector<float> pixels_;
};

/// Encodes as PNG. Errors: INTERNAL with the message of the library.
absl::StatusOr<std::string> EncodePng(const Picture& picture);

}  // namespace dsg::picture
