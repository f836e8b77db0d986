// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/body_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "ingest/agents/detections/lens.h"

namespace dsg::ingest {
namespace {

// Hips, spine, neck, shoulders: what an arm in front of the camera does not show.
constexpr std::array<size_t, 8> kTorsoJoints = {1, 2, 3, 6, 9, 12, 16, 17};

struct PixelRange {
  int left = 0, top = 0, right = 0, bottom = 0;
  int stride = 1;
  bool IsEmpty() const { return left >= right || top >= bottom; }
};

// A detector's pixel in the depth picture; exact when both cameras stand in one place.
class PixelMapper {
 public:
  PixelMapper(const PlacedBody& body, const DepthFrame& depth)
      : body_(body),
        depth_(depth),
        depth_T_camera_(depth.map_T_camera.Inverse() * body.map_T_camera),
        depth_m_((body.map_T_camera.Inverse() * body.torso_map).z()) {}

  std::optional<Eigen::Vector2d> operator()(const Eigen::Vector2d& pixel) const {
    const auto ray = RayThrough(*body_.camera, pixel);
    if (!ray.has_value()) return std::nullopt;
    const Eigen::Vector3d point = depth_T_camera_ * (*ray * depth_m_);
    if (!(point.z() > 0.05)) return std::nullopt;
    return Project(depth_.camera, point);
  }

 private:
  const PlacedBody& body_;
  const DepthFrame& depth_;
  Pose3d depth_T_camera_;
  double depth_m_;
};

PixelRange BoxInDepth(const PlacedBody& body, const DepthFrame& depth, const PixelMapper& map) {
  const Eigen::Vector4d& box = body.detection->box_px;
  const double margin_px = body.depth_options.box_margin_px;
  Eigen::AlignedBox2d range;
  for (const double u : {box[0], box[2]}) {
    for (const double v : {box[1], box[3]}) {
      const auto pixel = map({u, v});
      if (!pixel.has_value() || !pixel->allFinite()) return {};
      range.extend(*pixel);
    }
  }
  const auto clamped = [](double value, int size) {
    return static_cast<int>(std::clamp(std::round(value), 0.0, static_cast<double>(size)));
  };
  PixelRange pixels;
  pixels.left = clamped(range.min().x() - margin_px, depth.camera.width);
  pixels.top = clamped(range.min().y() - margin_px, depth.camera.height);
  pixels.right = clamped(range.max().x() + margin_px + 1.0, depth.camera.width);
  pixels.bottom = clamped(range.max().y() + margin_px + 1.0, depth.camera.height);
  const double area = static_cast<double>(pixels.right - pixels.left) *
                      static_cast<double>(pixels.bottom - pixels.top);
  pixels.stride =
      std::max(1, static_cast<int>(std::lround(std::sqrt(area / body.depth_options.sample_count))));
  return pixels;
}

struct Pixel {
  int u = 0, v = 0;
  float depth_m = 0.0f;
};

// Readings in the range for which `is_body` of their index holds.
template <typename IsBody>
std::vector<Pixel> Gather(const DepthFrame& depth, const PixelRange& range, IsBody is_body) {
  std::vector<Pixel> pixels;
  for (int v = range.top; v < range.bottom; v += range.stride) {
    for (int u = range.left; u < range.right; u += range.stride) {
      const size_t i =
          static_cast<size_t>(v) * static_cast<size_t>(depth.camera.width) + static_cast<size_t>(u);
      if (depth.depth_m[i] > 0.0f && is_body(i)) pixels.push_back({u, v, depth.depth_m[i]});
    }
  }
  return pixels;
}

float MedianDepth(const std::vector<Pixel>& pixels) {
  std::vector<float> depths;
  for (const Pixel& pixel : pixels) depths.push_back(pixel.depth_m);
  const auto middle = depths.begin() + std::ssize(depths) / 2;
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

bool IsMoving(const DepthFrame& depth, size_t i) {
  return depth.dynamic.empty() || depth.dynamic[i] != 0;
}

// Instances are numbered within a class, so that a chair may have the person's number.
std::optional<uint16_t> FindLabel(const PlacedBody& body, const DepthFrame& depth,
                                  const PixelRange& range) {
  const int instance = body.detection->mask_instance & 0xff;
  const double apart_s = 1e-9 * static_cast<double>(depth.time_ns - body.detection->time_ns);
  if (instance == 0 || depth.labels.empty() ||
      std::abs(apart_s) > body.depth_options.same_picture_s) {
    return std::nullopt;
  }
  std::map<uint16_t, int> counts;
  for (const Pixel& pixel : Gather(depth, range, [&](size_t i) {
         return (depth.labels[i] & 0xff) == instance && IsMoving(depth, i);
       })) {
    ++counts[depth.labels[static_cast<size_t>(pixel.v) * static_cast<size_t>(depth.camera.width) +
                          static_cast<size_t>(pixel.u)]];
  }
  std::optional<uint16_t> best;
  int best_count = body.depth_options.pixel_count_min - 1;
  for (const auto& [label, count] : counts) {
    if (count <= best_count) continue;
    best = label;
    best_count = count;
  }
  return best;
}

// Where the trunk should be: patches about its joints, or the middle of the box.
std::vector<PixelRange> TrunkPatches(const PlacedBody& body, const PixelRange& range,
                                     const PixelMapper& map) {
  std::vector<PixelRange> patches;
  const int patch_px = body.depth_options.patch_px;
  for (const size_t joint : kTorsoJoints) {
    if (!body.detection->has_joints ||
        body.detection->joint_visibility[joint] < body.floor_options.visibility_min) {
      continue;
    }
    const auto pixel = map(body.detection->joints_px[joint]);
    if (!pixel.has_value() || !(pixel->cwiseAbs().maxCoeff() < 1e5)) continue;
    const int u = static_cast<int>(std::lround(pixel->x()));
    const int v = static_cast<int>(std::lround(pixel->y()));
    patches.push_back({std::max(u - patch_px, range.left), std::max(v - patch_px, range.top),
                       std::min(u + patch_px + 1, range.right),
                       std::min(v + patch_px + 1, range.bottom), 1});
  }
  if (patches.empty()) {
    const int width = range.right - range.left;
    const int height = range.bottom - range.top;
    patches.push_back({range.left + width / 3, range.top + height / 5, range.right - width / 3,
                       range.top + (3 * height) / 5, range.stride});
  }
  return patches;
}

std::vector<Pixel> GatherByTrunk(const PlacedBody& body, const DepthFrame& depth,
                                 const PixelRange& range, const PixelMapper& map) {
  const auto is_moving = [&](size_t i) { return IsMoving(depth, i); };
  std::vector<Pixel> trunk;
  for (const PixelRange& patch : TrunkPatches(body, range, map)) {
    const std::vector<Pixel> some = Gather(depth, patch, is_moving);
    trunk.insert(trunk.end(), some.begin(), some.end());
  }
  if (std::ssize(trunk) < body.depth_options.pixel_count_min) return {};
  const float middle_m = MedianDepth(trunk);
  const auto reach_m = static_cast<float>(body.depth_options.reach_m);
  return Gather(depth, range, [&](size_t i) {
    return is_moving(i) && std::abs(depth.depth_m[i] - middle_m) < reach_m;
  });
}

}  // namespace

BodyPixels FindBodyPixels(const PlacedBody& body, const DepthFrame& depth) {
  BodyPixels result;
  const PixelMapper map(body, depth);
  const PixelRange range = BoxInDepth(body, depth, map);
  if (range.IsEmpty()) return result;
  std::vector<Pixel> pixels;
  if (const auto label = FindLabel(body, depth, range)) {
    result.is_by_instance = true;
    pixels = Gather(depth, range, [&](size_t i) { return depth.labels[i] == *label; });
  } else {
    pixels = GatherByTrunk(body, depth, range, map);
  }
  if (std::ssize(pixels) < body.depth_options.pixel_count_min) return result;
  // Labels spill over outlines, onto what is behind.
  const float middle_m = MedianDepth(pixels);
  const auto reach_m = static_cast<float>(body.depth_options.reach_m);
  for (const Pixel& pixel : pixels) {
    if (std::abs(pixel.depth_m - middle_m) > reach_m) continue;
    const Eigen::Vector3d ray((pixel.u - depth.camera.cx) / depth.camera.fx,
                              (pixel.v - depth.camera.cy) / depth.camera.fy, 1.0);
    result.points_map.push_back(depth.map_T_camera * (ray * static_cast<double>(pixel.depth_m)));
  }
  return result;
}

}  // namespace dsg::ingest
