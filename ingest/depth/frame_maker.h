// SPDX-License-Identifier: Apache-2.0
// From the images of a sensor log to depth frames ready to be fused.
// Refuses to guess poses: a frame between two poses of the robot gets theirs, others wait or go.
// All poses are those of the odometry frame: RobotPath::ToMap brings a frame into the map.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/depth/depth_options.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/human_detection.h"
#include "ingest/sensor/image.h"
#include "ingest/trajectory/robot_path.h"

namespace dsg::ingest {

/// What could not be used, by reason, in words for the user. Frames: "no depth image", "no right
/// image", "no points", "no pose", "pose jump", "size differs from calibration", "broken image",
/// "out of order". Frames that came without colour or labels: "colour left out: ...", "labels left
/// out: ..." and why.
using SkipCounts = std::map<std::string, int64_t>;

/// Put in what the log says, in its order; take out frames once all they need is there.
///
/// Depth is depth0's; without one lidar0's, whose scans give a frame for each side on which there
/// are points (ViewsOfCloud); without that of the left image of cam0 and cam1. Colour and
/// labels are those of the nearest stamp within DepthOptions::tolerance_ns and half the depth
/// period, laid over the depth pixel by pixel if their camera stands in the same place; cam0 stands
/// in for a missing color0. Depth of a camera with distortion is rectified to a pinhole of the same
/// size. No reading: 0, NaN, infinity, 65535 mm.
///
/// Order: stamps ascend, but for 20 ms between channels. A frame comes out when the next one is
/// known, or after Finish. What comes out does not depend on when Next is called.
/// Cost: pictures wait unopened, at most 10000 of a channel; then the oldest goes ("no pose").
/// Threads: one caller at a time; images are decoded in the background, one frame ahead, which
/// changes no result.
class FrameMaker {
 public:
  /// An image as a log gives it.
  struct Picture {
    TimeNs time_ns = 0;
    /// "cam0", "cam1", "color0", "depth0", "label0", "lidar0"; others are ignored.
    std::string channel;
    std::string origin;
    std::function<absl::StatusOr<Image>()> load;
  };

  /// `path`: poses of the rig's body. Must outlive the maker.
  FrameMaker(const RigCalibration& rig, const DepthOptions& options, const RobotPath& path);
  ~FrameMaker();

  /// True when the rig can give depth at all: a depth camera, a lidar, or two rectifiable grey
  /// cameras.
  bool CanMakeFrames() const;

  void AddPicture(Picture picture);
  /// The path has got another pose.
  void NotePose();
  void AddDetection(const HumanDetection& detection);

  /// The next frame; times do not descend. nullopt when more of the log is needed. After Finish,
  /// nullopt means that there are no more.
  std::optional<DepthFrame> Next();
  /// No more of the log will come.
  void Finish();

  /// Of the frames taken out so far; complete when Next gives nothing after Finish.
  const SkipCounts& skips() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
