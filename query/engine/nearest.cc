// SPDX-License-Identifier: Apache-2.0
#include "query/engine/nearest.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/nodes.h"
#include "query/engine/request_check.h"
#include "query/engine/view_filter.h"
#include "query/engine/view_nodes.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

struct NearestNode {
  Node node;
  /// From the point to the node's box, metres; 0 inside.
  double distance_m = 0.0;
};

struct Question {
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
  int k = 1;
  double max_distance_m = std::numeric_limits<double>::infinity();
  NodeFilter filter;
};

absl::StatusOr<Question> ReadQuestion(const v1::ListNearestNodesRequest& request,
                                      const Snapshot& snapshot) {
  Question question;
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
  DSG_ASSIGN_OR_RETURN(question.filter, FilterFromProto(request.filter(), snapshot));
  return question;
}

bool AsksForAgents(const NodeFilter& filter) {
  return IsAgentKind(filter.kind) || filter.layer == layers::kAgents;
}

// There are as many agents as tracks, hundreds rather than millions, and each stands somewhere
// else at every instant: no index helps, and none is needed.
absl::StatusOr<std::vector<NearestNode>> NearestAgents(const Snapshot& snapshot,
                                                       const Question& question,
                                                       const StopCheck& stop) {
  const TimeNs at_ns = *question.filter.at_ns;
  DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot.Tracks(stop));
  std::vector<NearestNode> found;
  for (const TrackInfo& track : tracks) {
    DSG_RETURN_IF_ERROR(stop());
    if (track.pose_count == 0 || at_ns < track.first_ns || at_ns > track.last_ns) continue;
    if (!question.filter.kind.empty() && track.kind != question.filter.kind) continue;
    DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(track.agent, at_ns));
    if (located.quality == PoseQuality::kInGap) continue;
    DSG_ASSIGN_OR_RETURN(Node node, snapshot.GetNode(track.agent));
    node.map_T_node = located.map_T_agent;
    if (!question.filter.Matches(node)) continue;
    const double distance_m = node.DistanceTo(question.point_map);
    if (distance_m <= question.max_distance_m) found.push_back({std::move(node), distance_m});
  }
  std::sort(found.begin(), found.end(), [](const NearestNode& a, const NearestNode& b) {
    return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.node.id < b.node.id;
  });
  if (found.size() > static_cast<size_t>(question.k)) {
    found.resize(static_cast<size_t>(question.k));
  }
  return found;
}

struct Found {
  const ViewNode* node = nullptr;
  double distance_m = 0.0;
};

absl::StatusOr<std::vector<Found>> NearestInView(const GraphView& graph, const Question& question,
                                                 const StopCheck& stop) {
  constexpr int kStopEvery = 256;
  const ViewFilter filter(question.filter, graph);
  std::vector<Found> found;
  if (!filter.CanMatch()) return found;
  absl::Status status;
  int looked_at = 0;
  graph.ForEachNearest(question.point_map, filter.space(), question.max_distance_m,
                       [&](const ViewNode& node, double distance_m) {
                         if (++looked_at % kStopEvery == 0) status = stop();
                         if (filter.Matches(node)) found.push_back({&node, distance_m});
                         return status.ok() && found.size() < static_cast<size_t>(question.k);
                       });
  DSG_RETURN_IF_ERROR(status);
  return found;
}

absl::Status ReplyTooLarge(const v1::ListNearestNodesRequest& request, int node_count) {
  return FieldError("k", absl::StrCat(request.k()),
                    absl::StrCat("the first ", node_count,
                                 " nodes alone fill a reply; ask for fewer, or for a smaller "
                                 "view"));
}

absl::Status FillNearest(const ReadView& view, const GraphView& graph,
                         const v1::ListNearestNodesRequest& request,
                         const std::vector<Found>& found, v1::ListNearestNodesResponse* reply) {
  NodeFiller filler(view.snapshot(), graph, request.view());
  std::vector<NodeId> ids;
  for (const Found& nearest : found) ids.push_back(nearest.node->id);
  filler.Expect(std::move(ids));
  size_t bytes = 0;
  for (const Found& nearest : found) {
    v1::NearestNode* out = reply->add_nodes();
    DSG_RETURN_IF_ERROR(filler.Fill(*nearest.node, out->mutable_node()));
    out->set_distance_m(nearest.distance_m);
    bytes += out->ByteSizeLong();
    if (bytes > kReplyBytesMax) return ReplyTooLarge(request, reply->nodes_size());
  }
  return absl::OkStatus();
}

absl::Status FillAgents(const ReadView& view, const v1::ListNearestNodesRequest& request,
                        const std::vector<NearestNode>& found,
                        v1::ListNearestNodesResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const LayerTable layers, LayersOf(view.snapshot()));
  size_t bytes = 0;
  for (const NearestNode& nearest : found) {
    v1::NearestNode* out = reply->add_nodes();
    FillNode(nearest.node, layers, request.view(), out->mutable_node());
    out->set_distance_m(nearest.distance_m);
    bytes += out->ByteSizeLong();
    if (bytes > kReplyBytesMax) return ReplyTooLarge(request, reply->nodes_size());
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ListNearestNodes(const ReadView& view, const CallContext& call,
                              const v1::ListNearestNodesRequest& request,
                              v1::ListNearestNodesResponse* reply) {
  const Snapshot& snapshot = view.snapshot();
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  DSG_ASSIGN_OR_RETURN(const Question question, ReadQuestion(request, snapshot));
  view.FillHeader(reply->mutable_header());
  if (AsksForAgents(question.filter)) {
    if (!question.filter.at_ns.has_value()) {
      return FieldError("filter.at_ns", "",
                        "agents move; say at which instant the nearest ones are wanted");
    }
    DSG_ASSIGN_OR_RETURN(const std::vector<NearestNode> agents,
                         NearestAgents(snapshot, question, call.stop()));
    return FillAgents(view, request, agents, reply);
  }
  const StopCheck stop = call.stop();
  DSG_ASSIGN_OR_RETURN(const auto graph, view.Graph(stop));
  DSG_ASSIGN_OR_RETURN(const std::vector<Found> found, NearestInView(*graph, question, stop));
  return FillNearest(view, *graph, request, found, reply);
}

}  // namespace dsg::query
