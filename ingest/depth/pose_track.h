// SPDX-License-Identifier: Apache-2.0
// Where the robot was at any time between the poses that a log gives.
// Refuses to guess beyond the first and last pose, across gaps, and across jumps.
#pragma once

#include <deque>

#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

class PoseTrack {
 public:
  enum class Answer {
    kKnown,
    /// A later pose may still come.
    kNotYet,
    /// Before the first pose, or in a gap.
    kNone,
    /// The poses around are too far apart for a robot.
    kJump,
  };

  PoseTrack(TimeNs gap_ns_max, double speed_m_s_max)
      : gap_ns_max_(gap_ns_max), speed_m_s_max_(speed_m_s_max) {}

  /// False, and nothing kept, unless it is finite and later than the last one.
  bool Add(TimeNs time_ns, const Pose3d& map_T_body);

  /// Sets `map_T_body` if the answer is kKnown. A pose of that very stamp is checked against the
  /// one before it.
  Answer At(TimeNs time_ns, Pose3d* map_T_body) const;

  /// Forgets what no question about `time_ns` or later needs.
  void ForgetBefore(TimeNs time_ns);

  size_t size() const { return poses_.size(); }

 private:
  struct Stamped {
    TimeNs time_ns;
    Pose3d map_T_body;
  };
  bool IsJump(const Stamped& from, const Stamped& to) const;

  TimeNs gap_ns_max_;
  double speed_m_s_max_;
  std::deque<Stamped> poses_;
};

}  // namespace dsg::ingest
