// SPDX-License-Identifier: Apache-2.0
#include "query/engine/agents_at.h"

#include <optional>

#include "schema/base/status.h"

namespace dsg::query {

absl::StatusOr<std::vector<AgentAt>> AgentsAt(const Snapshot& snapshot, NodeFilter filter,
                                              const StopCheck& stop) {
  std::vector<AgentAt> agents;
  if (filter.layer.has_value() && *filter.layer != layers::kAgents) return agents;
  const TimeNs at_ns = *filter.at_ns;
  filter.layer = layers::kAgents;
  // Of the box counts who was in it then, not who was there last.
  const std::optional<Box3d> box_map = filter.box_map;
  filter.box_map.reset();
  std::vector<Node> known;
  DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
    if (IsAgentKind(node.kind)) known.push_back(node);
    return true;
  }));
  for (Node& node : known) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const TrackInfo track, snapshot.GetTrack(node.id));
    if (track.pose_count == 0 || at_ns < track.first_ns || at_ns > track.last_ns) continue;
    DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(node.id, at_ns));
    const bool is_in_gap = located.quality == PoseQuality::kInGap;
    if (!is_in_gap) node.map_T_node = located.map_T_agent;
    if (box_map.has_value() && (is_in_gap || !box_map->intersects(node.BoxMap()))) continue;
    agents.push_back({std::move(node), is_in_gap});
  }
  return agents;
}

}  // namespace dsg::query
