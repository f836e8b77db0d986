// SPDX-License-Identifier: Apache-2.0
// Every question as a plain function from request to reply. Two implementations: ServiceCore
// answers from a store folder, client::RemoteApi asks a dsg-server. The CLI cannot tell them apart,
// and the server's handlers only pass calls on to a ServiceCore.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "query/engine/call_context.h"

namespace dsg::v1 {
class BatchGetNodesRequest;
class BatchGetNodesResponse;
class BatchLocateAgentsRequest;
class BatchLocateAgentsResponse;
class CheckCollisionRequest;
class CheckCollisionResponse;
class CommitRequest;
class CommitResponse;
class CompactRequest;
class CompactResponse;
class CreateMapRequest;
class CreateMapResponse;
class DiffRevisionsRequest;
class DiffRevisionsResponse;
class GetAgentShapeRequest;
class GetAgentShapeResponse;
class GetMapStatsRequest;
class GetMapStatsResponse;
class GetMeshRequest;
class GetMeshResponse;
class GetNeighborsRequest;
class GetNeighborsResponse;
class GetNodeRequest;
class GetNodeResponse;
class GetServerInfoRequest;
class GetServerInfoResponse;
class GetSessionRequest;
class GetSessionResponse;
class GetSubgraphRequest;
class GetSubgraphResponse;
class GetTrajectoryRequest;
class GetTrajectoryResponse;
class ListEdgesRequest;
class ListEdgesResponse;
class ListEncountersRequest;
class ListEncountersResponse;
class ListInteractionsRequest;
class ListInteractionsResponse;
class ListMapsRequest;
class ListMapsResponse;
class ListNearestNodesRequest;
class ListNearestNodesResponse;
class ListNodesRequest;
class ListNodesResponse;
class ListPresenceRequest;
class ListPresenceResponse;
class ListRevisionsRequest;
class ListRevisionsResponse;
class ListTagsRequest;
class ListTagsResponse;
class LocateAgentRequest;
class LocateAgentResponse;
class MergeMapsRequest;
class MergeMapsResponse;
class PlanPathRequest;
class PlanPathResponse;
class PlanPathsRequest;
class PlanPathsResponse;
class PredictAgentRequest;
class PredictAgentResponse;
class PruneRequest;
class PruneResponse;
class ReadArchiveRequest;
class ReadArchiveResponse;
class RemoveTagRequest;
class RemoveTagResponse;
class RevertRequest;
class RevertResponse;
class SearchNodesRequest;
class SearchNodesResponse;
class SetTagRequest;
class SetTagResponse;
class WatchMapRequest;
class WatchMapResponse;
}  // namespace dsg::v1

namespace dsg::query {

/// Threads: safe from many threads.
/// Errors: the codes and reasons that the service protos document; what `call.Check()` returns.
class Api {
 public:
  virtual ~Api() = default;

  virtual absl::Status LocateAgent(const CallContext& call, const v1::LocateAgentRequest& request,
                                   v1::LocateAgentResponse* reply) = 0;
  virtual absl::Status BatchLocateAgents(const CallContext& call,
                                         const v1::BatchLocateAgentsRequest& request,
                                         v1::BatchLocateAgentsResponse* reply) = 0;
  /// Calls `send` for each message of the stream, until it returns false.
  virtual absl::Status GetTrajectory(
      const CallContext& call, const v1::GetTrajectoryRequest& request,
      const std::function<bool(const v1::GetTrajectoryResponse&)>& send) = 0;
  virtual absl::Status ListPresence(const CallContext& call, const v1::ListPresenceRequest& request,
                                    v1::ListPresenceResponse* reply) = 0;
  virtual absl::Status GetNode(const CallContext& call, const v1::GetNodeRequest& request,
                               v1::GetNodeResponse* reply) = 0;
  virtual absl::Status ListNodes(const CallContext& call, const v1::ListNodesRequest& request,
                                 v1::ListNodesResponse* reply) = 0;
  virtual absl::Status ListEdges(const CallContext& call, const v1::ListEdgesRequest& request,
                                 v1::ListEdgesResponse* reply) = 0;
  virtual absl::Status ListNearestNodes(const CallContext& call,
                                        const v1::ListNearestNodesRequest& request,
                                        v1::ListNearestNodesResponse* reply) = 0;
  /// As GetTrajectory.
  virtual absl::Status GetMesh(const CallContext& call, const v1::GetMeshRequest& request,
                               const std::function<bool(const v1::GetMeshResponse&)>& send) = 0;
  /// As GetTrajectory.
  virtual absl::Status GetAgentShape(
      const CallContext& call, const v1::GetAgentShapeRequest& request,
      const std::function<bool(const v1::GetAgentShapeResponse&)>& send) = 0;
  virtual absl::Status BatchGetNodes(const CallContext& call,
                                     const v1::BatchGetNodesRequest& request,
                                     v1::BatchGetNodesResponse* reply) = 0;
  virtual absl::Status GetNeighbors(const CallContext& call, const v1::GetNeighborsRequest& request,
                                    v1::GetNeighborsResponse* reply) = 0;
  virtual absl::Status SearchNodes(const CallContext& call, const v1::SearchNodesRequest& request,
                                   v1::SearchNodesResponse* reply) = 0;
  virtual absl::Status ListEncounters(const CallContext& call,
                                      const v1::ListEncountersRequest& request,
                                      v1::ListEncountersResponse* reply) = 0;
  virtual absl::Status ListInteractions(const CallContext& call,
                                        const v1::ListInteractionsRequest& request,
                                        v1::ListInteractionsResponse* reply) = 0;
  virtual absl::Status PlanPath(const CallContext& call, const v1::PlanPathRequest& request,
                                v1::PlanPathResponse* reply) = 0;
  virtual absl::Status PlanPaths(const CallContext& call, const v1::PlanPathsRequest& request,
                                 v1::PlanPathsResponse* reply) = 0;
  virtual absl::Status CheckCollision(const CallContext& call,
                                      const v1::CheckCollisionRequest& request,
                                      v1::CheckCollisionResponse* reply) = 0;
  virtual absl::Status PredictAgent(const CallContext& call, const v1::PredictAgentRequest& request,
                                    v1::PredictAgentResponse* reply) = 0;
  /// As GetTrajectory.
  virtual absl::Status GetSubgraph(
      const CallContext& call, const v1::GetSubgraphRequest& request,
      const std::function<bool(const v1::GetSubgraphResponse&)>& send) = 0;

  virtual absl::Status CreateMap(const CallContext& call, const v1::CreateMapRequest& request,
                                 v1::CreateMapResponse* reply) = 0;
  virtual absl::Status ListMaps(const CallContext& call, const v1::ListMapsRequest& request,
                                v1::ListMapsResponse* reply) = 0;
  virtual absl::Status GetMapStats(const CallContext& call, const v1::GetMapStatsRequest& request,
                                   v1::GetMapStatsResponse* reply) = 0;
  virtual absl::Status ListRevisions(const CallContext& call,
                                     const v1::ListRevisionsRequest& request,
                                     v1::ListRevisionsResponse* reply) = 0;
  virtual absl::Status DiffRevisions(const CallContext& call,
                                     const v1::DiffRevisionsRequest& request,
                                     v1::DiffRevisionsResponse* reply) = 0;
  /// As GetTrajectory; ends only when `send` returns false or `call` does.
  virtual absl::Status WatchMap(const CallContext& call, const v1::WatchMapRequest& request,
                                const std::function<bool(const v1::WatchMapResponse&)>& send) = 0;
  virtual absl::Status GetServerInfo(const CallContext& call,
                                     const v1::GetServerInfoRequest& request,
                                     v1::GetServerInfoResponse* reply) = 0;

  virtual absl::Status Commit(const CallContext& call, const v1::CommitRequest& request,
                              v1::CommitResponse* reply) = 0;
  virtual absl::Status GetSession(const CallContext& call, const v1::GetSessionRequest& request,
                                  v1::GetSessionResponse* reply) = 0;

  // Maintenance. The streams tell how far the work has come; ending one leaves done what it told.
  virtual absl::Status Prune(const CallContext& call, const v1::PruneRequest& request,
                             const std::function<bool(const v1::PruneResponse&)>& send) = 0;
  virtual absl::Status Compact(const CallContext& call, const v1::CompactRequest& request,
                               const std::function<bool(const v1::CompactResponse&)>& send) = 0;
  virtual absl::Status Revert(const CallContext& call, const v1::RevertRequest& request,
                              const std::function<bool(const v1::RevertResponse&)>& send) = 0;
  virtual absl::Status MergeMaps(const CallContext& call, const v1::MergeMapsRequest& request,
                                 const std::function<bool(const v1::MergeMapsResponse&)>& send) = 0;
  virtual absl::Status SetTag(const CallContext& call, const v1::SetTagRequest& request,
                              v1::SetTagResponse* reply) = 0;
  virtual absl::Status RemoveTag(const CallContext& call, const v1::RemoveTagRequest& request,
                                 v1::RemoveTagResponse* reply) = 0;
  virtual absl::Status ListTags(const CallContext& call, const v1::ListTagsRequest& request,
                                v1::ListTagsResponse* reply) = 0;
  /// As GetTrajectory.
  virtual absl::Status ReadArchive(
      const CallContext& call, const v1::ReadArchiveRequest& request,
      const std::function<bool(const v1::ReadArchiveResponse&)>& send) = 0;
};

}  // namespace dsg::query
