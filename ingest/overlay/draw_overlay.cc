// SPDX-License-Identifier: Apache-2.0
#include "ingest/overlay/draw_overlay.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/overlay/camera_view.h"
#include "ingest/sensor/skeleton.h"
#include "schema/base/check.h"
#include "schema/base/status.h"
#include "schema/picture/font.h"
#include "schema/picture/look.h"
#include "schema/picture/wire.h"

namespace dsg::ingest {
namespace {

constexpr uint32_t kDetectionRgb = 0xffe14d;
constexpr uint32_t kLabelInkRgb = 0xffffff;
constexpr float kHiddenOpacity = 0.25f;
// Of an object's lines in the image at least this share is in sight, or it is left out.
constexpr double kSightShare = 0.25;

// Of the canvas, which is twice the size of the image.
constexpr double kLabelDotPx = 3.0;
constexpr double kLabelEdgePx = 4.0;

constexpr OptionField<OverlayOptions> kFields[] = {
    {"trail", &OverlayOptions::trail_s, 0.0, 3600.0, "Length of the trails of people, seconds"},
    {"reach", &OverlayOptions::reach_m, 0.5, 1000.0,
     "Objects and people further from the camera are left out, metres"},
};

picture::Picture ToPicture(const Image& image) {
  picture::Picture picture{image.width, image.height, image.bytes};
  if (image.format == PixelFormat::kRgb8) return picture;
  picture.rgb.clear();
  for (const uint8_t gray : image.bytes) picture.rgb.insert(picture.rgb.end(), 3, gray);
  return picture;
}

class Drawer {
 public:
  Drawer(const MapScene& scene, const CameraCalibration& camera, const Pose3d& map_T_body,
         const OverlayImage& image, const OverlayOptions& options)
      : scene_(scene),
        image_(image),
        options_(options),
        view_(camera, map_T_body * camera.body_T_camera),
        canvas_(ToPicture(image.image)),
        labels_({Eigen::Vector2d::Zero(), Eigen::Vector2d(canvas_.width(), canvas_.height())}) {}

  absl::StatusOr<picture::Picture> Draw() {
    for (const MeshBlock& block : scene_.mesh()) view_.AddMesh(block);
    for (const Node& node : scene_.nodes()) {
      // What is first seen later is there already, as far as anybody knows.
      if (image_.time_ns < node.valid.to_ns) DrawNode(node);
    }
    const auto trail_ns = static_cast<TimeNs>(options_.trail_s * static_cast<double>(kNsPerSecond));
    DSG_ASSIGN_OR_RETURN(const std::vector<SeenAgent> others,
                         scene_.OthersAt(image_.time_ns, trail_ns));
    for (const SeenAgent& seen : others) {
      const Eigen::Vector3d away = seen.map_T_agent.position - view_.center_map();
      if (away.norm() <= options_.reach_m) DrawAgent(seen);
    }
    for (const HumanDetection& detection : image_.detections) {
      const Eigen::Vector2d low = ToCanvas(detection.box_px.head<2>());
      const Eigen::Vector2d high = ToCanvas(detection.box_px.tail<2>());
      canvas_.DrawOutline({low, {high.x(), low.y()}, high, {low.x(), high.y()}}, 2.0,
                          picture::MakePaint(kDetectionRgb));
    }
    // Labels over all lines.
    for (const Label& label : waiting_) WriteLabel(label);
    return canvas_.Halved();
  }

 private:
  struct Label {
    /// Below its middle, canvas.
    Eigen::Vector2d foot_px = Eigen::Vector2d::Zero();
    std::string text;
    uint32_t rgb = 0;
  };

  // Pixel centres are at whole numbers in an image, and its pixels twice as large on the canvas.
  static Eigen::Vector2d ToCanvas(const Eigen::Vector2d& pixel) {
    return 2.0 * pixel + Eigen::Vector2d::Ones();
  }

  // What is seen of a set of lines, canvas.
  struct Extent {
    Eigen::AlignedBox2d bounds_px;
    double sight_px = 0.0;
    double hidden_px = 0.0;
  };

  // On the canvas.
  std::vector<ImageStroke> StrokesOf(const Wire& wire, Extent* extent) const {
    std::vector<ImageStroke> strokes;
    for (const auto& [from, to] : wire.lines) {
      for (ImageStroke& stroke : view_.StrokesOf(wire.points[from], wire.points[to])) {
        for (Eigen::Vector2d& point : stroke.points_px) point = ToCanvas(point);
        AddTo(stroke, extent);
        strokes.push_back(std::move(stroke));
      }
    }
    return strokes;
  }

  static void AddTo(const ImageStroke& stroke, Extent* extent) {
    for (size_t i = 0; i < stroke.points_px.size(); ++i) {
      const Eigen::Vector2d& point = stroke.points_px[i];
      if (!stroke.is_hidden) extent->bounds_px.extend(point);
      if (i == 0) continue;
      (stroke.is_hidden ? extent->hidden_px : extent->sight_px) +=
          (point - stroke.points_px[i - 1]).norm();
    }
  }

  void DrawStrokes(const std::vector<ImageStroke>& strokes, double width_px, uint32_t rgb,
                   float opacity, float hidden_opacity) {
    for (const ImageStroke& stroke : strokes) {
      const float used = stroke.is_hidden ? hidden_opacity : opacity;
      if (used > 0.0f) {
        canvas_.DrawPolyline(stroke.points_px, width_px, picture::MakePaint(rgb, used));
      }
    }
  }

  void DrawNode(const Node& node) {
    Extent extent;
    if (node.kind == kinds::kRoom) {
      // Outlines of neighbours are in the same wall, and would show through it.
      if (!IsInside(node, view_.center_map())) return;
      DrawStrokes(StrokesOf(WireOf(node), &extent), 3.0, RoomColor(node), 0.6f, 0.0f);
      return;
    }
    if (node.DistanceTo(view_.center_map()) > options_.reach_m) return;
    const std::vector<ImageStroke> strokes = StrokesOf(WireOf(node), &extent);
    const double whole_px = extent.sight_px + extent.hidden_px;
    if (extent.sight_px == 0.0 || extent.sight_px < kSightShare * whole_px) return;
    DrawStrokes(strokes, 4.0, ClassColor(node), 0.9f, 0.0f);
    const std::string id = ToString(node.id);
    const std::string text = node.class_name.empty() ? id : absl::StrCat(node.class_name, " ", id);
    waiting_.push_back({TopOf(extent.bounds_px), text, ClassColor(node)});
  }

  static bool IsInside(const Node& room, const Eigen::Vector3d& point_map) {
    if (!room.region.has_value() || room.region->footprint_map.size() < 3) {
      return !room.box_node.isEmpty() && room.DistanceTo(point_map) == 0.0;
    }
    return point_map.z() >= room.region->z_min_m && point_map.z() <= room.region->z_max_m &&
           PolygonContains(room.region->footprint_map, point_map.head<2>());
  }

  void DrawAgent(const SeenAgent& seen) {
    const uint32_t rgb = AgentColor(seen.agent->index);
    Extent trail_extent;
    for (const std::vector<Eigen::Vector3d>& piece : seen.trail) {
      Wire trail{.points = piece, .lines = {}};
      for (uint32_t i = 1; i < piece.size(); ++i) trail.lines.push_back({i - 1, i});
      DrawStrokes(StrokesOf(trail, &trail_extent), 5.0, rgb, 0.8f, kHiddenOpacity);
    }
    Node body = seen.agent->node;
    body.map_T_node = seen.map_T_agent;
    Extent extent;
    DrawStrokes(StrokesOf(WireOf(body), &extent), 3.0, rgb, 0.9f, kHiddenOpacity);
    DrawStrokes(StrokesOf(SkeletonOf(seen), &extent), 6.0, rgb, 0.9f, kHiddenOpacity);
    if (extent.sight_px > 0.0) {
      waiting_.push_back({TopOf(extent.bounds_px), ToString(body.id), rgb});
    }
  }

  static Wire SkeletonOf(const SeenAgent& seen) {
    Wire skeleton;
    if (seen.joints.size() != static_cast<size_t>(kJointCount)) return skeleton;
    for (uint32_t joint = 0; joint < seen.joints.size(); ++joint) {
      skeleton.points.push_back(seen.map_T_agent * seen.joints[joint]);
      const int parent = kJointParents[joint];
      if (parent >= 0) skeleton.lines.push_back({static_cast<uint32_t>(parent), joint});
    }
    return skeleton;
  }

  static Eigen::Vector2d TopOf(const Eigen::AlignedBox2d& bounds_px) {
    return {bounds_px.center().x(), bounds_px.min().y()};
  }

  // Above its thing or, where others are, below them; left out where there is no room.
  void WriteLabel(const Label& label) {
    const Eigen::Vector2d size_px(picture::Canvas::TextWidth(label.text, kLabelDotPx),
                                  kLabelDotPx * picture::kCapHeightDots);
    const Eigen::Vector2d edge = Eigen::Vector2d::Constant(kLabelEdgePx);
    for (const double step : {-1.2, -2.6, 0.2, 1.6, 3.0}) {
      Eigen::Vector2d low = label.foot_px - Eigen::Vector2d(0.5 * size_px.x(), 0.0);
      low.y() += step * (size_px.y() + kLabelEdgePx);
      low.x() = std::clamp(low.x(), kLabelEdgePx,
                           std::max(kLabelEdgePx, canvas_.width() - size_px.x() - kLabelEdgePx));
      const Eigen::AlignedBox2d spot(low - edge, low + size_px + edge);
      if (!labels_.IsFree(spot)) continue;
      labels_.Block(spot);
      canvas_.FillRect(spot.min(), spot.max(), picture::MakePaint(label.rgb, 0.85f));
      canvas_.DrawText(low, label.text, kLabelDotPx, picture::MakePaint(kLabelInkRgb));
      return;
    }
  }

  const MapScene& scene_;
  const OverlayImage& image_;
  const OverlayOptions& options_;
  CameraView view_;
  picture::Canvas canvas_;
  picture::LabelLayout labels_;
  std::vector<Label> waiting_;
};

}  // namespace

std::vector<BoundOption> OverlayOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<OverlayOptions>(kFields, this, &bound);
  return bound;
}

absl::StatusOr<picture::Picture> DrawOverlayImage(const MapScene& scene, const Pose3d& map_T_body,
                                                  const CameraCalibration& camera,
                                                  const OverlayImage& image,
                                                  const OverlayOptions& options) {
  DSG_CHECK(image.image.width == camera.width && image.image.height == camera.height);
  return Drawer(scene, camera, map_T_body, image, options).Draw();
}

}  // namespace dsg::ingest
