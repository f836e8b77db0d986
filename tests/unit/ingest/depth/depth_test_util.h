// SPDX-License-Identifier: Apache-2.0
// What the tests of depth frames share: cameras, pictures made of formulas.
// Refuses to read files.
#pragma once

#include <cstring>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "ingest/depth/frame_maker.h"

namespace dsg::ingest {

inline constexpr TimeNs kMs = 1'000'000;

inline CameraCalibration TestCamera(const std::string& name, int width = 64, int height = 48) {
  CameraCalibration camera;
  camera.name = name;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.8 * width;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

/// A robot with a depth camera, colour and labels of the same place.
inline RigCalibration TestRig(int width = 64, int height = 48) {
  RigCalibration rig;
  for (const char* name : {"cam0", "color0", "depth0", "label0"}) {
    rig.cameras.push_back(TestCamera(name, width, height));
  }
  return rig;
}

inline Image TestImage(int width, int height, PixelFormat format,
                       const std::function<void(int, int, uint8_t*)>& paint) {
  Image image{width, height, format, {}};
  image.bytes.resize(image.Offset(0, height));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) paint(u, v, image.bytes.data() + image.Offset(u, v));
  }
  return image;
}

inline Image Depth32Image(int width, int height, const std::function<float(int, int)>& depth_m) {
  return TestImage(width, height, PixelFormat::kDepth32, [&](int u, int v, uint8_t* at) {
    const float metres = depth_m(u, v);
    std::memcpy(at, &metres, sizeof metres);
  });
}

inline void Put16(uint16_t value, uint8_t* at) {
  at[0] = static_cast<uint8_t>(value & 0xff);
  at[1] = static_cast<uint8_t>(value >> 8);
}

inline Image Depth16Image(int width, int height,
                          const std::function<uint16_t(int, int)>& millimetres) {
  return TestImage(width, height, PixelFormat::kDepth16,
                   [&](int u, int v, uint8_t* at) { Put16(millimetres(u, v), at); });
}

inline Image LabelImage(int width, int height, const std::function<uint16_t(int, int)>& label) {
  return TestImage(width, height, PixelFormat::kLabel16,
                   [&](int u, int v, uint8_t* at) { Put16(label(u, v), at); });
}

inline Image GrayImage(int width, int height, const std::function<double(int, int)>& gray) {
  return TestImage(width, height, PixelFormat::kGray8, [&](int u, int v, uint8_t* at) {
    *at = static_cast<uint8_t>(std::clamp(gray(u, v), 0.0, 255.0) + 0.5);
  });
}

inline Image ColorImage(int width, int height, uint8_t red) {
  return TestImage(width, height, PixelFormat::kRgb8, [&](int u, int v, uint8_t* at) {
    at[0] = red;
    at[1] = static_cast<uint8_t>(u);
    at[2] = static_cast<uint8_t>(v);
  });
}

inline Image FlatDepth(float metres, int width = 64, int height = 48) {
  return Depth32Image(width, height, [&](int, int) { return metres; });
}

struct OwnPath {
  RobotPath path;
};

// A frame maker with a path of its own.
class PosedFrameMaker : private OwnPath, public FrameMaker {
 public:
  PosedFrameMaker(const RigCalibration& rig, const DepthOptions& options)
      : FrameMaker(rig, options, path) {}

  void AddPose(TimeNs time_ns, const Pose3d& odom_T_body) {
    path.Add({.time_ns = time_ns, .map_T_agent = odom_T_body});
    NotePose();
  }
};

inline FrameMaker::Picture Shot(TimeNs time_ns, const std::string& channel, Image image) {
  return {time_ns, channel, channel + ".png",
          [image = std::move(image)]() -> absl::StatusOr<Image> { return image; }};
}

inline FrameMaker::Picture BrokenShot(TimeNs time_ns, const std::string& channel) {
  return {time_ns, channel, channel + ".png",
          []() -> absl::StatusOr<Image> { return absl::InvalidArgumentError("not a picture"); }};
}

inline Pose3d At(double x, double y = 0.0, double z = 0.0) {
  Pose3d pose;
  pose.position = {x, y, z};
  return pose;
}

/// Ends the log and takes all that is left.
inline std::vector<DepthFrame> Drain(FrameMaker* maker) {
  maker->Finish();
  std::vector<DepthFrame> frames;
  while (std::optional<DepthFrame> frame = maker->Next()) frames.push_back(*std::move(frame));
  return frames;
}

}  // namespace dsg::ingest
