// SPDX-License-Identifier: Apache-2.0
// A sensor log's way into people's tracks: detections wait until it is known where the camera was
// and what its depth says, then become observations, and these tracks.
// Refuses to know the store and the nodes.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "ingest/agents/tracking/person_tracker.h"
#include "ingest/depth/pose_track.h"
#include "ingest/pipeline/people_options.h"
#include "ingest/pipeline/stage_clock.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/human_detection.h"

namespace dsg::ingest {

/// What became of a log's detections, for the user.
struct PeopleCounts {
  int64_t detection_count = 0;
  /// Observations that the tracker took.
  int64_t used_count = 0;
  /// Detections that were left out, by reason in words.
  std::map<std::string, int64_t> rejected;
  /// Believed ones, then those too short to believe.
  int64_t track_count = 0;
  int64_t dropped_track_count = 0;
  int64_t same_as_count = 0;
};

/// What comes out does not depend on when it is asked. Threads: one caller at a time.
class PersonMapper {
 public:
  /// `has_depth`: frames will come, and detections wait for theirs.
  PersonMapper(const RigCalibration& rig, const PeopleOptions& options, bool has_depth);

  /// Pose of the robot's body, ascending.
  void AddPose(TimeNs time_ns, const Pose3d& map_T_body);
  /// Ascending by stamp.
  void AddDetection(HumanDetection detection);
  /// Ascending by stamp; all detections up to 20 ms after it must have been added.
  void AddFrame(const DepthFrame& frame);
  /// Heights of the storeys' floors that the map knows, ascending.
  void SetFloors(std::vector<double> floors_m) { floors_m_ = std::move(floors_m); }
  /// No more will come.
  void Close();

  PersonTracker& tracker() { return tracker_; }
  PeopleCounts counts() const;
  const StageClock& clock() const { return clock_; }

 private:
  /// All detections of one stamp.
  struct Image {
    TimeNs time_ns = 0;
    std::vector<HumanDetection> detections;
  };

  void TakeUntil(TimeNs until_ns, const DepthFrame* frame);
  void Take(const Image& image, const DepthFrame* frame);
  struct Filtered {
    const HumanDetection* detection = nullptr;
    bool is_weak = false;
  };
  std::vector<Filtered> Filter(const Image& image);
  const CameraCalibration* CameraOf(const std::string& name) const;
  std::optional<double> FloorUnder(double camera_z_m) const;

  RigCalibration rig_;
  PeopleOptions options_;
  bool has_depth_;
  PoseTrack poses_;
  std::deque<Image> waiting_;
  std::vector<double> floors_m_;
  PersonTracker tracker_;
  PeopleCounts counts_;
  StageClock clock_;
};

}  // namespace dsg::ingest
