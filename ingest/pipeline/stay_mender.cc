// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/stay_mender.h"

#include <algorithm>

namespace dsg::ingest {

void StayMender::Observe(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map) {
  seen_[agent].push_back({time_ns, position_map});
}

void StayMender::Remember(const std::vector<Stay>& stays) {
  for (const Stay& stay : stays) told_[{stay.agent, stay.enter_ns}] = stay;
}

const Eigen::Vector3d* StayMender::MiddleOf(const Stay& stay) const {
  const auto seen = seen_.find(stay.agent);
  if (seen == seen_.end()) return nullptr;
  const TimeNs middle_ns = stay.enter_ns + (stay.exit_ns - stay.enter_ns) / 2;
  const auto after =
      std::upper_bound(seen->second.begin(), seen->second.end(), middle_ns,
                       [](TimeNs time_ns, const Seen& pose) { return time_ns < pose.time_ns; });
  if (after == seen->second.begin()) return nullptr;
  const Seen& pose = *std::prev(after);
  return pose.time_ns >= stay.enter_ns ? &pose.position_map : nullptr;
}

std::vector<Stay> StayMender::Mend(const RegionIndex& regions) {
  std::vector<Stay> mended;
  for (auto& [key, stay] : told_) {
    if (stay.exit_ns == kTimeMax) continue;
    const RegionState known = regions.Find(stay.room, stay.place);
    if (regions.RoomId(known.room) == stay.room && regions.PlaceId(known.place) == stay.place &&
        !stay.room.empty()) {
      continue;
    }
    const Eigen::Vector3d* middle_map = MiddleOf(stay);
    if (middle_map == nullptr) continue;
    const RegionState now = regions.Next({}, *middle_map);
    const NodeId room = regions.RoomId(now.room);
    const NodeId place = regions.PlaceId(now.place);
    if ((room.empty() && place.empty()) || (room == stay.room && place == stay.place)) continue;
    stay.room = room;
    stay.place = place;
    mended.push_back(stay);
  }
  return mended;
}

}  // namespace dsg::ingest
