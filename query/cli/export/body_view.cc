// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/body_view.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "query/cli/export/top_view.h"
#include "query/cli/table.h"
#include "schema/base/check.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

using LinePx = std::vector<Eigen::Vector2d>;

// Of the canvas, which is twice the size of the picture.
constexpr double kRimPx = 60.0;
constexpr double kTitleRowPx = 90.0;
constexpr double kKeyRowsPx = 110.0;
constexpr double kTiltRad = 18.0 * std::numbers::pi / 180.0;
constexpr double kGridM = 1.0;
constexpr double kAroundM = 0.6;

// Source: Loper et al., "SMPL: a skinned multi-person linear model", 2015: the parent of each
// joint; the pelvis is its own.
constexpr std::array<int, 24> kParents = {0, 0, 0, 0,  1,  2,  3,  4,  5,  6,  7,  8,
                                          9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21};

// From early to late; `share` is 0 to 1.
uint32_t TimeColor(double share) {
  constexpr std::array<uint32_t, 4> kRgb = {0x2f4b9e, 0x23998c, 0xe2a12f, 0xc4341f};
  const double at = std::clamp(share, 0.0, 1.0) * (kRgb.size() - 1);
  const auto low = std::min(static_cast<size_t>(at), kRgb.size() - 2);
  const double part = at - static_cast<double>(low);
  uint32_t rgb = 0;
  for (const int shift : {16, 8, 0}) {
    const double a = kRgb[low] >> shift & 0xff;
    const double b = kRgb[low + 1] >> shift & 0xff;
    rgb |= static_cast<uint32_t>(std::lround(a + part * (b - a))) << shift;
  }
  return rgb;
}

double HeightOfFloor(const std::vector<Body>& bodies) {
  // The lowest points are outliers of single detections.
  std::vector<float> lows;
  for (const Body& body : bodies) {
    float low = std::numeric_limits<float>::max();
    for (const auto* points : {&body.points_map, &body.joints_map}) {
      for (const Eigen::Vector3f& point : *points) low = std::min(low, point.z());
    }
    lows.push_back(low);
  }
  const auto middle = lows.begin() + static_cast<ptrdiff_t>(lows.size() / 2);
  std::nth_element(lows.begin(), middle, lows.end());
  return static_cast<double>(*middle);
}

// The direction in which the way is longest, on the floor; the eye stands square to it.
Eigen::Vector3d LongestWay(const std::vector<Body>& bodies) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Body& body : bodies) mean += body.map_T_agent.position.head<2>();
  mean /= static_cast<double>(bodies.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Body& body : bodies) {
    const Eigen::Vector2d off = body.map_T_agent.position.head<2>() - mean;
    spread += off * off.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(spread);
  Eigen::Vector2d way = solver.eigenvectors().col(1);
  const Eigen::Vector2d whole =
      (bodies.back().map_T_agent.position - bodies.front().map_T_agent.position).head<2>();
  // Time goes from left to right.
  if (way.dot(whole) < 0.0) way = -way;
  return {way.x(), way.y(), 0.0};
}

// The first, the last, and between them those that are `step_m` from the one before.
std::vector<const Body*> Spaced(const std::vector<Body>& bodies, double step_m) {
  std::vector<const Body*> spaced;
  for (const Body& body : bodies) {
    const bool is_last = &body == &bodies.back();
    const bool is_far =
        spaced.empty() ||
        (body.map_T_agent.position - spaced.back()->map_T_agent.position).norm() >= step_m;
    if (is_far || is_last) spaced.push_back(&body);
  }
  return spaced;
}

class BodyDrawer {
 public:
  BodyDrawer(const std::vector<Body>& bodies, const BodyViewOptions& options)
      : bodies_(bodies),
        options_(options),
        floor_m_(HeightOfFloor(bodies)),
        right_(LongestWay(bodies)),
        away_(-right_.y(), right_.x(), 0.0),
        to_eye_(-std::cos(kTiltRad) * away_ + std::sin(kTiltRad) * Eigen::Vector3d::UnitZ()),
        bounds_(Bounds()),
        px_per_m_(Scale()),
        canvas_(2 * options.width_px,
                2 * static_cast<int>(std::ceil(0.5 * (px_per_m_ * bounds_.sizes().y() +
                                                      kTitleRowPx + kKeyRowsPx + kRimPx))),
                picture::MakePaint(kPaperRgb)) {}

  picture::Picture Draw() {
    DrawFloor();
    DrawWay();
    DrawAll();
    DrawTexts();
    return canvas_.Halved();
  }

 private:
  // Right and down, metres.
  Eigen::Vector2d Flat(const Eigen::Vector3d& point_map) const {
    const double z_m = point_map.z() - floor_m_;
    return {right_.dot(point_map),
            -std::sin(kTiltRad) * away_.dot(point_map) - std::cos(kTiltRad) * z_m};
  }

  Eigen::Vector2d ToPixel(const Eigen::Vector3d& point_map) const {
    const double left_px = 0.5 * (canvas_.width() - px_per_m_ * bounds_.sizes().x());
    return Eigen::Vector2d(left_px, kTitleRowPx) + px_per_m_ * (Flat(point_map) - bounds_.min());
  }

  Eigen::AlignedBox2d Bounds() const {
    Eigen::AlignedBox2d bounds;
    for (const Body& body : bodies_) {
      for (const auto* points : {&body.points_map, &body.joints_map}) {
        for (const Eigen::Vector3f& point : *points) bounds.extend(Flat(point.cast<double>()));
      }
      bounds.extend(Flat({body.map_T_agent.position.x(), body.map_T_agent.position.y(), floor_m_}));
    }
    const Eigen::Vector2d around(kAroundM, 0.4 * kAroundM);
    return {bounds.min() - around, bounds.max() + around};
  }

  double Scale() const {
    const double width_px = 2.0 * options_.width_px - 2.0 * kRimPx;
    const double height_px = std::min(4.0 * options_.width_px, 2.0 * kTopViewWidthMax) -
                             kTitleRowPx - kKeyRowsPx - kRimPx;
    return std::min(width_px / bounds_.sizes().x(), height_px / bounds_.sizes().y());
  }

  double ShareOf(const Body& body) const {
    const auto whole = static_cast<double>(bodies_.back().time_ns - bodies_.front().time_ns);
    const auto part = static_cast<double>(body.time_ns - bodies_.front().time_ns);
    return whole > 0.0 ? part / whole : 0.0;
  }

  // Lines a metre apart on the floor below the way.
  void DrawFloor() {
    Eigen::AlignedBox2d area;
    for (const Body& body : bodies_) {
      const Eigen::Vector3d& at = body.map_T_agent.position;
      area.extend(Eigen::Vector2d(right_.dot(at), away_.dot(at)));
    }
    const Eigen::Vector2d low = (area.min().array() - kAroundM).floor();
    const Eigen::Vector2d high = (area.max().array() + kAroundM).ceil();
    const auto pixel = [this](double right_m, double away_m) {
      Eigen::Vector3d point = right_m * right_ + away_m * away_;
      point.z() = floor_m_;
      return ToPixel(point);
    };
    const picture::Paint paint = picture::MakePaint(kInkRgb, 0.12f);
    for (double x = low.x(); x <= high.x(); x += kGridM) {
      canvas_.DrawPolyline({pixel(x, low.y()), pixel(x, high.y())}, 2.0, paint);
    }
    for (double y = low.y(); y <= high.y(); y += kGridM) {
      canvas_.DrawPolyline({pixel(low.x(), y), pixel(high.x(), y)}, 2.0, paint);
    }
  }

  void DrawWay() {
    for (size_t i = 1; i < bodies_.size(); ++i) {
      if (bodies_[i].time_ns - bodies_[i - 1].time_ns > options_.gap_ns) continue;
      LinePx line;
      for (const Body* body : {&bodies_[i - 1], &bodies_[i]}) {
        Eigen::Vector3d below = body->map_T_agent.position;
        below.z() = floor_m_;
        line.push_back(ToPixel(below));
      }
      canvas_.DrawPolyline(line, 5.0, picture::MakePaint(TimeColor(ShareOf(bodies_[i])), 0.8f));
    }
  }

  // What is farther from the eye first.
  void DrawAll() {
    struct Drawn {
      const Body* body = nullptr;
      bool is_skeleton = false;
    };
    std::vector<Drawn> drawn;
    for (const Body* body : Spaced(bodies_, options_.skeleton_step_m)) {
      drawn.push_back({body, /*is_skeleton=*/true});
    }
    for (const Body* body : Spaced(bodies_, options_.body_step_m)) drawn.push_back({body, false});
    std::stable_sort(drawn.begin(), drawn.end(), [this](const Drawn& a, const Drawn& b) {
      return away_.dot(a.body->map_T_agent.position) > away_.dot(b.body->map_T_agent.position);
    });
    for (const Drawn& one : drawn) {
      if (one.is_skeleton) {
        DrawSkeleton(*one.body);
      } else {
        DrawSkin(*one.body);
      }
    }
  }

  void DrawSkin(const Body& body) {
    std::vector<LitFace> faces = LitFaces(body, TimeColor(ShareOf(body)), to_eye_);
    std::stable_sort(faces.begin(), faces.end(), [this](const LitFace& a, const LitFace& b) {
      return to_eye_.dot(a.middle_map) < to_eye_.dot(b.middle_map);
    });
    for (const LitFace& face : faces) {
      LinePx corners;
      for (const Eigen::Vector3d& corner : face.corners_map) corners.push_back(ToPixel(corner));
      canvas_.FillPolygon(corners, face.paint);
    }
  }

  void DrawSkeleton(const Body& body) {
    if (body.joints_map.size() != kParents.size()) return;
    const picture::Paint paint = picture::MakePaint(TimeColor(ShareOf(body)), 0.85f);
    for (size_t joint = 0; joint < kParents.size(); ++joint) {
      const auto parent = static_cast<size_t>(kParents[joint]);
      canvas_.DrawPolyline({ToPixel(body.joints_map[joint].cast<double>()),
                            ToPixel(body.joints_map[parent].cast<double>())},
                           4.0, paint);
      canvas_.FillCircle(ToPixel(body.joints_map[joint].cast<double>()), 4.0, paint);
    }
  }

  void DrawTexts() {
    const picture::Paint ink = picture::MakePaint(kInkRgb);
    double dot = 5.0;
    const double width_px = canvas_.width() - 2.0 * kRimPx;
    while (dot > 2.0 && picture::Canvas::TextWidth(options_.title, dot) > width_px) dot -= 1.0;
    canvas_.DrawText({kRimPx, 30.0}, options_.title, dot, ink);
    constexpr int kSteps = 60;
    const double y = canvas_.height() - 70.0;
    const double step_px = 0.3 * canvas_.width() / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const double x = kRimPx + i * step_px;
      canvas_.FillRect({x, y}, {x + step_px + 1.0, y + 24.0},
                       picture::MakePaint(TimeColor((i + 0.5) / kSteps)));
    }
    const double seconds =
        static_cast<double>(bodies_.back().time_ns - bodies_.front().time_ns) / kNsPerSecond;
    canvas_.DrawText({kRimPx + kSteps * step_px + 20.0, y},
                     absl::StrCat(Fixed(seconds, 1), " s, floor lines 1 m apart"), 3.0, ink);
  }

  const std::vector<Body>& bodies_;
  const BodyViewOptions& options_;
  const double floor_m_;
  const Eigen::Vector3d right_;
  const Eigen::Vector3d away_;
  const Eigen::Vector3d to_eye_;
  const Eigen::AlignedBox2d bounds_;
  const double px_per_m_;
  picture::Canvas canvas_;
};

}  // namespace

picture::Picture DrawBodies(const std::vector<Body>& bodies, const BodyViewOptions& options) {
  DSG_CHECK(!bodies.empty());
  DSG_CHECK(options.width_px >= kTopViewWidthMin && options.width_px <= kTopViewWidthMax);
  return BodyDrawer(bodies, options).Draw();
}

}  // namespace dsg::cli
