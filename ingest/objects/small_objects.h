// SPDX-License-Identifier: Apache-2.0
// Small things found in pictures: cups, phones and bottles that a volume's voxels are too large
// for. Refuses to tell of what it saw a few times only, and of what somebody holds.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "ingest/objects/object_cluster.h"
#include "ingest/objects/object_options.h"
#include "ingest/objects/small_sightings.h"
#include "ingest/trajectory/trajectory_change.h"

namespace dsg::ingest {

/// A class is one of small things if next to all of its sightings are small: names do not matter.
///
/// Threads: one caller at a time.
/// Source: Schmid et al., 2024 (Khronos): sightings of labelled parts, tracked and then confirmed.
class SmallObjects {
 public:
  explicit SmallObjects(const SmallOptions& options = {})
      : span_m_max_(options.span_m), options_(options.thing) {}

  /// Which known things a picture shows. `sightings`: of FindSmallSightings.
  void See(const DepthFrame& frame, std::vector<SmallSighting> sightings);

  /// Puts the confirmed things in the place of the clusters of their classes that they overlap: a
  /// thing is one object, and a lump of several is none. A cluster's instance goes to the thing, if
  /// it is one. Order of the result: as FindClusters.
  void Place(std::vector<ObjectCluster>* clusters, const BoxOptions& box_options = {}) const;

  /// Whether next to all sightings of a class were small.
  bool IsSmallClass(int32_t class_id) const;

  /// The path that things were seen from has moved: each moves by when it was seen.
  void Move(const TrajectoryChange& change);

  /// Forgets the things of a class within a box; those that were seen at or after `gone_ns` are
  /// others, which were not there before.
  void Forget(int32_t class_id, const Box3d& box_map, TimeNs gone_ns);

 private:
  /// What was seen from one side, from near and where the thing is on the whole.
  struct View {
    double badness_m = 0.0;
    /// To the far side.
    Eigen::Vector3f hidden_map = Eigen::Vector3f::Zero();
    std::vector<Eigen::Vector3f> points_map;
  };
  static constexpr size_t kSideCount = 8;

  struct Thing {
    int32_t class_id = -1;
    Eigen::Vector3d center_map = Eigen::Vector3d::Zero();
    /// Inverse covariance of the mean.
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    double span_m = 0.0;
    TimeNs first_seen_ns = 0;
    TimeNs last_seen_ns = 0;
    int64_t whole_count = 0;
    /// Pictures that should have shown it, and did or did not.
    int64_t seen_count = 0;
    int64_t missed_count = 0;
    Box3d cameras_map;
    std::array<View, kSideCount> views;
    /// Ids of things of the class that one picture showed beside it.
    std::set<int64_t> beside;
    Color color{};
  };

  struct ClassSize {
    int64_t small_count = 0;
    int64_t large_count = 0;
  };

  std::vector<int64_t> Associate(const std::vector<SmallSighting>& sightings) const;
  bool IsLump(const SmallSighting& seen) const;
  bool IsNew(const SmallSighting& seen) const;
  void Update(const SmallSighting& seen, const DepthFrame& frame, Thing* thing) const;
  void CountMisses(const DepthFrame& frame, const std::vector<int64_t>& thing_of);
  void Join(const std::vector<int64_t>& thing_of);
  void Tidy(TimeNs now_ns);
  bool IsConfirmed(const Thing& thing) const;
  static ObjectCluster ClusterOf(const Thing& thing, const BoxOptions& box_options);

  double span_m_max_;
  SmallThingOptions options_;
  std::map<int32_t, ClassSize> sizes_;
  std::map<int64_t, Thing> things_;
  int64_t next_id_ = 0;
};

}  // namespace dsg::ingest
