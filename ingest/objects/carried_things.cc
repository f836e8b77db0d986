// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/carried_things.h"

#include <algorithm>
#include <set>
#include <tuple>

namespace dsg::ingest {
bool CarriedThings::IsWay(const Carry& carry) const {
  if (std::ssize(carry.way) < options_.point_count_min) return false;
  const Eigen::Vector3d& begin = carry.way.front().position_map;
  // The end too: two things side by side are no way from one to the other and back.
  return (carry.way.back().position_map - begin).norm() >= options_.way_m_min;
}

void CarriedThings::See(const std::vector<SmallSighting>& sightings, TimeNs time_ns) {
  std::vector<std::tuple<double, size_t, size_t>> pairs;
  for (size_t i = 0; i < sightings.size(); ++i) {
    const SmallSighting& seen = sightings[i];
    for (size_t j = 0; seen.is_held && j < carries_.size(); ++j) {
      const Carry::Point& last = carries_[j].way.back();
      if (carries_[j].class_id != seen.class_id || time_ns - last.time_ns > options_.gap_ns_max)
        continue;
      const double seconds = static_cast<double>(time_ns - last.time_ns) / kNsPerSecond;
      const double apart_m = (seen.center_map - last.position_map).norm();
      if (apart_m <= options_.reach_m + options_.speed_mps_max * seconds)
        pairs.emplace_back(apart_m, j, i);
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
    if (!seen.is_held || seen.span_m > span_m_max_ || placed.contains(i)) continue;
    carries_.push_back({seen.class_id, {{time_ns, seen.center_map}}});
  }
  std::erase_if(carries_, [this, time_ns](const Carry& carry) {
    return time_ns - carry.way.back().time_ns > options_.gap_ns_max && !IsWay(carry);
  });
}

std::vector<Carry> CarriedThings::Carries() const {
  std::vector<Carry> ways;
  std::copy_if(carries_.begin(), carries_.end(), std::back_inserter(ways),
               [this](const Carry& carry) { return IsWay(carry); });
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
