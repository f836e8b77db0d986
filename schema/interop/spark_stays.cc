// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_stays.h"

#include <algorithm>
#include <unordered_set>

#include "schema/interop/spark_agents.h"

namespace dsg {
namespace {

using Links = std::unordered_map<NodeId, NodeId>;

void KeepLower(NodeId from, NodeId to, Links* links) {
  const auto [it, added] = links->try_emplace(from, to);
  if (!added) it->second = std::min(it->second, to);
}

NodeId Lookup(const Links& links, NodeId from) {
  const auto found = links.find(from);
  return found == links.end() ? NodeId() : found->second;
}

void AddStay(NodeId agent, const Visit& visit, TimeNs exit_ns, std::vector<Stay>* stays) {
  if (visit.place.empty() && visit.room.empty()) return;
  for (TimeNs enter_ns = visit.time_ns; enter_ns < exit_ns; enter_ns += kStayNsMax) {
    const TimeNs cut_ns = exit_ns - enter_ns > kStayNsMax ? enter_ns + kStayNsMax : exit_ns;
    stays->push_back({agent, visit.place, visit.room, enter_ns, cut_ns});
  }
}

}  // namespace

Whereabouts::Whereabouts(const GraphDelta& delta) {
  std::unordered_set<NodeId> rooms;
  for (const Node& node : delta.nodes) {
    if (node.layer == layers::kRooms) rooms.insert(node.id);
  }
  for (const Edge& edge : delta.edges) {
    if (edge.relation == relations::kNearestPlace) KeepLower(edge.source, edge.target, &place_);
    if (edge.relation == kPoseIn && rooms.contains(edge.target)) {
      KeepLower(edge.source, edge.target, &room_);
    }
    if (edge.relation == relations::kContains && rooms.contains(edge.source)) {
      KeepLower(edge.target, edge.source, &room_);
    }
  }
}

NodeId Whereabouts::PlaceOf(NodeId pose) const { return Lookup(place_, pose); }

NodeId Whereabouts::RoomOf(NodeId pose) const {
  const NodeId room_of_place = RoomOfPlace(PlaceOf(pose));
  return room_of_place.empty() ? Lookup(room_, pose) : room_of_place;
}

NodeId Whereabouts::RoomOfPlace(NodeId place) const { return Lookup(room_, place); }

void AddStays(NodeId agent, const std::vector<Visit>& visits, std::vector<Stay>* stays) {
  size_t begin = 0;
  for (size_t i = 0; i < visits.size(); ++i) {
    const bool is_last = i + 1 == visits.size();
    const bool is_lost = is_last || visits[i + 1].time_ns - visits[i].time_ns > kStayGapNs;
    const bool moves_on = is_lost || visits[i + 1].place != visits[begin].place ||
                          visits[i + 1].room != visits[begin].room;
    if (!moves_on) continue;
    // Half-open: one nanosecond more, so that the last pose's own instant is covered.
    const TimeNs exit_ns = is_lost ? visits[i].time_ns + 1 : visits[i + 1].time_ns;
    AddStay(agent, visits[begin], exit_ns, stays);
    begin = i + 1;
  }
}

}  // namespace dsg
