// SPDX-License-Identifier: Apache-2.0
// The nodes nearest to a point. Agents move, so they are looked at only when they are asked for
// together with an instant, and then stand where their track puts them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/agents.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "query/engine/view_nodes.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

struct NearestQuestion {
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
  int k = 1;
  double max_distance_m = std::numeric_limits<double>::infinity();
  NodeFilter filter;
};

absl::StatusOr<NearestQuestion> ReadNearestQuestion(const v1::ListNearestNodesRequest& request,
                                                    const Snapshot& snapshot,
                                                    const StopCheck& stop) {
  NearestQuestion question;
  if (!request.has_position()) return FieldError("position", "", "give a point of the map frame");
  DSG_ASSIGN_OR_RETURN(question.point_map, PointFromProto(request.position(), "position"));
  if (request.k() < 0 || request.k() > kPageSizeMax) {
    return FieldError("k", absl::StrCat(request.k()), "give 1 to 1000, or 0 for 1");
  }
  question.k = std::max(request.k(), 1);
  const double max_distance_m = request.max_distance_m();
  if (!std::isfinite(max_distance_m) || max_distance_m < 0.0) {
    return FieldError("max_distance_m", absl::StrCat(max_distance_m),
                      "give finite metres, or 0 for no limit");
  }
  if (max_distance_m > 0.0) question.max_distance_m = max_distance_m;
  DSG_ASSIGN_OR_RETURN(question.filter, FilterFromProto(request.filter(), snapshot, stop));
  return question;
}

bool AsksForAgents(const NodeFilter& filter) {
  return IsAgentKind(filter.kind) || filter.layer == layers::kAgents;
}

// A node of the graph, or an agent where it was at the instant.
struct Found {
  NodeId id;
  /// To the node's box, metres; 0 inside.
  double distance_m = 0.0;
  const ViewNode* node = nullptr;
  const Node* agent = nullptr;
};

// No index helps: each agent stands somewhere else at every instant.
std::vector<Found> NearAgents(const std::vector<AgentAt>& agents, const NearestQuestion& question) {
  std::vector<Found> found;
  for (const AgentAt& agent : agents) {
    const double distance_m = agent.node.DistanceTo(question.point_map);
    if (!agent.is_in_gap && distance_m <= question.max_distance_m) {
      found.push_back({agent.node.id, distance_m, nullptr, &agent.node});
    }
  }
  return found;
}

// Without agents where an instant is asked about.
absl::Status AddFromView(const GraphView& graph, const NearestQuestion& question,
                         const StopCheck& stop, std::vector<Found>* found) {
  constexpr int kStopEvery = 256;
  const ViewFilter filter(question.filter, graph);
  if (!filter.CanMatch()) return absl::OkStatus();
  absl::Status status;
  int looked_at = 0;
  size_t count = 0;
  graph.ForEachNearest(question.point_map, filter.space(), question.max_distance_m,
                       [&](const ViewNode& node, double distance_m) {
                         if (++looked_at % kStopEvery == 0) status = stop();
                         const bool moves = question.filter.at_ns.has_value() &&
                                            IsAgentKind(graph.symbols().Text(node.kind));
                         if (!moves && filter.Matches(node)) {
                           found->push_back({node.id, distance_m, &node, nullptr});
                           ++count;
                         }
                         return status.ok() && count < static_cast<size_t>(question.k);
                       });
  return status;
}

absl::Status ReplyTooLarge(const v1::ListNearestNodesRequest& request, int node_count) {
  return FieldError("k", absl::StrCat(request.k()),
                    absl::StrCat("the first ", node_count,
                                 " nodes alone fill a reply; ask for fewer, or for a smaller "
                                 "view"));
}

void KeepNearest(int k, std::vector<Found>* found) {
  std::sort(found->begin(), found->end(), [](const Found& a, const Found& b) {
    return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.id < b.id;
  });
  if (found->size() > static_cast<size_t>(k)) found->resize(static_cast<size_t>(k));
}

// `graph` may be null when all are agents.
absl::Status FillNearest(const ReadView& view, const GraphView* graph,
                         const v1::ListNearestNodesRequest& request,
                         const std::vector<Found>& found, v1::ListNearestNodesResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const LayerTable layers, LayersOf(view.snapshot()));
  std::optional<NodeFiller> filler;
  std::vector<NodeId> ids;
  for (const Found& nearest : found) {
    if (nearest.node != nullptr) ids.push_back(nearest.id);
  }
  if (graph != nullptr) {
    filler.emplace(view.snapshot(), *graph, request.view());
    filler->Expect(std::move(ids));
  }
  size_t bytes = 0;
  for (const Found& nearest : found) {
    v1::NearestNode* out = reply->add_nodes();
    if (nearest.agent != nullptr) {
      FillNode(*nearest.agent, layers, request.view(), out->mutable_node());
    } else {
      DSG_RETURN_IF_ERROR(filler->Fill(*nearest.node, out->mutable_node()));
    }
    out->set_distance_m(nearest.distance_m);
    bytes += out->ByteSizeLong();
    if (bytes > kReplyBytesMax) return ReplyTooLarge(request, reply->nodes_size());
  }
  return absl::OkStatus();
}

}  // namespace

// Cost: an index lookup in the revision's view, which the first question of a revision has to make
// (about a second for 100,000 nodes, a few milliseconds from the view of a revision close by); for
// agents, one Locate an agent and no view.
absl::Status ListNearestNodes(Engine* engine, const CallContext& call,
                              const v1::ListNearestNodesRequest& request,
                              v1::ListNearestNodesResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const Snapshot& snapshot = view.snapshot();
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  DSG_ASSIGN_OR_RETURN(const NearestQuestion question,
                       ReadNearestQuestion(request, snapshot, call.stop()));
  view.FillHeader(reply->mutable_header());
  const bool agents_only = AsksForAgents(question.filter);
  if (agents_only && !question.filter.at_ns.has_value()) {
    return FieldError("filter.at_ns", "",
                      "agents move; say at which instant the nearest ones are wanted");
  }
  const StopCheck stop = call.stop();
  std::vector<AgentAt> agents;
  if (question.filter.at_ns.has_value()) {
    DSG_ASSIGN_OR_RETURN(agents, AgentsAt(snapshot, question.filter, stop));
  }
  std::vector<Found> found = NearAgents(agents, question);
  std::shared_ptr<const GraphView> graph;
  if (!agents_only) {
    DSG_ASSIGN_OR_RETURN(graph, view.Graph(stop));
    DSG_RETURN_IF_ERROR(AddFromView(*graph, question, stop, &found));
  }
  KeepNearest(question.k, &found);
  return FillNearest(view, graph.get(), request, found, reply);
}

}  // namespace dsg::query
