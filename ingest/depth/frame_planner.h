// SPDX-License-Identifier: Apache-2.0
// Which pictures, pose and detections make a depth frame, told by stamps alone.
// Refuses to open a picture: plans are light and wait cheaply.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ingest/depth/frame_maker.h"
#include "ingest/trajectory/robot_path.h"

namespace dsg::ingest {

/// What a frame will be made of.
struct FramePlan {
  TimeNs time_ns = 0;
  /// As the log gives it: corrections of the path come later.
  Pose3d odom_T_body;
  /// depth0, cam0 of a stereo pair, or lidar0.
  FrameMaker::Picture main;
  /// cam1 of a stereo pair.
  std::optional<FrameMaker::Picture> right;
  /// color0, or cam0 in its place.
  std::optional<FrameMaker::Picture> color;
  std::optional<FrameMaker::Picture> label;
  std::vector<HumanDetection> detections;
};

/// Plans depend on what was added and its order only, not on when they are taken.
///
/// Threads: one caller at a time.
class FramePlanner {
 public:
  enum class Source { kNone, kDepth, kStereo, kLidar };

  /// `rate_hz` is that of the depth camera, 0 = unknown.
  /// `path` must outlive the planner.
  FramePlanner(Source source, double rate_hz, const DepthOptions& options, const RobotPath& path);

  void AddPicture(FrameMaker::Picture picture);
  /// The path has got another pose.
  void NotePose();
  void AddDetection(const HumanDetection& detection);
  void Finish();

  /// Ascending in time, to be taken from the front.
  std::deque<FramePlan>& plans() { return plans_; }
  bool is_finished() const { return is_finished_; }
  const SkipCounts& skips() const { return skips_; }
  /// Pictures kept back; bounded.
  size_t waiting_count() const;

 private:
  using Pictures = std::map<TimeNs, FrameMaker::Picture>;

  void Plan();
  bool PlanFront();
  void MakePlan(FrameMaker::Picture main, const Pose3d& odom_T_body);
  /// How far from the main picture's stamp another may be.
  TimeNs ToleranceAt(TimeNs time_ns) const;
  std::optional<FrameMaker::Picture> Nearest(const std::string& channel, TimeNs time_ns,
                                             TimeNs tolerance_ns) const;
  void ForgetBefore(TimeNs time_ns);

  Source source_;
  double rate_hz_;
  DepthOptions options_;
  std::string main_channel_;
  const RobotPath& path_;
  std::map<std::string, Pictures> waiting_;
  std::deque<HumanDetection> detections_;
  std::deque<FramePlan> plans_;
  SkipCounts skips_;
  /// The latest stamp of pictures and detections. Poses do not count: whoever has all of them
  /// beforehand may give them first.
  TimeNs now_ns_ = kTimeMin;
  /// Of the main channel: the last decided on, and the last that became a plan.
  std::optional<TimeNs> last_main_ns_;
  std::optional<TimeNs> last_plan_ns_;
  int64_t main_count_ = 0;
  int64_t other_count_ = 0;
  bool is_finished_ = false;
};

}  // namespace dsg::ingest
