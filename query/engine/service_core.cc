// SPDX-License-Identifier: Apache-2.0
#include "query/engine/service_core.h"

#include <utility>

#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/agent_shape.h"
#include "query/engine/ancestry.h"
#include "query/engine/collision.h"
#include "query/engine/collision/collision_cache.h"
#include "query/engine/commit.h"
#include "query/engine/diff.h"
#include "query/engine/edges.h"
#include "query/engine/encounters.h"
#include "query/engine/interactions.h"
#include "query/engine/locate.h"
#include "query/engine/maintenance_core.h"
#include "query/engine/maps.h"
#include "query/engine/mesh.h"
#include "query/engine/nearest.h"
#include "query/engine/neighbors.h"
#include "query/engine/nodes.h"
#include "query/engine/page_token.h"
#include "query/engine/path.h"
#include "query/engine/predict.h"
#include "query/engine/presence.h"
#include "query/engine/read_view.h"
#include "query/engine/search.h"
#include "query/engine/send_all.h"
#include "query/engine/subgraph.h"
#include "query/engine/trajectory.h"
#include "query/engine/walk_area_cache.h"
#include "query/engine/watch.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

class LocalCore final : public MaintenanceCore {
 public:
  LocalCore(std::unique_ptr<GraphStore> store, const ServiceCoreOptions& options)
      : MaintenanceCore(std::move(store), options) {}

  absl::Status LocateAgent(const CallContext& call, const v1::LocateAgentRequest& request,
                           v1::LocateAgentResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::LocateAgent(view, &names_, &ancestries_, request, reply);
  }

  absl::Status BatchLocateAgents(const CallContext& call,
                                 const v1::BatchLocateAgentsRequest& request,
                                 v1::BatchLocateAgentsResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::BatchLocateAgents(view, &names_, call, request, reply);
  }

  absl::StatusOr<std::unique_ptr<TrajectoryCursor>> OpenTrajectory(
      const v1::GetTrajectoryRequest& request) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view,
                         ReadView::Open(&maps_, request.map(), request.read_at()));
    return query::OpenTrajectory(view, &names_, request);
  }

  absl::Status GetTrajectory(
      const CallContext& call, const v1::GetTrajectoryRequest& request,
      const std::function<bool(const v1::GetTrajectoryResponse&)>& send) override {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<TrajectoryCursor> cursor, OpenTrajectory(request));
    return SendAll(call, cursor.get(), send);
  }

  absl::StatusOr<std::unique_ptr<MeshCursor>> OpenMesh(const v1::GetMeshRequest& request) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view,
                         ReadView::Open(&maps_, request.map(), request.read_at()));
    return query::OpenMesh(view, request);
  }

  absl::Status GetMesh(const CallContext& call, const v1::GetMeshRequest& request,
                       const std::function<bool(const v1::GetMeshResponse&)>& send) override {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<MeshCursor> cursor, OpenMesh(request));
    return SendAll(call, cursor.get(), send);
  }

  absl::StatusOr<std::unique_ptr<AgentShapeCursor>> OpenAgentShape(
      const v1::GetAgentShapeRequest& request) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view,
                         ReadView::Open(&maps_, request.map(), request.read_at()));
    return query::OpenAgentShape(view, &names_, request);
  }

  absl::Status GetAgentShape(
      const CallContext& call, const v1::GetAgentShapeRequest& request,
      const std::function<bool(const v1::GetAgentShapeResponse&)>& send) override {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<AgentShapeCursor> cursor, OpenAgentShape(request));
    return SendAll(call, cursor.get(), send);
  }

  absl::Status ListPresence(const CallContext& call, const v1::ListPresenceRequest& request,
                            v1::ListPresenceResponse* reply) override {
    DSG_RETURN_IF_ERROR(CheckListPresence(request));
    DSG_ASSIGN_OR_RETURN(const Page page, OpenList(call, "ListPresence", request));
    return query::ListPresence(page, call, request, reply);
  }

  absl::Status GetNode(const CallContext& call, const v1::GetNodeRequest& request,
                       v1::GetNodeResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::GetNode(view, call, request, reply);
  }

  absl::Status ListNodes(const CallContext& call, const v1::ListNodesRequest& request,
                         v1::ListNodesResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const Page page, OpenList(call, "ListNodes", request));
    return query::ListNodes(page, call, request, reply);
  }

  absl::Status ListEdges(const CallContext& call, const v1::ListEdgesRequest& request,
                         v1::ListEdgesResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const Page page, OpenList(call, "ListEdges", request));
    return query::ListEdges(page, call, request, reply);
  }

  absl::Status ListNearestNodes(const CallContext& call, const v1::ListNearestNodesRequest& request,
                                v1::ListNearestNodesResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::ListNearestNodes(view, call, request, reply);
  }

  absl::Status BatchGetNodes(const CallContext& call, const v1::BatchGetNodesRequest& request,
                             v1::BatchGetNodesResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::BatchGetNodes(view, call, request, reply);
  }

  absl::Status PlanPath(const CallContext& call, const v1::PlanPathRequest& request,
                        v1::PlanPathResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::PlanPath(view, &collisions_, call, request, reply);
  }

  absl::Status PlanPaths(const CallContext& call, const v1::PlanPathsRequest& request,
                         v1::PlanPathsResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::PlanPaths(view, &collisions_, call, request, reply);
  }

  absl::Status CheckCollision(const CallContext& call, const v1::CheckCollisionRequest& request,
                              v1::CheckCollisionResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::CheckCollision(view, &collisions_, call, request, reply);
  }

  absl::Status PredictAgent(const CallContext& call, const v1::PredictAgentRequest& request,
                            v1::PredictAgentResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::PredictAgent(view, &names_, &walk_areas_, call, request, reply);
  }

  absl::Status GetNeighbors(const CallContext& call, const v1::GetNeighborsRequest& request,
                            v1::GetNeighborsResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const Page page, OpenList(call, "GetNeighbors", request));
    return query::GetNeighbors(page, call, request, reply);
  }

  absl::Status SearchNodes(const CallContext& call, const v1::SearchNodesRequest& request,
                           v1::SearchNodesResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const Page page, OpenList(call, "SearchNodes", request));
    return query::SearchNodes(page, call, request, reply);
  }

  absl::Status ListEncounters(const CallContext& call, const v1::ListEncountersRequest& request,
                              v1::ListEncountersResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const Page page, OpenList(call, "ListEncounters", request));
    return query::ListEncounters(page, &names_, call, request, reply);
  }

  absl::Status ListInteractions(const CallContext& call, const v1::ListInteractionsRequest& request,
                                v1::ListInteractionsResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const Page page, OpenList(call, "ListInteractions", request));
    return query::ListInteractions(page, &names_, call, request, reply);
  }

  absl::StatusOr<std::unique_ptr<SubgraphCursor>> OpenSubgraph(
      const v1::GetSubgraphRequest& request) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view,
                         ReadView::Open(&maps_, request.map(), request.read_at()));
    return query::OpenSubgraph(view, request);
  }

  absl::Status GetSubgraph(
      const CallContext& call, const v1::GetSubgraphRequest& request,
      const std::function<bool(const v1::GetSubgraphResponse&)>& send) override {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<SubgraphCursor> cursor, OpenSubgraph(request));
    return SendAll(call, cursor.get(), send);
  }

  absl::Status DiffRevisions(const CallContext& call, const v1::DiffRevisionsRequest& request,
                             v1::DiffRevisionsResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    return query::DiffRevisions(&maps_, call, request, reply);
  }

  absl::StatusOr<std::unique_ptr<WatchCursor>> OpenWatch(
      const v1::WatchMapRequest& request) override {
    return query::OpenWatch(&maps_, request);
  }

  absl::Status WatchMap(const CallContext& call, const v1::WatchMapRequest& request,
                        const std::function<bool(const v1::WatchMapResponse&)>& send) override {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<WatchCursor> cursor, OpenWatch(request));
    return SendAll(call, cursor.get(), send);
  }

  absl::Status CreateMap(const CallContext& call, const v1::CreateMapRequest& request,
                         v1::CreateMapResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    return query::CreateMap(&maps_.store(), request, reply);
  }

  absl::Status ListMaps(const CallContext& call, const v1::ListMapsRequest&,
                        v1::ListMapsResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    return query::ListMaps(&maps_.store(), reply);
  }

  absl::Status GetMapStats(const CallContext& call, const v1::GetMapStatsRequest& request,
                           v1::GetMapStatsResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(const ReadView view, Open(call, request));
    return query::GetMapStats(view, reply);
  }

  absl::Status ListRevisions(const CallContext& call, const v1::ListRevisionsRequest& request,
                             v1::ListRevisionsResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const ReadView view,
                         ReadView::Open(&maps_, request.map(), v1::ReadAt::default_instance()));
    return query::ListRevisions(view, request, reply);
  }

  absl::Status GetServerInfo(const CallContext& call, const v1::GetServerInfoRequest&,
                             v1::GetServerInfoResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    query::GetServerInfo(reply);
    return absl::OkStatus();
  }

  absl::Status Commit(const CallContext& call, const v1::CommitRequest& request,
                      v1::CommitResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    return query::Commit(&maps_, call, request, reply);
  }

  absl::Status GetSession(const CallContext& call, const v1::GetSessionRequest& request,
                          v1::GetSessionResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    return query::GetSession(&maps_, request, reply);
  }

 private:
  template <typename Request>
  absl::StatusOr<ReadView> Open(const CallContext& call, const Request& request) {
    DSG_RETURN_IF_ERROR(call.Check());
    return ReadView::Open(&maps_, request.map(), request.read_at());
  }

  template <typename Request>
  absl::StatusOr<Page> OpenList(const CallContext& call, std::string_view method,
                                const Request& request) {
    DSG_RETURN_IF_ERROR(call.Check());
    return OpenPage(&maps_, method, request);
  }

  AgentNames names_;
  AncestryCache ancestries_;
  WalkAreaCache walk_areas_;
  CollisionCache collisions_;
};

}  // namespace

std::unique_ptr<ServiceCore> MakeServiceCore(std::unique_ptr<GraphStore> store,
                                             const ServiceCoreOptions& options) {
  return std::make_unique<LocalCore>(std::move(store), options);
}

}  // namespace dsg::query
