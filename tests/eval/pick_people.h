// SPDX-License-Identifier: Apache-2.0
// People's tracks as a tracker makes them of what cameras see: noise, losses, wrong identities.
// Refuses to follow anybody whom no camera sees.
#pragma once

#include <map>
#include <vector>

#include "ingest/agents/contacts/contacts.h"
#include "ingest/simulator/body/human_motion.h"
#include "schema/model/trajectory.h"
#include "tests/eval/pick_cameras.h"

namespace dsg::eval {

struct PersonTrack {
  NodeId id;
  std::vector<TimedPose> poses;
  std::vector<BodyShape> shapes;
  /// Poses of each person.
  std::map<int, int> votes;
};

/// Threads: one caller at a time.
class PeopleSensor {
 public:
  /// All must outlive this.
  PeopleSensor(const simulator::CrowdMotion& crowd, const PickSensorModel& sensor, uint64_t seed);

  /// Who is where; from the same instant on, bodies() stand in the way.
  void SetTime(TimeNs at_ns);
  const std::vector<Blocker>& bodies() const { return bodies_; }
  void Look(const simulator::FloorPlan& plan, const Cameras& cameras);

  const std::vector<PersonTrack>& tracks() const { return tracks_; }
  /// When a person was tracked, ascending.
  const std::vector<TimeNs>& seen_ns(int person) const { return at_[person].seen_ns; }

 private:
  struct Person {
    simulator::BodyState state;
    Random random;
    Eigen::Vector3d error_m = Eigen::Vector3d::Zero();
    double depth_log = 0.0;
    TimeNs lost_until_ns = 0;
    int track = -1;
    std::vector<TimeNs> seen_ns;
  };

  double Visibility(const simulator::FloorPlan& plan, const Cameras& cameras, int person) const;
  void Follow(int person, double visibility);
  void Record(int person, double visibility);
  void SwapNear();

  const simulator::CrowdMotion& crowd_;
  const PickSensorModel& sensor_;
  TimeNs now_ns_ = 0;
  std::vector<Person> at_;
  std::vector<Blocker> bodies_;
  std::vector<PersonTrack> tracks_;
  /// Of pairs, lower first: near each other at the last instant.
  std::map<std::pair<int, int>, bool> was_near_;
  Random swap_random_;
};

}  // namespace dsg::eval
