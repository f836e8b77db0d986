// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/crowd.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace dsg::bench {
namespace {

constexpr double kPositionNoiseM = 0.003;
constexpr double kRotationNoiseRad = 0.004;
constexpr double kJitterUs = 500.0;
constexpr double kTurnRadPerS = 2.0;
constexpr double kPeriodS = 0.1;
// Where a tracked body's origin is above the floor.
constexpr double kBodyHeightM = 1.0;

}  // namespace

NodeId CrowdAgent(int index) { return NodeId('H', static_cast<uint64_t>(index)); }

Walker::Walker(uint64_t seed, int index) : random_(seed, static_cast<uint64_t>(index)) {
  const double z = kFloorHeightM * (index % kFloorCount) + kBodyHeightM;
  position_ = {random_.Uniform(0, kBuildingXM), random_.Uniform(0, kBuildingYM), z};
  ChooseGoal();
}

void Walker::ChooseGoal() {
  goal_ = {random_.Uniform(0, kBuildingXM), random_.Uniform(0, kBuildingYM), position_.z()};
  speed_m_per_s_ = random_.Uniform(0.8, 1.6);
}

void Walker::Advance() {
  if (pause_steps_ > 0) {
    if (--pause_steps_ == 0) ChooseGoal();
    return;
  }
  const Eigen::Vector3d way = goal_ - position_;
  const double turn = std::remainder(std::atan2(way.y(), way.x()) - yaw_, 2.0 * M_PI);
  yaw_ += std::clamp(turn, -kTurnRadPerS * kPeriodS, kTurnRadPerS * kPeriodS);
  const double stride = speed_m_per_s_ * kPeriodS;
  if (way.norm() > stride) {
    position_ += way.normalized() * stride;
    return;
  }
  position_ = goal_;
  pause_steps_ = random_.Integer(50, 600);
}

TimedPose Walker::Next() {
  TimedPose pose;
  const auto jitter_us = static_cast<int64_t>(std::llround(random_.Normal() * kJitterUs));
  // A jitter of 0.5 ms never reaches the neighbour 100 ms away, so times grow.
  pose.time_ns = kCrowdEpochNs + step_ * kPosePeriodNs + jitter_us * 1000;
  for (int axis = 0; axis < 3; ++axis) {
    pose.map_T_agent.position[axis] = position_[axis] + kPositionNoiseM * random_.Normal();
  }
  Eigen::Vector3d tilt;
  for (int axis = 0; axis < 3; ++axis) tilt[axis] = kRotationNoiseRad * random_.Normal();
  const Eigen::Quaterniond noise(1.0, 0.5 * tilt.x(), 0.5 * tilt.y(), 0.5 * tilt.z());
  const Eigen::Quaterniond heading(std::cos(0.5 * yaw_), 0.0, 0.0, std::sin(0.5 * yaw_));
  pose.map_T_agent.orientation = (heading * noise).normalized();
  ++step_;
  Advance();
  return pose;
}

Crowd::Crowd(uint64_t seed, int agent_count) {
  for (int i = 0; i < agent_count; ++i) walkers_.emplace_back(seed, i);
}

std::vector<Node> Crowd::Nodes() const {
  std::vector<Node> nodes;
  for (size_t i = 0; i < walkers_.size(); ++i) {
    Node node;
    node.id = CrowdAgent(static_cast<int>(i));
    node.layer = layers::kAgents;
    node.kind = kinds::kHuman;
    node.name = absl::StrCat("person ", i);
    nodes.push_back(std::move(node));
  }
  return nodes;
}

std::vector<TrajectoryAppend> Crowd::Next(int pose_count) {
  std::vector<TrajectoryAppend> appends(walkers_.size());
  for (size_t i = 0; i < walkers_.size(); ++i) {
    appends[i].agent = CrowdAgent(static_cast<int>(i));
    appends[i].poses.reserve(static_cast<size_t>(pose_count));
    for (int k = 0; k < pose_count; ++k) appends[i].poses.push_back(walkers_[i].Next());
  }
  return appends;
}

}  // namespace dsg::bench
