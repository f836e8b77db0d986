// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/dynamic_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace dsg::ingest {
namespace {

// Readings along each bone: a median needs no more.
constexpr int kStepsPerBone = 6;
constexpr float kFar = 1e6f;

// Pelvis, spine, neck, and shoulder to shoulder, hip to hip.
constexpr std::array<std::pair<int, int>, 6> kTorsoBones = {
    {{0, 3}, {3, 6}, {6, 9}, {9, 12}, {16, 17}, {1, 2}}};

struct PixelBox {
  int left, top, right, bottom;
};

PixelBox BoxOf(const HumanDetection& detection, const CameraCalibration& camera) {
  const auto clamp = [](double value, int size) {
    return static_cast<int>(std::clamp(std::round(value), 0.0, static_cast<double>(size)));
  };
  const Eigen::Vector4d& box = detection.box_px;
  if (!box.allFinite()) return {0, 0, 0, 0};
  return {clamp(box[0], camera.width), clamp(box[1], camera.height),
          clamp(box[2] + 1.0, camera.width), clamp(box[3] + 1.0, camera.height)};
}

cv::Mat1b MaskLabels(const DepthFrame& frame, const std::vector<int32_t>& classes) {
  cv::Mat1b mask(frame.camera.height, frame.camera.width, uint8_t{0});
  if (frame.labels.empty() || classes.empty()) return mask;
  std::array<bool, 256> moves{};
  for (const int32_t id : classes) {
    if (id > 0 && id < 256) moves[static_cast<size_t>(id)] = true;
  }
  for (size_t i = 0; i < frame.labels.size(); ++i) {
    mask.data[i] = moves[frame.labels[i] >> 8] ? 1 : 0;
  }
  return mask;
}

void AddReading(const DepthFrame& frame, const PixelBox& box, const Eigen::Vector2d& pixel,
                std::vector<float>* readings) {
  if (!pixel.allFinite() || pixel.cwiseAbs().maxCoeff() > 1e6) return;
  const int u = static_cast<int>(std::lround(pixel.x()));
  const int v = static_cast<int>(std::lround(pixel.y()));
  if (u < box.left || u >= box.right || v < box.top || v >= box.bottom) return;
  const float depth_m = frame.depth_m[static_cast<size_t>(v * frame.camera.width + u)];
  if (depth_m > 0.0f) readings->push_back(depth_m);
}

// Median depth of the torso, 0 if it cannot be seen.
float TorsoDepth(const DepthFrame& frame, const PixelBox& box, const HumanDetection& detection,
                 double visibility_min) {
  std::vector<float> readings;
  for (const auto& [from, to] : kTorsoBones) {
    const size_t a = static_cast<size_t>(from);
    const size_t b = static_cast<size_t>(to);
    if (detection.joint_visibility[a] < visibility_min) continue;
    if (detection.joint_visibility[b] < visibility_min) continue;
    for (int i = 0; i <= kStepsPerBone; ++i) {
      const double t = static_cast<double>(i) / kStepsPerBone;
      AddReading(frame, box, (1.0 - t) * detection.joints_px[a] + t * detection.joints_px[b],
                 &readings);
    }
  }
  if (readings.empty()) {
    const int width = box.right - box.left;
    const int height = box.bottom - box.top;
    for (int v = box.top + height / 5; v < box.top + (3 * height) / 5; ++v) {
      for (int u = box.left + width / 3; u < box.right - width / 3; ++u) {
        AddReading(frame, box, Eigen::Vector2d(u, v), &readings);
      }
    }
  }
  if (readings.empty()) return 0.0f;
  const auto middle = readings.begin() + static_cast<std::ptrdiff_t>(readings.size() / 2);
  std::nth_element(readings.begin(), middle, readings.end());
  return *middle;
}

void MaskBox(const DepthFrame& frame, const HumanDetection& detection, const cv::Mat1b& labelled,
             const DepthOptions& options, cv::Mat1b* mask) {
  const PixelBox box = BoxOf(detection, frame.camera);
  if (box.left >= box.right || box.top >= box.bottom) return;
  const cv::Rect rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  if (cv::countNonZero(labelled(rect)) > options.labelled_share_min * rect.area()) return;
  const float torso_m = TorsoDepth(frame, box, detection, options.joint_visibility_min);
  if (torso_m <= 0.0f) return;
  for (int v = box.top; v < box.bottom; ++v) {
    for (int u = box.left; u < box.right; ++u) {
      const float depth_m = frame.depth_m[static_cast<size_t>(v * frame.camera.width + u)];
      if (depth_m > 0.0f && std::abs(depth_m - torso_m) < options.body_reach_m) (*mask)(v, u) = 1;
    }
  }
}

cv::Mat1b Grow(const cv::Mat1b& mask, int growth_px) {
  if (growth_px <= 0) return mask;
  const int side = 2 * growth_px + 1;
  cv::Mat1b grown;
  cv::dilate(mask, grown, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return grown;
}

// 1 where the readings of the 3x3 pixels around differ by more than `edge_m`; no reading is none.
cv::Mat1b DepthEdges(const DepthFrame& frame, double edge_m) {
  const cv::Mat1f depth(frame.camera.height, frame.camera.width,
                        const_cast<float*>(frame.depth_m.data()));
  cv::Mat1f nearest = depth.clone();
  nearest.setTo(kFar, depth <= 0.0f);
  cv::Mat1f farthest;
  const cv::Mat kernel = cv::Mat::ones(3, 3, CV_8U);
  cv::dilate(depth, farthest, kernel);
  cv::erode(nearest, nearest, kernel);
  cv::Mat1f step;
  cv::subtract(farthest, nearest, step);
  cv::Mat1b edges;
  cv::compare(step, edge_m, edges, cv::CMP_GT);
  return edges;
}

}  // namespace

std::vector<uint8_t> MaskPeople(const DepthFrame& frame,
                                const std::vector<HumanDetection>& detections,
                                const DepthOptions& options) {
  const cv::Mat1b labelled = MaskLabels(frame, options.dynamic_classes);
  cv::Mat1b mask = labelled.clone();
  for (const HumanDetection& detection : detections) {
    MaskBox(frame, detection, labelled, options, &mask);
  }
  if (cv::countNonZero(mask) == 0) return {};
  const int growth_px = std::clamp(options.mask_growth_px, 0, 100);
  mask = Grow(mask, growth_px);
  cv::Mat1b rim;
  cv::bitwise_and(Grow(mask, std::max(growth_px, 1)), DepthEdges(frame, options.mask_edge_m), rim);
  mask.setTo(1, rim);
  return {mask.datastart, mask.dataend};
}

}  // namespace dsg::ingest
