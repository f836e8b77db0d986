// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/match_nodes.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "schema/base/status.h"

namespace dsg::merge {
namespace {

const TrackInfo* TrackOf(const MapContent& content, NodeId agent) {
  const auto found =
      std::lower_bound(content.tracks.begin(), content.tracks.end(), agent,
                       [](const TrackInfo& track, NodeId id) { return track.agent < id; });
  return found == content.tracks.end() || found->agent != agent ? nullptr : &*found;
}

bool IsLater(const TrackInfo* later, const TrackInfo* earlier) {
  if (later == nullptr || later->pose_count == 0) return false;
  if (earlier == nullptr || earlier->pose_count == 0) return false;
  return later->first_ns > earlier->last_ns;
}

}  // namespace

bool IsGeneratedName(const Node& agent) {
  if (agent.name.empty() || agent.name == agent.kind) return true;
  return std::isdigit(static_cast<unsigned char>(agent.name.back())) != 0;
}

void PairAgents(const MapContent& into, const MapContent& other, std::vector<int>* pair_of) {
  std::map<std::pair<std::string, std::string>, int> by_name;
  for (const int i : into.OfClass(NodeClass::kAgent)) {
    const Node& node = into.nodes[static_cast<size_t>(i)];
    by_name.try_emplace({node.kind, node.name}, i);
  }
  for (const int i : other.OfClass(NodeClass::kAgent)) {
    const Node& node = other.nodes[static_cast<size_t>(i)];
    if ((*pair_of)[static_cast<size_t>(i)] >= 0 || IsGeneratedName(node)) continue;
    const auto found = by_name.find({node.kind, node.name});
    if (found == by_name.end()) continue;
    const NodeId same = into.nodes[static_cast<size_t>(found->second)].id;
    if (!IsLater(TrackOf(other, node.id), TrackOf(into, same))) continue;
    (*pair_of)[static_cast<size_t>(i)] = found->second;
    // Two of one name in the other map are two.
    by_name.erase(found);
  }
}

absl::StatusOr<std::vector<int>> MatchNodes(const MapContent& into, const MapContent& other,
                                            std::vector<int> known, const MatchOptions& options,
                                            const StopCheck& stop) {
  std::vector<int> pair_of = std::move(known);
  PairAgents(into, other, &pair_of);
  for (const auto match : {MatchObjects, MatchPlaces, MatchStructures, MatchRegions}) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    match(into, other, options, &pair_of);
  }
  return pair_of;
}

}  // namespace dsg::merge
