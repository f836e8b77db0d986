// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/axes.h"

#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "schema/picture/font.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

constexpr double kTickDotPx = 3.0;
constexpr double kTickTextPx = kTickDotPx * picture::kCapHeightDots;
constexpr double kTickPx = 10.0;
constexpr double kSpacePx = 6.0;
// Between ticks: labels of four letters stay apart.
constexpr double kApartPx = 110.0;

// Writes the label unless it would come closer to the one before than a letter.
void WriteAcross(const std::string& text, double middle_x, double y, double* free_from,
                 double free_to, picture::Canvas* canvas) {
  const double width = picture::Canvas::TextWidth(text, kTickDotPx);
  const double x = middle_x - 0.5 * width;
  if (x < *free_from || x + width > free_to) return;
  canvas->DrawText({x, y}, text, kTickDotPx, picture::MakePaint(kInkRgb));
  *free_from = x + width + 3.0 * kSpacePx;
}

void DrawAxisX(const FloorView& view, picture::Canvas* canvas) {
  const Eigen::AlignedBox2d area = view.area_px();
  const picture::Paint ink = picture::MakePaint(kInkRgb);
  const double y = area.max().y();
  const double text_y = y + kTickPx + kSpacePx;
  // The name stands at the end of the axis.
  const std::string name = "x m";
  const double name_x = area.max().x() - picture::Canvas::TextWidth(name, kTickDotPx);
  canvas->DrawText({name_x, text_y}, name, kTickDotPx, ink);
  double free_from = 0.0;
  const Eigen::AlignedBox2d& bounds = view.bounds_map();
  for (const double x_m : TicksOf(bounds.min().x(), bounds.max().x(), kApartPx / view.px_per_m())) {
    const double x = view.ToPixel(Eigen::Vector2d(x_m, bounds.min().y())).x();
    canvas->DrawPolyline({{x, y}, {x, y + kTickPx}}, 2.0, ink);
    WriteAcross(absl::StrCat(x_m), x, text_y, &free_from, name_x - 2.0 * kSpacePx, canvas);
  }
}

void DrawAxisY(const FloorView& view, picture::Canvas* canvas) {
  const Eigen::AlignedBox2d area = view.area_px();
  const picture::Paint ink = picture::MakePaint(kInkRgb);
  const double x = area.min().x();
  const auto write = [&](const std::string& text, double text_y) {
    const double width = picture::Canvas::TextWidth(text, kTickDotPx);
    canvas->DrawText({x - kTickPx - kSpacePx - width, text_y}, text, kTickDotPx, ink);
  };
  write("y m", area.min().y());
  const Eigen::AlignedBox2d& bounds = view.bounds_map();
  for (const double y_m : TicksOf(bounds.min().y(), bounds.max().y(), kApartPx / view.px_per_m())) {
    const double y = view.ToPixel(Eigen::Vector2d(bounds.min().x(), y_m)).y();
    canvas->DrawPolyline({{x - kTickPx, y}, {x, y}}, 2.0, ink);
    const double text_y = y - 0.5 * kTickTextPx;
    if (text_y > area.min().y() + kTickTextPx + kSpacePx) write(absl::StrCat(y_m), text_y);
  }
}

}  // namespace

double RoundBelow(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= length) return factor * power;
  }
  return power;
}

std::vector<double> TicksOf(double low, double high, double apart_min) {
  const double power = std::pow(10.0, std::floor(std::log10(apart_min)));
  double step = power;
  for (const double factor : {2.0, 5.0, 10.0}) {
    if (step < apart_min) step = factor * power;
  }
  std::vector<double> ticks;
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1.0) {
    // Zero without a sign, and no tail of digits from the multiplication.
    const double tick = std::round(i * step * 1e6) / 1e6;
    ticks.push_back(tick == 0.0 ? 0.0 : tick);
  }
  return ticks;
}

void DrawAxes(const FloorView& view, picture::Canvas* canvas) {
  const Eigen::AlignedBox2d area = view.area_px();
  const Eigen::Vector2d low = area.min();
  const Eigen::Vector2d high = area.max();
  canvas->DrawOutline({low, {high.x(), low.y()}, high, {low.x(), high.y()}}, 2.0,
                      picture::MakePaint(kInkRgb, 0.6f));
  DrawAxisX(view, canvas);
  DrawAxisY(view, canvas);
}

}  // namespace dsg::cli
