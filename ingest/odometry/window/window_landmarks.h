// SPDX-License-Identifier: Apache-2.0
// The landmarks of a window of keyframes: who saw them, and how far away they are.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "ingest/odometry/window/landmark_factor.h"
#include "ingest/odometry/window/seen_landmark.h"
#include "ingest/odometry/window/window_options.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A feature of a keyframe's left image, by the tracker's id.
struct FeatureSight {
  int64_t feature_id = 0;
  LandmarkSight sight;
};

struct WindowLandmark {
  struct Sight {
    /// Number of the keyframe.
    int64_t keyframe = 0;
    LandmarkSight seen;
  };

  /// Ascending by keyframe.
  std::vector<Sight> sights;
  /// Of `sights`, once the distance is known.
  std::optional<size_t> anchor;
  LandmarkBlock block{};

  /// Requires: an anchor.
  int64_t anchor_keyframe() const { return sights[*anchor].keyframe; }
  /// A landmark that one image saw tells nothing of the keyframes.
  bool tells() const { return anchor.has_value() && sights.size() > 1; }
};

/// Where the keyframes of the window are by now. Their numbers ascend by one.
struct WindowPoses {
  int64_t oldest_keyframe = 0;
  std::vector<Pose3d> map_T_imu;
  /// Of the camera, in the same order; none of it is known without a unit.
  std::vector<CameraMotion> motions;
  CalibrationError calibration_error{};

  int64_t newest_keyframe() const { return oldest_keyframe + std::ssize(map_T_imu) - 1; }
  /// Requires: a keyframe of the window.
  const Pose3d& Of(int64_t keyframe) const {
    return map_T_imu[static_cast<size_t>(keyframe - oldest_keyframe)];
  }
  const CameraMotion& MotionOf(int64_t keyframe) const {
    return motions[static_cast<size_t>(keyframe - oldest_keyframe)];
  }
};

/// Threads: one caller at a time. Cost of each call: the landmarks times their sights.
class WindowLandmarks {
 public:
  WindowLandmarks(const StereoModel& model, const WindowOptions& options);

  void Clear() { landmarks_.clear(); }
  void AddSights(int64_t keyframe, std::span<const FeatureSight> sights);

  /// Finds the distances of those that have none yet: by a disparity, or else where the first ray
  /// and the last one come nearest to each other.
  void Anchor(const WindowPoses& poses);

  /// Drops those that miss their images by more than `miss_px_max` on average, or have left the
  /// distances that are taken. Returns the features among them that the newest keyframe sees,
  /// ascending.
  std::vector<int64_t> DropMisfits(double miss_px_max, const WindowPoses& poses);

  /// Leaves to a keyframe that becomes a prior those that it saw first; others lose their sights in
  /// it.
  void DropSightsOf(int64_t oldest_keyframe);
  /// Those with their anchor in that keyframe, and those without sights.
  void ForgetAnchoredIn(int64_t keyframe);
  /// Features that are no longer followed and never got a distance.
  void ForgetLost(int64_t newest_keyframe);

  /// Map; nullopt while the distance is not known, or infinite.
  std::optional<Eigen::Vector3d> PointOf(int64_t feature_id, const WindowPoses& poses) const;
  /// With a distance, ascending by feature.
  std::vector<SeenLandmark> Told(const WindowPoses& poses) const;

  /// By feature.
  const std::map<int64_t, WindowLandmark>& all() const { return landmarks_; }
  std::map<int64_t, WindowLandmark>& all() { return landmarks_; }

 private:
  bool IsNearEnough(double inverse_depth) const;
  void SetAnchor(size_t sight, double inverse_depth, WindowLandmark* landmark) const;
  bool AnchorByDisparity(const CalibrationError& error, WindowLandmark* landmark) const;
  void AnchorByParallax(const WindowPoses& poses, WindowLandmark* landmark) const;
  double MissOf(const WindowLandmark& landmark, const WindowPoses& poses) const;
  std::optional<Eigen::Vector3d> PointOf(const WindowLandmark& landmark,
                                         const WindowPoses& poses) const;

  const StereoModel model_;
  const WindowOptions options_;
  std::map<int64_t, WindowLandmark> landmarks_;
};

}  // namespace dsg::ingest
