// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/frame_builder.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/depth/cloud_views.h"
#include "ingest/depth/dynamic_mask.h"
#include "ingest/sensor/pinhole.h"

namespace dsg::ingest {
namespace {

// A structured-light sensor's way to say "nothing" in millimetres.
constexpr uint16_t kNoReading16 = 65535;

bool IsDepth(PixelFormat format) {
  return format == PixelFormat::kDepth16 || format == PixelFormat::kDepth32;
}

// Loads a picture whose bytes are as many as it says; false and a reason otherwise.
bool Load(const FrameMaker::Picture& picture, const std::string& prefix, Image* image,
          BuiltFrame* built) {
  absl::StatusOr<Image> loaded =
      picture.load ? picture.load() : absl::StatusOr<Image>(absl::InternalError("no picture"));
  if (!loaded.ok() || loaded->width < 1 || loaded->height < 1 ||
      loaded->bytes.size() != loaded->Offset(0, loaded->height)) {
    built->skips.push_back(absl::StrCat(prefix, "broken image"));
    return false;
  }
  *image = *std::move(loaded);
  return true;
}

bool HasSize(const Image& image, const CameraCalibration& camera) {
  return image.width == camera.width && image.height == camera.height;
}

float CleanDepth(const Image& image, size_t index) {
  const int width = image.width;
  const int column = static_cast<int>(index) % width;
  const int row = static_cast<int>(index) / width;
  const uint8_t* at = image.bytes.data() + image.Offset(column, row);
  if (image.format == PixelFormat::kDepth16 && (at[0] | (at[1] << 8)) == kNoReading16) return 0.0f;
  return DepthAt(image, column, row);
}

// Where a pixel of `source` is in `target`; NaN if nowhere.
Eigen::Vector2d MapPixel(const Eigen::Vector2d& pixel, const CameraCalibration& source,
                         const CameraCalibration& target) {
  const Eigen::Vector2d nowhere(NAN, NAN);
  if (!pixel.allFinite()) return nowhere;
  const std::optional<Eigen::Vector3d> ray = RayOf(source, pixel);
  if (!ray.has_value()) return nowhere;
  const Eigen::Vector3d turned =
      target.body_T_camera.orientation.conjugate() * (source.body_T_camera.orientation * *ray);
  return turned.z() > 0.0 ? Project(target, turned) : nowhere;
}

// The smallest box around a source camera's box, in the target's pixels; NaN if nowhere.
Eigen::Vector4d MapBox(const Eigen::Vector4d& box, const CameraCalibration& source,
                       const CameraCalibration& target) {
  Eigen::AlignedBox2d mapped;
  const Eigen::Vector2d middle(0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3]));
  for (const double x : {box[0], middle.x(), box[2]}) {
    for (const double y : {box[1], middle.y(), box[3]}) {
      const Eigen::Vector2d pixel = MapPixel({x, y}, source, target);
      if (pixel.allFinite()) mapped.extend(pixel);
    }
  }
  if (mapped.isEmpty()) return Eigen::Vector4d::Constant(NAN);
  return {mapped.min().x(), mapped.min().y(), mapped.max().x(), mapped.max().y()};
}

}  // namespace

FrameBuilder::FrameBuilder(const RigCalibration& rig, const DepthOptions& options)
    : rig_(rig), options_(options) {
  const CameraCalibration* depth = rig_.FindCamera("depth0");
  const CameraCalibration* left = rig_.FindCamera("cam0");
  const CameraCalibration* right = rig_.FindCamera("cam1");
  if (depth != nullptr && depth->Validate().ok()) {
    source_ = FramePlanner::Source::kDepth;
    depth_camera_ = *depth;
    camera_ = WithoutDistortion(*depth);
    depth_map_.emplace(camera_, *depth);
  } else if (depth == nullptr && rig_.lidar.has_value() && rig_.lidar->Validate().ok()) {
    source_ = FramePlanner::Source::kLidar;
    return;
  } else if (depth == nullptr && left != nullptr && right != nullptr) {
    absl::StatusOr<StereoDepth> stereo =
        StereoDepth::Make(*left, *right, options.range_m, options.stereo);
    if (!stereo.ok()) return;
    source_ = FramePlanner::Source::kStereo;
    stereo_.emplace(*std::move(stereo));
    camera_ = stereo_->camera();
  }
  if (source_ == FramePlanner::Source::kNone) return;
  for (const char* channel : {"color0", "cam0", "label0"}) AddOverlay(rig_, channel);
}

void FrameBuilder::AddOverlay(const RigCalibration& rig, const std::string& channel) {
  const CameraCalibration* given = rig.FindCamera(channel);
  // A channel without a calibration is taken to be registered to the depth, or to the left image.
  if (given == nullptr && stereo_.has_value()) given = rig.FindCamera("cam0");
  Overlay overlay;
  overlay.camera = given != nullptr ? *given : camera_;
  if (overlay.camera.Validate().ok() &&
      CentreDistance(overlay.camera, camera_) < options_.same_center_m) {
    overlay.map.emplace(camera_, overlay.camera);
  }
  overlays_.emplace(channel, std::move(overlay));
}

BuiltFrame FrameBuilder::BuildViews(const FramePlan& plan) const {
  BuiltFrame built;
  Image points;
  if (!Load(plan.main, "", &points, &built)) return built;
  if (points.format != PixelFormat::kPoints32) {
    built.skips.push_back("no depth image");
    return built;
  }
  built.frames = ViewsOfCloud(points, plan.time_ns, plan.odom_T_body * rig_.lidar->body_T_lidar,
                              options_.cloud);
  if (built.frames.empty()) built.skips.push_back("no points");
  return built;
}

BuiltFrame FrameBuilder::Build(const FramePlan& plan) const {
  if (source_ == FramePlanner::Source::kLidar) return BuildViews(plan);
  BuiltFrame built;
  DepthFrame& frame = built.frames.emplace_back();
  frame.time_ns = plan.time_ns;
  frame.camera = camera_;
  frame.map_T_camera = plan.odom_T_body * camera_.body_T_camera;
  frame.map_T_camera.orientation.normalize();
  frame.is_stereo = stereo_.has_value();
  if (!(stereo_.has_value() ? FillStereo(plan, &built) : FillDepth(plan, &built))) {
    built.frames.clear();
    return built;
  }
  FillColor(plan, &built);
  FillLabels(plan, &built);
  frame.dynamic = MaskPeople(frame, InFrame(plan.detections), options_);
  return built;
}

bool FrameBuilder::FillDepth(const FramePlan& plan, BuiltFrame* built) const {
  Image image;
  if (!Load(plan.main, "", &image, built)) return false;
  if (!IsDepth(image.format)) {
    built->skips.push_back("no depth image");
    return false;
  }
  if (!HasSize(image, *depth_camera_)) {
    built->skips.push_back("size differs from calibration");
    return false;
  }
  std::vector<float>& depth_m = built->frames.front().depth_m;
  depth_m.resize(depth_map_->pixel_count());
  for (size_t i = 0; i < depth_m.size(); ++i) {
    const int32_t from = (*depth_map_)[i];
    depth_m[i] = from < 0 ? 0.0f : CleanDepth(image, static_cast<size_t>(from));
  }
  return true;
}

bool FrameBuilder::FillStereo(const FramePlan& plan, BuiltFrame* built) const {
  Image left;
  Image right;
  if (!Load(plan.main, "", &left, built) || !Load(*plan.right, "", &right, built)) return false;
  absl::StatusOr<std::vector<float>> depth_m = stereo_->Compute(left, right);
  if (!depth_m.ok()) {
    built->skips.push_back("size differs from calibration");
    return false;
  }
  built->frames.front().depth_m = *std::move(depth_m);
  return true;
}

const FrameBuilder::Overlay* FrameBuilder::OverlayFor(const std::string& channel,
                                                      const Image& image, const std::string& what,
                                                      BuiltFrame* built) const {
  const Overlay& overlay = overlays_.at(channel);
  if (!overlay.map.has_value()) {
    built->skips.push_back(absl::StrCat(what, " left out: taken from another place"));
    return nullptr;
  }
  if (!HasSize(image, overlay.camera)) {
    built->skips.push_back(absl::StrCat(what, " left out: size differs from calibration"));
    return nullptr;
  }
  return &overlay;
}

void FrameBuilder::FillColor(const FramePlan& plan, BuiltFrame* built) const {
  if (!plan.color.has_value()) return;
  Image image;
  if (!Load(*plan.color, "colour left out: ", &image, built)) return;
  if (image.format != PixelFormat::kRgb8 && image.format != PixelFormat::kGray8) {
    built->skips.push_back("colour left out: no colours");
    return;
  }
  const Overlay* overlay = OverlayFor(plan.color->channel, image, "colour", built);
  if (overlay == nullptr) return;
  const size_t stride = image.format == PixelFormat::kRgb8 ? 3 : 1;
  std::vector<uint8_t>& rgb = built->frames.front().rgb;
  rgb.assign(3 * overlay->map->pixel_count(), 0);
  for (size_t i = 0; i < overlay->map->pixel_count(); ++i) {
    const int32_t from = (*overlay->map)[i];
    if (from < 0) continue;
    const uint8_t* pixel = image.bytes.data() + stride * static_cast<size_t>(from);
    for (size_t c = 0; c < 3; ++c) rgb[3 * i + c] = pixel[stride == 3 ? c : 0];
  }
}

void FrameBuilder::FillLabels(const FramePlan& plan, BuiltFrame* built) const {
  if (!plan.label.has_value()) return;
  Image image;
  if (!Load(*plan.label, "labels left out: ", &image, built)) return;
  if (image.format != PixelFormat::kLabel16) {
    built->skips.push_back("labels left out: no labels");
    return;
  }
  const Overlay* overlay = OverlayFor("label0", image, "labels", built);
  if (overlay == nullptr) return;
  std::vector<uint16_t>& labels = built->frames.front().labels;
  labels.assign(overlay->map->pixel_count(), 0);
  for (size_t i = 0; i < labels.size(); ++i) {
    const int32_t from = (*overlay->map)[i];
    if (from < 0) continue;
    const uint8_t* pixel = image.bytes.data() + 2 * static_cast<size_t>(from);
    labels[i] = static_cast<uint16_t>(pixel[0] | (pixel[1] << 8));
  }
}

std::vector<HumanDetection> FrameBuilder::InFrame(
    const std::vector<HumanDetection>& detections) const {
  std::vector<HumanDetection> mapped;
  for (const HumanDetection& detection : detections) {
    const CameraCalibration* camera = rig_.FindCamera(detection.camera);
    if (camera == nullptr || !camera->Validate().ok()) continue;
    if (CentreDistance(*camera, camera_) > options_.same_people_m) continue;
    HumanDetection& in_frame = mapped.emplace_back(detection);
    in_frame.box_px = MapBox(detection.box_px, *camera, camera_);
    for (Eigen::Vector2d& joint : in_frame.joints_px) joint = MapPixel(joint, *camera, camera_);
  }
  return mapped;
}

}  // namespace dsg::ingest
