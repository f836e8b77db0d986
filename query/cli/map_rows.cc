// SPDX-License-Identifier: Apache-2.0
#include "query/cli/map_rows.h"

#include <utility>

#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/model/known_names.h"

namespace dsg::cli {

template <class Request>
Request MapRows::Begin() const {
  Request request;
  request.set_map(session_.map().name);
  request.mutable_read_at()->set_exact_revision(revision_);
  return request;
}

TimeNs MapRows::EndNs() const {
  return at_ns_.has_value() && *at_ns_ < kTimeMax ? *at_ns_ + 1 : kTimeMax;
}

absl::StatusOr<MapRows> MapRows::Open(Session* session, std::optional<TimeNs> at_ns) {
  const auto request = session->Begin<v1::GetMapStatsRequest>();
  v1::GetMapStatsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &reply));
  return MapRows(session, reply.header().read_revision(), at_ns);
}

absl::Status MapRows::Nodes(const Take<v1::Node>& take) const {
  auto request = Begin<v1::ListNodesRequest>();
  if (at_ns_.has_value()) request.mutable_filter()->set_at_ns(*at_ns_);
  return session_.EachPage(&query::Api::ListNodes, request, 0, &v1::ListNodesResponse::nodes_size,
                           [&](const v1::ListNodesResponse& page) {
                             for (const v1::Node& node : page.nodes()) {
                               DSG_RETURN_IF_ERROR(take(node));
                             }
                             return absl::OkStatus();
                           });
}

absl::Status MapRows::Edges(const Take<v1::Edge>& take) const {
  auto request = Begin<v1::ListEdgesRequest>();
  if (at_ns_.has_value()) request.set_at_ns(*at_ns_);
  return session_.EachPage(&query::Api::ListEdges, request, 0, &v1::ListEdgesResponse::edges_size,
                           [&](const v1::ListEdgesResponse& page) {
                             for (const v1::Edge& edge : page.edges()) {
                               DSG_RETURN_IF_ERROR(take(edge));
                             }
                             return absl::OkStatus();
                           });
}

absl::StatusOr<std::vector<AgentRow>> MapRows::Agents() const {
  std::vector<AgentRow> agents;
  DSG_RETURN_IF_ERROR(Nodes([&](const v1::Node& node) {
    if (!IsAgentKind(node.kind())) return absl::OkStatus();
    const bool has_own_gap = node.agent().gap_ns_max() > 0;
    agents.push_back(
        {.id = node.id(),
         .name = node.name(),
         .kind = node.kind(),
         .gap_ns_max = has_own_gap ? node.agent().gap_ns_max() : session_.map().gap_ns_max});
    return absl::OkStatus();
  }));
  return agents;
}

absl::Status MapRows::Poses(const std::string& agent_id, const Take<v1::TimedPose>& take) const {
  auto request = Begin<v1::GetTrajectoryRequest>();
  request.set_agent(agent_id);
  if (EndNs() < kTimeMax) request.set_to_ns(EndNs());
  absl::Status taken;
  DSG_RETURN_IF_ERROR(session_.Read(&query::Api::GetTrajectory, request,
                                    [&](const v1::GetTrajectoryResponse& message) {
                                      for (const v1::TimedPose& pose : message.poses()) {
                                        taken = take(pose);
                                        if (!taken.ok()) return false;
                                      }
                                      return true;
                                    }));
  return taken;
}

absl::Status MapRows::Stays(const std::string& node_id,
                            const Take<v1::PresenceInterval>& take) const {
  auto request = Begin<v1::ListPresenceRequest>();
  request.set_node_id(node_id);
  request.set_from_ns(kTimeMin);
  request.set_to_ns(EndNs());
  return session_.EachPage(&query::Api::ListPresence, request, 0,
                           &v1::ListPresenceResponse::intervals_size,
                           [&](const v1::ListPresenceResponse& page) {
                             for (const v1::PresenceInterval& stay : page.intervals()) {
                               DSG_RETURN_IF_ERROR(take(stay));
                             }
                             return absl::OkStatus();
                           });
}

}  // namespace dsg::cli
