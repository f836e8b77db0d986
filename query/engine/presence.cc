// SPDX-License-Identifier: Apache-2.0
// Who was in a room, a place, a region or a box during an interval. Absence is only reported for
// agents that were observed at all, which is why their number stands beside the answer.
#include <algorithm>
#include <compare>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

// Compares as the answer is ordered: by enter_ns, agent, node.
struct PresenceKey {
  TimeNs enter_ns = kTimeMin;
  NodeId agent;
  NodeId node;
  auto operator<=>(const PresenceKey&) const = default;
};

struct Presence {
  PresenceKey key;
  TimeNs exit_ns = 0;
};

std::string PresencePosition(const PresenceKey& key) {
  std::string position;
  AppendWord(static_cast<uint64_t>(key.enter_ns), &position);
  AppendWord(key.agent.value, &position);
  AppendWord(key.node.value, &position);
  return position;
}

absl::StatusOr<PresenceKey> PresenceKeyOf(std::string_view position) {
  uint64_t enter = 0;
  PresenceKey key;
  if (!TakeWord(&position, &enter) || !TakeWord(&position, &key.agent.value) ||
      !TakeWord(&position, &key.node.value) || !position.empty()) {
    return PageTokenError();
  }
  key.enter_ns = static_cast<TimeNs>(enter);
  return key;
}

// Rooms below a node of a higher layer. An edge counts if it was true at any time of `during`.
absl::StatusOr<std::vector<NodeId>> RoomsBelow(const Snapshot& snapshot, NodeId top,
                                               const Interval& during, const StopCheck& stop) {
  std::set<NodeId> rooms;
  std::set<NodeId> seen = {top};
  std::vector<NodeId> pending = {top};
  while (!pending.empty()) {
    const EdgeFilter children = ChildrenOf(pending.back());
    pending.pop_back();
    std::vector<NodeId> found;
    DSG_RETURN_IF_ERROR(snapshot.ScanEdges(children, std::nullopt, stop, [&](const Edge& edge) {
      if (edge.valid.Overlaps(during) && seen.insert(edge.target).second) {
        found.push_back(edge.target);
      }
      return true;
    }));
    for (const NodeId id : found) {
      DSG_ASSIGN_OR_RETURN(const Node node, snapshot.GetNode(id));
      if (node.layer == layers::kRooms) {
        rooms.insert(id);
      } else {
        pending.push_back(id);
      }
    }
  }
  return std::vector<NodeId>(rooms.begin(), rooms.end());
}

// The rooms or the place whose stays answer for a node.
absl::StatusOr<std::vector<NodeId>> NodesAsked(const Snapshot& snapshot,
                                               const std::string& id_or_name,
                                               const Interval& during, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const NodeId id, ResolveOne(snapshot, id_or_name, "node_id", stop));
  DSG_ASSIGN_OR_RETURN(const Node node, snapshot.GetNode(id));
  if (node.layer == layers::kRooms || node.layer == layers::kPlaces) {
    return std::vector<NodeId>{id};
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<Layer> layers, snapshot.Layers());
  const auto rank_of = [&](LayerId layer) {
    const auto found = std::find_if(layers.begin(), layers.end(),
                                    [&](const Layer& known) { return known.id == layer; });
    return found == layers.end() ? 0 : found->rank;
  };
  if (rank_of(node.layer) > rank_of(layers::kRooms)) {
    return RoomsBelow(snapshot, id, during, stop);
  }
  return FieldError("node_id", ToString(id),
                    absl::StrCat("it is of kind ", node.kind,
                                 "; give a room, a place, a node of a layer above rooms, or a "
                                 "box"));
}

// Stays are cut where the place changes and at every hour; whoever asks for a room wants to hear
// of one visit. `stays` are of one node, ascending by enter_ns.
void AppendMerged(const std::vector<Stay>& stays, NodeId node, const Interval& during,
                  std::vector<Presence>* out) {
  std::unordered_map<NodeId, Interval> open;
  const auto close = [&](NodeId agent, const Interval& visit) {
    const TimeNs enter_ns = std::max(visit.from_ns, during.from_ns);
    const TimeNs exit_ns = std::min(visit.to_ns, during.to_ns);
    if (enter_ns < exit_ns) out->push_back({{enter_ns, agent, node}, exit_ns});
  };
  for (const Stay& stay : stays) {
    const auto [visit, is_new] = open.try_emplace(stay.agent, stay.enter_ns, stay.exit_ns);
    if (is_new) continue;
    if (stay.enter_ns <= visit->second.to_ns) {
      visit->second.to_ns = std::max(visit->second.to_ns, stay.exit_ns);
      continue;
    }
    close(stay.agent, visit->second);
    visit->second = {stay.enter_ns, stay.exit_ns};
  }
  for (const auto& [agent, visit] : open) close(agent, visit);
}

// All that a page may hold: presence after `after` in the order of the answer.
absl::StatusOr<std::vector<Presence>> FindPresence(const Snapshot& snapshot,
                                                   const v1::ListPresenceRequest& request,
                                                   const PresenceKey& after,
                                                   const StopCheck& stop) {
  const Interval during{request.from_ns(), request.to_ns()};
  // Later pages need not read what ended before the last entry began. One nanosecond more is
  // read, so that a visit cut at that very instant is still seen to have begun earlier.
  const TimeNs read_from_ns = after.enter_ns > during.from_ns ? after.enter_ns - 1 : during.from_ns;
  std::vector<Presence> found;
  if (request.has_box()) {
    DSG_ASSIGN_OR_RETURN(const Box3d box, BoxFromProto(request.box(), "box"));
    DSG_ASSIGN_OR_RETURN(const std::vector<BoxVisit> visits,
                         snapshot.VisitsToBox(box, read_from_ns, during.to_ns, stop));
    for (const BoxVisit& visit : visits) {
      found.push_back({{visit.enter_ns, visit.agent, NodeId()}, visit.exit_ns});
    }
  } else {
    DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> nodes,
                         NodesAsked(snapshot, request.node_id(), during, stop));
    for (const NodeId node : nodes) {
      DSG_ASSIGN_OR_RETURN(const std::vector<Stay> stays,
                           snapshot.StaysInNode(node, read_from_ns, during.to_ns, stop));
      AppendMerged(stays, node, during, &found);
    }
  }
  std::erase_if(found, [&](const Presence& presence) { return presence.key <= after; });
  std::sort(found.begin(), found.end(),
            [](const Presence& a, const Presence& b) { return a.key < b.key; });
  return found;
}

absl::Status CheckPresenceRequest(const v1::ListPresenceRequest& request) {
  DSG_RETURN_IF_ERROR(CheckTimeRange(request.from_ns(), request.to_ns()));
  if (request.has_box()) return BoxFromProto(request.box(), "box").status();
  if (!request.node_id().empty()) return absl::OkStatus();
  return FieldError("node_id", "", "give a room, a place, a node of a layer above rooms, or a box");
}

}  // namespace

absl::Status ListPresence(Engine* engine, const CallContext& call,
                          const v1::ListPresenceRequest& request, v1::ListPresenceResponse* reply) {
  DSG_RETURN_IF_ERROR(CheckPresenceRequest(request));
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListPresence", request));
  const Snapshot& snapshot = page.view.snapshot();
  PresenceKey after;
  if (!page.is_first()) {
    DSG_ASSIGN_OR_RETURN(after, PresenceKeyOf(page.position));
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<Presence> found,
                       FindPresence(snapshot, request, after, call.stop()));
  page.view.FillHeader(reply->mutable_header());
  size_t bytes = 0;
  for (const Presence& presence : found) {
    if (reply->intervals_size() == page.size || bytes > kPageBytesSoftMax) {
      const Presence& last = found[static_cast<size_t>(reply->intervals_size()) - 1];
      reply->set_next_page_token(page.NextToken(PresencePosition(last.key)));
      break;
    }
    DSG_ASSIGN_OR_RETURN(TrackInfo track, snapshot.GetTrack(presence.key.agent));
    v1::PresenceInterval* interval = reply->add_intervals();
    interval->set_agent_id(ToString(presence.key.agent));
    interval->set_agent_name(std::move(track.name));
    interval->set_enter_ns(presence.key.enter_ns);
    interval->set_exit_ns(presence.exit_ns);
    if (!presence.key.node.empty()) interval->set_node_id(ToString(presence.key.node));
    bytes += interval->ByteSizeLong();
  }
  DSG_ASSIGN_OR_RETURN(
      const int64_t observed,
      snapshot.CountObservedAgents(request.from_ns(), request.to_ns(), call.stop()));
  reply->set_observed_agent_count(observed);
  return absl::OkStatus();
}

}  // namespace dsg::query
