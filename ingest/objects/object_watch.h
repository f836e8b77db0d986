// SPDX-License-Identifier: Apache-2.0
// Whether small things are still where they were: each picture votes, by class and depth.
// Refuses to judge large things, whose removal the volume shows, and what nobody looked at.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "ingest/objects/object_tracker.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/trajectory/trajectory_change.h"

namespace dsg::ingest {

/// A thing that is no longer where it was.
struct VacatedObject {
  int64_t id = -1;
  /// The last picture that showed it, and the first of those that showed its place without it.
  TimeNs last_present_ns = 0;
  TimeNs first_absent_ns = 0;
};

/// A volume forgets a thing on a table slowly, since most rays that pass where it was graze the
/// table: labels bleed, and its surface stays for minutes. Votes need some pictures.
///
/// Threads: one caller at a time.
/// Source: Schmid et al., 2024 (Khronos): votes of rays for presence and absence, occlusion none.
class ObjectWatch {
 public:
  explicit ObjectWatch(const WatchOptions& options = {}) : options_(options) {}

  /// Lets a picture vote on all that is watched. Pictures without labels do not vote.
  void Watch(const DepthFrame& frame);

  /// Those of the watched that have been vacated since the last call, ascending by id. Their places
  /// are watched on, and are free again once something of the class is seen there.
  std::vector<VacatedObject> TakeVacated();

  /// Without what has stayed in the mesh of things that are gone.
  void DropResidues(std::vector<ObjectCluster>* clusters) const;

  /// The path that things were seen from has moved.
  void Move(const TrajectoryChange& change);

  /// Watches these from now on, and no others.
  void Follow(const std::vector<TrackedObject>& objects);

 private:
  struct Spot {
    int32_t class_id = -1;
    Box3d box_map;
    /// Well inside the thing, so that its silhouette does not matter.
    std::vector<Eigen::Vector3d> samples_map;
    Eigen::Vector3d center_map = Eigen::Vector3d::Zero();
    int64_t present_count = 0;
    TimeNs last_present_ns = 0;
    /// Pictures in a row.
    int absent_run = 0;
    int present_run = 0;
    TimeNs first_absent_ns = 0;
    bool is_vacated = false;
  };

  void Vote(const DepthFrame& frame, Spot* spot) const;

  WatchOptions options_;
  std::map<int64_t, Spot> spots_;
  std::vector<VacatedObject> vacated_;
};

}  // namespace dsg::ingest
