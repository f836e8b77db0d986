// SPDX-License-Identifier: Apache-2.0
// Opens the pictures of a plan and makes the depth frame: rectified, cleaned, masked.
// Refuses to remember anything from one frame to the next, so that frames may be made in any order.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ingest/depth/frame_planner.h"
#include "ingest/depth/pixel_map.h"
#include "ingest/depth/stereo.h"

namespace dsg::ingest {

struct BuiltFrame {
  /// One, or the views of a lidar's scan; none when there is no depth, `skips` says why.
  std::vector<DepthFrame> frames;
  /// Why a frame, its colour or its labels are missing.
  std::vector<std::string> skips;
};

class FrameBuilder {
 public:
  FrameBuilder(const RigCalibration& rig, const DepthOptions& options);

  FramePlanner::Source source() const { return source_; }

  /// Threads: any number of callers.
  BuiltFrame Build(const FramePlan& plan) const;

 private:
  /// A channel whose pixels stand beside the depth's.
  struct Overlay {
    CameraCalibration camera;
    /// Missing when it looks from elsewhere.
    std::optional<PixelMap> map;
  };

  BuiltFrame BuildViews(const FramePlan& plan) const;
  void AddOverlay(const RigCalibration& rig, const std::string& channel);
  /// Into the one frame of `built`, these and those below.
  bool FillDepth(const FramePlan& plan, BuiltFrame* built) const;
  bool FillStereo(const FramePlan& plan, BuiltFrame* built) const;
  /// Null, and a reason in `built`, if the picture cannot be laid over the depth.
  const Overlay* OverlayFor(const std::string& channel, const Image& image, const std::string& what,
                            BuiltFrame* built) const;
  void FillColor(const FramePlan& plan, BuiltFrame* built) const;
  void FillLabels(const FramePlan& plan, BuiltFrame* built) const;
  std::vector<HumanDetection> InFrame(const std::vector<HumanDetection>& detections) const;

  RigCalibration rig_;
  DepthOptions options_;
  FramePlanner::Source source_ = FramePlanner::Source::kNone;
  /// Of the frames: a pinhole.
  CameraCalibration camera_;
  std::optional<CameraCalibration> depth_camera_;
  std::optional<PixelMap> depth_map_;
  std::optional<StereoDepth> stereo_;
  std::map<std::string, Overlay> overlays_;
};

}  // namespace dsg::ingest
