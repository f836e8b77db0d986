// SPDX-License-Identifier: Apache-2.0
// People as a stage: detections wait until it is known where the camera was and what its depth
// says, then become observations, these become tracks, and what changed of them is told.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "ingest/agents/tracking/person_tracker.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/pipeline/people_told.h"
#include "ingest/pipeline/stage.h"
#include "ingest/pipeline/stage_clock.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/human_detection.h"
#include "ingest/trajectory/robot_path.h"

namespace dsg::ingest {

/// What comes out does not depend on when it is asked.
class PeopleStage : public Stage {
 public:
  /// `has_depth`: frames will come, and detections wait for theirs. `path`: of the body that
  /// carries the cameras; must outlive the stage. `is_on`: false for logs without detections, or if
  /// people are off. `spill_folder`: of PersonTracker.
  PeopleStage(const RigCalibration& rig, const PeopleOptions& options, bool has_depth,
              const RobotPath& path, PeopleTold told, bool is_on,
              const std::string& spill_folder = "");

  void NotePose(TimeNs time_ns) override;
  /// Detections, ascending by stamp.
  bool Take(const Measurement& measurement) override;
  /// All detections up to LookOptions::same_moment_ns after it must have been taken.
  absl::Status See(const DepthFrame& frame) override;
  void Close() override;
  void Tell(Findings* findings, GraphDelta* delta) override;
  void Correct(const TrajectoryChange& change) override { tracker_.Move(change); }
  void Summarize(IngestSummary* summary) const override;

  bool is_on() const { return is_on_; }
  /// Of the disk that tracks wait on; once it is not OK, nothing that was told may be used.
  absl::Status status() const {
    return tracker_.status().ok() ? told_.status() : tracker_.status();
  }
  const PersonTracker& tracker() const { return tracker_; }
  PeopleTold& told() { return told_; }
  const PeopleTold& told() const { return told_; }

 private:
  /// All detections of one stamp.
  struct Image {
    TimeNs time_ns = 0;
    std::vector<HumanDetection> detections;
  };

  void AddDetection(HumanDetection detection);
  PeopleCounts Counts() const;
  void TakeUntil(TimeNs until_ns, const DepthFrame* frame);
  void Track(const Image& image, const DepthFrame* frame);
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
  bool is_on_;
  const RobotPath& path_;
  std::deque<Image> waiting_;
  std::vector<double> floors_m_;
  PersonTracker tracker_;
  PeopleTold told_;
  PeopleCounts counts_;
  StageClock clock_;
};

}  // namespace dsg::ingest
