// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/carried_things.h"

#include <algorithm>
#include <set>
#include <tuple>

namespace dsg::ingest {
namespace {

// A hand that is hidden for longer may hold another thing.
constexpr TimeNs kGapNsMax = 2 * kNsPerSecond;
constexpr double kSpeedMaxMps = 2.0;
constexpr double kReachM = 0.3;
constexpr size_t kPointsMin = 4;
constexpr double kWayMinM = 0.5;

bool IsWay(const Carry& carry) {
  if (carry.way.size() < kPointsMin) return false;
  const Eigen::Vector3d& begin = carry.way.front().position_map;
  // The end too: two things side by side are no way from one to the other and back.
  return (carry.way.back().position_map - begin).norm() >= kWayMinM;
}

}  // namespace

void CarriedThings::See(const std::vector<SmallSighting>& sightings, TimeNs time_ns) {
  std::vector<std::tuple<double, size_t, size_t>> pairs;
  for (size_t i = 0; i < sightings.size(); ++i) {
    const SmallSighting& seen = sightings[i];
    for (size_t j = 0; seen.is_held && j < carries_.size(); ++j) {
      const Carry::Point& last = carries_[j].way.back();
      if (carries_[j].class_id != seen.class_id || time_ns - last.time_ns > kGapNsMax) continue;
      const double seconds = static_cast<double>(time_ns - last.time_ns) / kNsPerSecond;
      const double apart_m = (seen.center_map - last.position_map).norm();
      if (apart_m <= kReachM + kSpeedMaxMps * seconds) pairs.emplace_back(apart_m, j, i);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::set<size_t> continued, placed;
  for (const auto& [apart_m, carry, sighting] : pairs) {
    if (continued.contains(carry) || placed.contains(sighting)) continue;
    continued.insert(carry);
    placed.insert(sighting);
    carries_[carry].way.push_back({time_ns, sightings[sighting].center_map});
  }
  for (size_t i = 0; i < sightings.size(); ++i) {
    const SmallSighting& seen = sightings[i];
    if (!seen.is_held || seen.span_m > kSmallSpanM || placed.contains(i)) continue;
    carries_.push_back({seen.class_id, {{time_ns, seen.center_map}}});
  }
  std::erase_if(carries_, [time_ns](const Carry& carry) {
    return time_ns - carry.way.back().time_ns > kGapNsMax && !IsWay(carry);
  });
}

std::vector<Carry> CarriedThings::Carries() const {
  std::vector<Carry> ways;
  std::copy_if(carries_.begin(), carries_.end(), std::back_inserter(ways), IsWay);
  return ways;
}

void CarriedThings::Move(const TrajectoryChange& change) {
  for (Carry& carry : carries_) {
    for (Carry::Point& point : carry.way) {
      point.position_map = change.At(point.time_ns) * point.position_map;
    }
  }
}

}  // namespace dsg::ingest
