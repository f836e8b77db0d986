// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/year/year_picture.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "schema/picture/raster.h"

namespace dsg::test {
namespace {

using Eigen::Vector2d;

// The canvas is drawn at twice the size of the picture.
constexpr int kWidth = 1800;
constexpr int kPanelHeight = 620;
constexpr double kLeft = 170.0;
constexpr double kRight = 60.0;
constexpr double kTop = 90.0;
constexpr double kBottom = 80.0;
constexpr double kDot = 3.0;

const picture::Paint kInk = picture::MakePaint(0x202020);
const picture::Paint kGrid = picture::MakePaint(0xdddddd);

// The least of 1, 2 and 5 times a power of ten that is not below.
double RoundUp(double value) {
  if (value <= 0.0) return 1.0;
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= value) return step * power;
  }
  return 10.0 * power;
}

class PanelPainter {
 public:
  PanelPainter(picture::Canvas* canvas, const Panel& panel, double top)
      : canvas_(*canvas), panel_(panel), top_(top + kTop), bottom_(top + kPanelHeight - kBottom) {
    double high = 0.0;
    for (const Curve& curve : panel.curves) {
      day_count_ = std::max(day_count_, curve.values.size());
      for (const double value : curve.values) high = std::max(high, value);
    }
    step_ = RoundUp(high / 5.0);
    high_ = step_ * std::ceil(std::max(high, step_) / step_);
  }

  void Paint() {
    canvas_.DrawText({kLeft, top_ - 70.0}, panel_.title, kDot + 1.0, kInk);
    DrawGrid();
    double legend_x = kLeft + 20.0;
    for (const Curve& curve : panel_.curves) legend_x = DrawCurve(curve, legend_x);
  }

 private:
  Vector2d At(double day, double value) const {
    const double days = std::max(1.0, static_cast<double>(day_count_) - 1.0);
    return {kLeft + day / days * (kWidth - kLeft - kRight),
            bottom_ - value / high_ * (bottom_ - top_)};
  }

  void DrawGrid() {
    for (int i = 0; i * step_ <= high_ * 1.0001; ++i) {
      const Vector2d from = At(0.0, i * step_);
      canvas_.DrawPolyline({from, {kWidth - kRight, from.y()}}, 2.0, kGrid);
      const std::string text = absl::StrFormat("%g", i * step_);
      canvas_.DrawText(
          {kLeft - 16.0 - picture::Canvas::TextWidth(text, kDot), from.y() - 3.5 * kDot}, text,
          kDot, kInk);
    }
    const double day_step = RoundUp(static_cast<double>(day_count_) / 12.0);
    for (double day = 0.0; day < static_cast<double>(day_count_); day += day_step) {
      const Vector2d foot = At(day, 0.0);
      canvas_.DrawPolyline({foot, {foot.x(), foot.y() + 8.0}}, 2.0, kInk);
      const std::string text = absl::StrFormat("%g", day);
      canvas_.DrawText({foot.x() - 0.5 * picture::Canvas::TextWidth(text, kDot), foot.y() + 14.0},
                       text, kDot, kInk);
    }
    canvas_.DrawText({kWidth - kRight - picture::Canvas::TextWidth("day", kDot), bottom_ + 46.0},
                     "day", kDot, kInk);
  }

  double DrawCurve(const Curve& curve, double legend_x) {
    std::vector<Vector2d> points;
    for (size_t day = 0; day < curve.values.size(); ++day) {
      points.push_back(At(static_cast<double>(day), curve.values[day]));
    }
    const picture::Paint paint = picture::MakePaint(curve.rgb);
    canvas_.DrawPolyline(points, 5.0, paint);
    const double y = top_ - 20.0;
    canvas_.FillRect({legend_x, y - 4.0}, {legend_x + 40.0, y + 4.0}, paint);
    canvas_.DrawText({legend_x + 52.0, y - 3.5 * kDot}, curve.name, kDot, kInk);
    return legend_x + 52.0 + picture::Canvas::TextWidth(curve.name, kDot) + 50.0;
  }

  picture::Canvas& canvas_;
  const Panel& panel_;
  const double top_;
  const double bottom_;
  size_t day_count_ = 0;
  double step_ = 1.0;
  double high_ = 1.0;
};

}  // namespace

absl::StatusOr<std::string> DrawYear(const std::vector<Panel>& panels) {
  picture::Canvas canvas(kWidth, kPanelHeight * static_cast<int>(panels.size()) + 20,
                         picture::MakePaint(0xffffff));
  double top = 0.0;
  for (const Panel& panel : panels) {
    PanelPainter(&canvas, panel, top).Paint();
    top += kPanelHeight;
  }
  return picture::EncodePng(canvas.Halved());
}

}  // namespace dsg::test
