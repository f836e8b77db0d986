// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/contested.h"

#include "absl/strings/str_cat.h"

namespace dsg {

std::vector<std::string> Contested::Names(size_t count_max) const {
  std::vector<std::string> names;
  for (const NodeId agent : agents) {
    if (names.size() == count_max) return names;
    names.push_back(ToString(agent));
  }
  for (const BlockIndex& block : mesh_blocks) {
    if (names.size() == count_max) return names;
    names.push_back(absl::StrCat(block.x, ",", block.y, ",", block.z));
  }
  return names;
}

void Others::Add(const Touched& touched) {
  nodes_.insert(touched.nodes.begin(), touched.nodes.end());
  tracks_.insert(touched.corrected_tracks.begin(), touched.corrected_tracks.end());
  mesh_blocks_.insert(touched.mesh_blocks.begin(), touched.mesh_blocks.end());
}

Contested Others::FindContested(const PrunePlan& plan, const Erasure& erasure) const {
  std::set<NodeId> erased_agents(erasure.nodes.begin(), erasure.nodes.end());
  for (const TrackSpan& span : erasure.tracks) erased_agents.insert(span.agent);
  Contested contested;
  for (const TrackPlan& track : plan.tracks) {
    if (tracks_.contains(track.agent) && erased_agents.contains(track.agent)) {
      contested.agents.insert(track.agent);
    }
  }
  for (const NodePlan& node : plan.nodes) {
    if (node.is_agent && nodes_.contains(node.id) && erased_agents.contains(node.id)) {
      contested.agents.insert(node.id);
    }
  }
  const std::set<BlockIndex> erased(erasure.mesh_blocks.begin(), erasure.mesh_blocks.end());
  for (const auto* blocks : {&plan.mesh.removed, &plan.mesh.cut}) {
    for (const BlockIndex& block : *blocks) {
      if (mesh_blocks_.contains(block) && erased.contains(block)) {
        contested.mesh_blocks.insert(block);
      }
    }
  }
  return contested;
}

}  // namespace dsg
