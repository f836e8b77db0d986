// SPDX-License-Identifier: Apache-2.0
#include "query/engine/service_core.h"

#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/agent_shape.h"
#include "query/engine/ancestry.h"
#include "query/engine/commit.h"
#include "query/engine/edges.h"
#include "query/engine/locate.h"
#include "query/engine/map_table.h"
#include "query/engine/maps.h"
#include "query/engine/mesh.h"
#include "query/engine/nearest.h"
#include "query/engine/nodes.h"
#include "query/engine/page_token.h"
#include "query/engine/presence.h"
#include "query/engine/read_view.h"
#include "query/engine/trajectory.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

class LocalCore final : public ServiceCore {
 public:
  explicit LocalCore(std::unique_ptr<GraphStore> store) : maps_(std::move(store)) {}

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

  template <typename Reply>
  static absl::Status SendAll(const CallContext& call, StreamCursor<Reply>* cursor,
                              const std::function<bool(const Reply&)>& send) {
    Reply message;
    do {
      message.Clear();
      DSG_RETURN_IF_ERROR(cursor->Next(call, &message));
    } while (send(message) && !cursor->done());
    return absl::OkStatus();
  }

  template <typename Request>
  absl::StatusOr<Page> OpenList(const CallContext& call, std::string_view method,
                                const Request& request) {
    DSG_RETURN_IF_ERROR(call.Check());
    return OpenPage(&maps_, method, request);
  }

  MapTable maps_;
  AgentNames names_;
  AncestryCache ancestries_;
};

}  // namespace

std::unique_ptr<ServiceCore> MakeServiceCore(std::unique_ptr<GraphStore> store) {
  return std::make_unique<LocalCore>(std::move(store));
}

}  // namespace dsg::query
