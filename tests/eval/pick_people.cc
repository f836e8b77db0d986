// SPDX-License-Identifier: Apache-2.0
#include "tests/eval/pick_people.h"

#include <array>
#include <cmath>
#include <utility>

#include "ingest/simulator/body/detection_error.h"
#include "ingest/simulator/body/life.h"

namespace dsg::eval {
namespace {

constexpr uint64_t kPersonStream = 710;
constexpr uint64_t kSwapStream = 700;
constexpr TimeNs kAgainNs = 2 * kNsPerSecond;
// Pelvis, knees, head, shoulders, hands: shares of a body alike.
constexpr std::array<size_t, 8> kProbes = {0, 4, 5, 15, 16, 17, 22, 23};

}  // namespace

PeopleSensor::PeopleSensor(const simulator::CrowdMotion& crowd, const PickSensorModel& sensor,
                           uint64_t seed)
    : crowd_(crowd), sensor_(sensor), swap_random_(seed, kSwapStream) {
  for (int i = 0; i < crowd.count(); ++i) {
    at_.push_back(Person{.state = {}, .random = Random(seed, kPersonStream + i), .seen_ns = {}});
    at_.back().depth_log = simulator::PersonDepthLog(seed, i);
  }
  bodies_.resize(at_.size());
}

void PeopleSensor::SetTime(TimeNs at_ns) {
  now_ns_ = at_ns;
  for (int i = 0; i < crowd_.count(); ++i) {
    at_[i].state = crowd_.StateAt(i, at_ns);
    bodies_[i].at_map = at_[i].state.joints_map[ingest::kPelvis].head<2>();
  }
}

double PeopleSensor::Visibility(const simulator::FloorPlan& plan, const Cameras& cameras,
                                int person) const {
  const auto& joints_map = at_[person].state.joints_map;
  const int room = plan.RoomAt(joints_map[ingest::kPelvis].head<2>());
  int count = 0;
  for (const size_t joint : kProbes) {
    count += cameras.Sees(room, joints_map[joint], sensor_.person_range_m, bodies_, person);
  }
  return static_cast<double>(count) / kProbes.size();
}

void PeopleSensor::Look(const simulator::FloorPlan& plan, const Cameras& cameras) {
  const double frame_s = simulator::SecondsOf(sensor_.frame_ns);
  for (int i = 0; i < crowd_.count(); ++i) {
    Person& person = at_[i];
    // The error forgets itself, seen or not, so that a tier does not change it.
    const double kept = std::exp(-frame_s / sensor_.torso_memory_s);
    for (int axis = 0; axis < 3; ++axis) {
      person.error_m[axis] = kept * person.error_m[axis] + std::sqrt(1.0 - kept * kept) *
                                                               sensor_.torso_sigma_m *
                                                               person.random.Normal();
    }
    if (person.random.Chance(sensor_.loss_per_min * frame_s / 60.0)) {
      person.lost_until_ns =
          now_ns_ + simulator::NsOf(person.random.Uniform(sensor_.loss_s_min, sensor_.loss_s_max));
    }
    const bool is_missed = person.random.Chance(sensor_.miss_probability);
    const double visibility = Visibility(plan, cameras, i);
    if (is_missed || now_ns_ < person.lost_until_ns || visibility < sensor_.visibility_min)
      continue;
    Follow(i, visibility);
  }
  SwapNear();
}

void PeopleSensor::Follow(int index, double visibility) {
  Person& person = at_[index];
  const bool is_again = person.track < 0 || now_ns_ - person.seen_ns.back() > kAgainNs;
  if (is_again && (person.track < 0 || !person.random.Chance(sensor_.found_again_probability))) {
    person.track = static_cast<int>(tracks_.size());
    PersonTrack track;
    track.id = NodeId('H', tracks_.size() + 1);
    tracks_.push_back(std::move(track));
  }
  person.seen_ns.push_back(now_ns_);
  Record(index, visibility);
}

void PeopleSensor::Record(int index, double visibility) {
  Person& person = at_[index];
  PersonTrack& track = tracks_[person.track];
  ++track.votes[index];
  const Pose3d& map_T_torso = person.state.map_T_torso;
  std::array<Eigen::Vector3d, ingest::kJointCount> joints_torso;
  for (size_t j = 0; j < joints_torso.size(); ++j) {
    joints_torso[j] = map_T_torso.Inverse() * person.state.joints_map[j];
  }
  const auto draws = simulator::DrawDetectionErrors(person.depth_log, &person.random);
  joints_torso = simulator::DetectedJoints(joints_torso, visibility, draws);
  TimedPose pose;
  pose.time_ns = now_ns_;
  pose.map_T_agent.orientation = map_T_torso.orientation;
  pose.map_T_agent.position = person.state.joints_map[ingest::kPelvis] + person.error_m;
  track.poses.push_back(pose);
  BodyShape shape;
  shape.time_ns = now_ns_;
  for (const Eigen::Vector3d& joint : joints_torso) {
    for (int axis = 0; axis < 3; ++axis) shape.joints.push_back(static_cast<float>(joint[axis]));
  }
  track.shapes.push_back(std::move(shape));
}

void PeopleSensor::SwapNear() {
  const auto is_seen = [&](const Person& person) {
    return person.track >= 0 && person.seen_ns.back() == now_ns_;
  };
  for (int i = 0; i < crowd_.count(); ++i) {
    for (int j = i + 1; j < crowd_.count(); ++j) {
      const bool is_near = is_seen(at_[i]) && is_seen(at_[j]) &&
                           (bodies_[i].at_map - bodies_[j].at_map).norm() < sensor_.swap_m;
      bool& was_near = was_near_[{i, j}];
      if (is_near && !was_near && swap_random_.Chance(sensor_.swap_probability)) {
        std::swap(at_[i].track, at_[j].track);
      }
      was_near = is_near;
    }
  }
}

}  // namespace dsg::eval
