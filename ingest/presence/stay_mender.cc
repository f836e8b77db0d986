// SPDX-License-Identifier: Apache-2.0
#include "ingest/presence/stay_mender.h"

#include <algorithm>

namespace dsg::ingest {

void StayMender::Observe(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map) {
  seen_[agent].push_back({time_ns, position_map});
}

void StayMender::Remember(const std::vector<Stay>& stays) {
  for (const Stay& stay : stays) {
    Told& told = told_[{stay.agent, stay.enter_ns}];
    told.stay = stay;
    // A stay that is told again has its middle already.
    if (stay.exit_ns == kTimeMax || told.middle_map.has_value()) continue;
    told.middle_map = MiddleOf(stay);
    ForgetBefore(stay.agent, stay.exit_ns);
  }
}

void StayMender::ForgetBefore(NodeId agent, TimeNs time_ns) {
  const auto seen = seen_.find(agent);
  if (seen == seen_.end()) return;
  while (!seen->second.empty() && seen->second.front().time_ns < time_ns) seen->second.pop_front();
}

std::optional<Eigen::Vector3d> StayMender::MiddleOf(const Stay& stay) const {
  const auto seen = seen_.find(stay.agent);
  if (seen == seen_.end()) return std::nullopt;
  const TimeNs middle_ns = stay.enter_ns + (stay.exit_ns - stay.enter_ns) / 2;
  const auto after =
      std::upper_bound(seen->second.begin(), seen->second.end(), middle_ns,
                       [](TimeNs time_ns, const Seen& pose) { return time_ns < pose.time_ns; });
  if (after == seen->second.begin()) return std::nullopt;
  const Seen& pose = *std::prev(after);
  if (pose.time_ns < stay.enter_ns) return std::nullopt;
  return pose.position_map;
}

std::vector<Stay> StayMender::Mend(const RegionIndex& regions) {
  std::vector<Stay> mended;
  for (auto& [key, told] : told_) {
    Stay& stay = told.stay;
    if (stay.exit_ns == kTimeMax) continue;
    const RegionState known = regions.Find(stay.room, stay.place);
    if (regions.RoomId(known.room) == stay.room && regions.PlaceId(known.place) == stay.place &&
        !stay.room.empty() && !regions.IsTorn(known)) {
      continue;
    }
    if (!told.middle_map.has_value()) continue;
    const RegionState now = regions.Next({}, *told.middle_map);
    const NodeId room = regions.RoomId(now.room);
    const NodeId place = regions.PlaceId(now.place);
    if ((room.empty() && place.empty()) || (room == stay.room && place == stay.place)) continue;
    stay.room = room;
    stay.place = place;
    mended.push_back(stay);
  }
  return mended;
}

void StayMender::Move(const std::function<Pose3d(TimeNs)>& new_T_old) {
  for (auto& [agent, positions] : seen_) {
    for (Seen& seen : positions) seen.position_map = new_T_old(seen.time_ns) * seen.position_map;
  }
  for (auto& [key, told] : told_) {
    if (!told.middle_map.has_value()) continue;
    const TimeNs middle_ns = told.stay.enter_ns + (told.stay.exit_ns - told.stay.enter_ns) / 2;
    told.middle_map = new_T_old(middle_ns) * *told.middle_map;
  }
}

}  // namespace dsg::ingest
