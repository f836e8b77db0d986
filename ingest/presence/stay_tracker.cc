// SPDX-License-Identifier: Apache-2.0
#include "ingest/presence/stay_tracker.h"

#include <algorithm>
#include <tuple>

namespace dsg::ingest {
namespace {

// Exact also where the difference exceeds the signed range. Requires: from <= to.
uint64_t Elapsed(TimeNs from_ns, TimeNs to_ns) {
  return static_cast<uint64_t>(to_ns) - static_cast<uint64_t>(from_ns);
}

}  // namespace

void StayTracker::Observe(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map) {
  if (regions_.empty()) return;
  Track& track = tracks_[agent];
  if (track.has_pose && Elapsed(track.last_ns, time_ns) > static_cast<uint64_t>(gap_ns_max_)) {
    End(agent, track.last_ns + 1, &track);
    track.where = {};
    track.resumes_ns.reset();
  }
  const RegionState next = regions_.Next(track.where, position_map);
  if (next != track.where) End(agent, time_ns, &track);
  track.where = next;
  if (!track.is_open && next != RegionState{}) {
    Begin(agent, track.resumes_ns.value_or(time_ns), &track);
  }
  track.resumes_ns.reset();
  if (track.is_open) Cut(agent, time_ns, /*is_until_inside=*/true, &track);
  track.last_ns = time_ns;
  track.has_pose = true;
}

void StayTracker::SetRegions(RegionIndex regions) {
  for (auto& [agent, track] : tracks_) {
    const NodeId room = regions_.RoomId(track.where.room);
    const NodeId place = regions_.PlaceId(track.where.place);
    const RegionState now = regions.Find(room, place);
    const bool is_lost = regions.RoomId(now.room) != room || regions.PlaceId(now.place) != place ||
                         regions.IsTorn(now);
    if (is_lost && track.is_open) {
      End(agent, track.last_ns + 1, &track);
      track.resumes_ns = track.last_ns + 1;
    }
    track.where = is_lost ? RegionState() : now;
  }
  regions_ = std::move(regions);
}

void StayTracker::Finish() {
  for (auto& [agent, track] : tracks_) End(agent, track.last_ns + 1, &track);
}

std::vector<Stay> StayTracker::TakeChanges() {
  std::vector<Stay> changes = std::move(ended_);
  ended_.clear();
  for (const NodeId agent : begun_) {
    Track& track = tracks_[agent];
    if (!track.is_open || track.is_open_told) continue;
    track.is_open_told = true;
    changes.push_back(MakeStay(agent, track, kTimeMax));
  }
  begun_.clear();
  std::sort(changes.begin(), changes.end(), [](const Stay& a, const Stay& b) {
    return std::tie(a.agent, a.enter_ns) < std::tie(b.agent, b.enter_ns);
  });
  return changes;
}

void StayTracker::Begin(NodeId agent, TimeNs enter_ns, Track* track) {
  track->is_open = true;
  track->is_open_told = false;
  track->enter_ns = enter_ns;
  begun_.push_back(agent);
}

void StayTracker::Cut(NodeId agent, TimeNs until_ns, bool is_until_inside, Track* track) {
  // A pose at the cut begins the next piece; an exit at the cut ends the last one.
  const uint64_t longest = static_cast<uint64_t>(kStayNsMax) - (is_until_inside ? 1 : 0);
  while (Elapsed(track->enter_ns, until_ns) > longest) {
    const TimeNs cut_ns = track->enter_ns + kStayNsMax;
    ended_.push_back(MakeStay(agent, *track, cut_ns));
    Begin(agent, cut_ns, track);
  }
}

void StayTracker::End(NodeId agent, TimeNs exit_ns, Track* track) {
  if (!track->is_open) return;
  Cut(agent, exit_ns, /*is_until_inside=*/false, track);
  ended_.push_back(MakeStay(agent, *track, exit_ns));
  track->is_open = false;
}

Stay StayTracker::MakeStay(NodeId agent, const Track& track, TimeNs exit_ns) const {
  return {.agent = agent,
          .place = regions_.PlaceId(track.where.place),
          .room = regions_.RoomId(track.where.room),
          .enter_ns = track.enter_ns,
          .exit_ns = exit_ns};
}

}  // namespace dsg::ingest
