// SPDX-License-Identifier: Apache-2.0
// Things that were seen in somebody's hand while they were on their way.
// Refuses to say whose hand it was, and which of the things of a class.
#pragma once

#include <map>
#include <vector>

#include "ingest/objects/small_sightings.h"
#include "ingest/trajectory/trajectory_change.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// One way of a thing, as far as pictures showed it.
struct Carry {
  int32_t class_id = -1;
  struct Point {
    TimeNs time_ns = 0;
    Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  };
  /// Ascending in time.
  std::vector<Point> way;
};

/// Threads: one caller at a time.
class CarriedThings {
 public:
  explicit CarriedThings(const SmallOptions& options = {})
      : span_m_max_(options.span_m), options_(options.carry) {}

  /// Takes what touches a person; the rest of a picture's sightings is passed over.
  void See(const std::vector<SmallSighting>& sightings, TimeNs time_ns);

  /// The path that things were seen from has moved.
  void Move(const TrajectoryChange& change);

  /// Those that were seen often enough and went far enough: a thing that somebody stands beside
  /// does not move. Order: ascending by begin.
  std::vector<Carry> Carries() const;

 private:
  bool IsWay(const Carry& carry) const;

  double span_m_max_;
  CarryOptions options_;
  std::vector<Carry> carries_;
};

}  // namespace dsg::ingest
