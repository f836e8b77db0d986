// SPDX-License-Identifier: Apache-2.0
#include "server/services.h"

#include <google/protobuf/arena.h>

#include "dsg/v1/ingest_service.grpc.pb.h"
#include "dsg/v1/maintenance_service.grpc.pb.h"
#include "dsg/v1/map_service.grpc.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "server/arena_blocks.h"
#include "server/stream_call.h"
#include "server/unary_call.h"

namespace dsg::server {
namespace {

using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;
using query::Api;

// Requests and replies on an arena, which whatever thread ends the call frees as one piece. Part by
// part it would free what others have allocated: a fifth of the instructions of 20 nodes.
template <typename Request, typename Reply>
class ArenaMessages final : public grpc::MessageAllocator<Request, Reply> {
 public:
  /// `blocks` must outlive this and all calls.
  explicit ArenaMessages(ArenaBlocks* blocks) : blocks_(blocks) {}

  grpc::MessageHolder<Request, Reply>* AllocateMessages() override { return new Holder(blocks_); }

 private:
  class Holder final : public grpc::MessageHolder<Request, Reply> {
   public:
    explicit Holder(ArenaBlocks* blocks)
        : blocks_(blocks),
          block_(blocks->Take()),
          arena_(std::make_unique<google::protobuf::Arena>(Options(block_.get()))) {
      this->set_request(google::protobuf::Arena::CreateMessage<Request>(arena_.get()));
      this->set_response(google::protobuf::Arena::CreateMessage<Reply>(arena_.get()));
    }
    void Release() override {
      arena_ = nullptr;
      blocks_->Give(std::move(block_));
      delete this;
    }

   private:
    static google::protobuf::ArenaOptions Options(char* block) {
      google::protobuf::ArenaOptions options;
      options.initial_block = block;
      options.initial_block_size = ArenaBlocks::kBlockBytes;
      // Below the size from which malloc asks the kernel for fresh, unmapped pages each time.
      options.start_block_size = size_t{64} << 10;
      options.max_block_size = size_t{64} << 10;
      return options;
    }

    ArenaBlocks* const blocks_;
    ArenaBlocks::Block block_;
    std::unique_ptr<google::protobuf::Arena> arena_;
  };

  ArenaBlocks* const blocks_;
};

class QueryService final : public v1::QueryService::CallbackService {
 public:
  explicit QueryService(CallRuntime* runtime) : runtime_(runtime) {
    SetMessageAllocatorFor_BatchLocateAgents(&locations_);
    SetMessageAllocatorFor_BatchGetNodes(&batch_);
    SetMessageAllocatorFor_ListNodes(&nodes_);
    SetMessageAllocatorFor_ListEdges(&edges_);
    SetMessageAllocatorFor_ListNearestNodes(&nearest_);
    SetMessageAllocatorFor_GetNeighbors(&neighbors_);
    SetMessageAllocatorFor_SearchNodes(&matches_);
    SetMessageAllocatorFor_ListEncounters(&encounters_);
    SetMessageAllocatorFor_ListInteractions(&interactions_);
    SetMessageAllocatorFor_PlanPath(&path_);
    SetMessageAllocatorFor_PlanPaths(&paths_);
    SetMessageAllocatorFor_CheckCollision(&collisions_);
    SetMessageAllocatorFor_PredictAgent(&predictions_);
  }

  ServerUnaryReactor* LocateAgent(CallbackServerContext* context,
                                  const v1::LocateAgentRequest* request,
                                  v1::LocateAgentResponse* reply) override {
    return StartUnary(runtime_, "LocateAgent", &Api::LocateAgent, context, request, reply);
  }
  ServerUnaryReactor* BatchLocateAgents(CallbackServerContext* context,
                                        const v1::BatchLocateAgentsRequest* request,
                                        v1::BatchLocateAgentsResponse* reply) override {
    return StartUnary(runtime_, "BatchLocateAgents", &Api::BatchLocateAgents, context, request,
                      reply);
  }
  grpc::ServerWriteReactor<v1::GetTrajectoryResponse>* GetTrajectory(
      CallbackServerContext* context, const v1::GetTrajectoryRequest* request) override {
    return StartStream(runtime_, "GetTrajectory", &query::ServiceCore::OpenTrajectory, context,
                       request);
  }
  ServerUnaryReactor* ListPresence(CallbackServerContext* context,
                                   const v1::ListPresenceRequest* request,
                                   v1::ListPresenceResponse* reply) override {
    return StartUnary(runtime_, "ListPresence", &Api::ListPresence, context, request, reply);
  }
  ServerUnaryReactor* GetNode(CallbackServerContext* context, const v1::GetNodeRequest* request,
                              v1::GetNodeResponse* reply) override {
    return StartUnary(runtime_, "GetNode", &Api::GetNode, context, request, reply);
  }
  ServerUnaryReactor* ListNodes(CallbackServerContext* context, const v1::ListNodesRequest* request,
                                v1::ListNodesResponse* reply) override {
    return StartUnary(runtime_, "ListNodes", &Api::ListNodes, context, request, reply);
  }
  ServerUnaryReactor* ListEdges(CallbackServerContext* context, const v1::ListEdgesRequest* request,
                                v1::ListEdgesResponse* reply) override {
    return StartUnary(runtime_, "ListEdges", &Api::ListEdges, context, request, reply);
  }
  ServerUnaryReactor* ListNearestNodes(CallbackServerContext* context,
                                       const v1::ListNearestNodesRequest* request,
                                       v1::ListNearestNodesResponse* reply) override {
    return StartUnary(runtime_, "ListNearestNodes", &Api::ListNearestNodes, context, request,
                      reply);
  }
  grpc::ServerWriteReactor<v1::GetMeshResponse>* GetMesh(
      CallbackServerContext* context, const v1::GetMeshRequest* request) override {
    return StartStream(runtime_, "GetMesh", &query::ServiceCore::OpenMesh, context, request);
  }
  grpc::ServerWriteReactor<v1::GetAgentShapeResponse>* GetAgentShape(
      CallbackServerContext* context, const v1::GetAgentShapeRequest* request) override {
    return StartStream(runtime_, "GetAgentShape", &query::ServiceCore::OpenAgentShape, context,
                       request);
  }
  ServerUnaryReactor* BatchGetNodes(CallbackServerContext* context,
                                    const v1::BatchGetNodesRequest* request,
                                    v1::BatchGetNodesResponse* reply) override {
    return StartUnary(runtime_, "BatchGetNodes", &Api::BatchGetNodes, context, request, reply);
  }
  ServerUnaryReactor* GetNeighbors(CallbackServerContext* context,
                                   const v1::GetNeighborsRequest* request,
                                   v1::GetNeighborsResponse* reply) override {
    return StartUnary(runtime_, "GetNeighbors", &Api::GetNeighbors, context, request, reply);
  }
  ServerUnaryReactor* SearchNodes(CallbackServerContext* context,
                                  const v1::SearchNodesRequest* request,
                                  v1::SearchNodesResponse* reply) override {
    return StartUnary(runtime_, "SearchNodes", &Api::SearchNodes, context, request, reply);
  }
  ServerUnaryReactor* ListEncounters(CallbackServerContext* context,
                                     const v1::ListEncountersRequest* request,
                                     v1::ListEncountersResponse* reply) override {
    return StartUnary(runtime_, "ListEncounters", &Api::ListEncounters, context, request, reply);
  }
  ServerUnaryReactor* ListInteractions(CallbackServerContext* context,
                                       const v1::ListInteractionsRequest* request,
                                       v1::ListInteractionsResponse* reply) override {
    return StartUnary(runtime_, "ListInteractions", &Api::ListInteractions, context, request,
                      reply);
  }
  ServerUnaryReactor* PlanPath(CallbackServerContext* context, const v1::PlanPathRequest* request,
                               v1::PlanPathResponse* reply) override {
    return StartUnary(runtime_, "PlanPath", &Api::PlanPath, context, request, reply);
  }
  ServerUnaryReactor* PlanPaths(CallbackServerContext* context, const v1::PlanPathsRequest* request,
                                v1::PlanPathsResponse* reply) override {
    return StartUnary(runtime_, "PlanPaths", &Api::PlanPaths, context, request, reply);
  }
  ServerUnaryReactor* CheckCollision(CallbackServerContext* context,
                                     const v1::CheckCollisionRequest* request,
                                     v1::CheckCollisionResponse* reply) override {
    return StartUnary(runtime_, "CheckCollision", &Api::CheckCollision, context, request, reply);
  }
  ServerUnaryReactor* PredictAgent(CallbackServerContext* context,
                                   const v1::PredictAgentRequest* request,
                                   v1::PredictAgentResponse* reply) override {
    return StartUnary(runtime_, "PredictAgent", &Api::PredictAgent, context, request, reply);
  }
  grpc::ServerWriteReactor<v1::GetSubgraphResponse>* GetSubgraph(
      CallbackServerContext* context, const v1::GetSubgraphRequest* request) override {
    return StartStream(runtime_, "GetSubgraph", &query::ServiceCore::OpenSubgraph, context,
                       request);
  }

 private:
  // Of replies that have many parts. A small one gains nothing.
  ArenaBlocks blocks_;
  ArenaMessages<v1::BatchLocateAgentsRequest, v1::BatchLocateAgentsResponse> locations_{&blocks_};
  ArenaMessages<v1::BatchGetNodesRequest, v1::BatchGetNodesResponse> batch_{&blocks_};
  ArenaMessages<v1::ListNodesRequest, v1::ListNodesResponse> nodes_{&blocks_};
  ArenaMessages<v1::ListEdgesRequest, v1::ListEdgesResponse> edges_{&blocks_};
  ArenaMessages<v1::ListNearestNodesRequest, v1::ListNearestNodesResponse> nearest_{&blocks_};
  ArenaMessages<v1::GetNeighborsRequest, v1::GetNeighborsResponse> neighbors_{&blocks_};
  ArenaMessages<v1::SearchNodesRequest, v1::SearchNodesResponse> matches_{&blocks_};
  ArenaMessages<v1::ListEncountersRequest, v1::ListEncountersResponse> encounters_{&blocks_};
  ArenaMessages<v1::ListInteractionsRequest, v1::ListInteractionsResponse> interactions_{&blocks_};
  ArenaMessages<v1::PlanPathRequest, v1::PlanPathResponse> path_{&blocks_};
  ArenaMessages<v1::PlanPathsRequest, v1::PlanPathsResponse> paths_{&blocks_};
  ArenaMessages<v1::CheckCollisionRequest, v1::CheckCollisionResponse> collisions_{&blocks_};
  ArenaMessages<v1::PredictAgentRequest, v1::PredictAgentResponse> predictions_{&blocks_};
  CallRuntime* runtime_;
};

class MapService final : public v1::MapService::CallbackService {
 public:
  explicit MapService(CallRuntime* runtime) : runtime_(runtime) {
    SetMessageAllocatorFor_DiffRevisions(&difference_);
  }

  ServerUnaryReactor* CreateMap(CallbackServerContext* context, const v1::CreateMapRequest* request,
                                v1::CreateMapResponse* reply) override {
    return StartUnary(runtime_, "CreateMap", &Api::CreateMap, context, request, reply);
  }
  ServerUnaryReactor* ListMaps(CallbackServerContext* context, const v1::ListMapsRequest* request,
                               v1::ListMapsResponse* reply) override {
    return StartUnary(runtime_, "ListMaps", &Api::ListMaps, context, request, reply);
  }
  ServerUnaryReactor* GetMapStats(CallbackServerContext* context,
                                  const v1::GetMapStatsRequest* request,
                                  v1::GetMapStatsResponse* reply) override {
    return StartUnary(runtime_, "GetMapStats", &Api::GetMapStats, context, request, reply);
  }
  ServerUnaryReactor* ListRevisions(CallbackServerContext* context,
                                    const v1::ListRevisionsRequest* request,
                                    v1::ListRevisionsResponse* reply) override {
    return StartUnary(runtime_, "ListRevisions", &Api::ListRevisions, context, request, reply);
  }
  ServerUnaryReactor* DiffRevisions(CallbackServerContext* context,
                                    const v1::DiffRevisionsRequest* request,
                                    v1::DiffRevisionsResponse* reply) override {
    return StartUnary(runtime_, "DiffRevisions", &Api::DiffRevisions, context, request, reply);
  }
  grpc::ServerWriteReactor<v1::WatchMapResponse>* WatchMap(
      CallbackServerContext* context, const v1::WatchMapRequest* request) override {
    return StartWatch(runtime_, "WatchMap", &query::ServiceCore::OpenWatch, context, request);
  }
  ServerUnaryReactor* GetServerInfo(CallbackServerContext* context,
                                    const v1::GetServerInfoRequest* request,
                                    v1::GetServerInfoResponse* reply) override {
    return StartUnary(runtime_, "GetServerInfo", &Api::GetServerInfo, context, request, reply);
  }

 private:
  ArenaBlocks blocks_;
  ArenaMessages<v1::DiffRevisionsRequest, v1::DiffRevisionsResponse> difference_{&blocks_};
  CallRuntime* runtime_;
};

class IngestService final : public v1::IngestService::CallbackService {
 public:
  explicit IngestService(CallRuntime* runtime) : runtime_(runtime) {}

  ServerUnaryReactor* Commit(CallbackServerContext* context, const v1::CommitRequest* request,
                             v1::CommitResponse* reply) override {
    return StartUnary(runtime_, "Commit", &Api::Commit, context, request, reply);
  }
  ServerUnaryReactor* GetSession(CallbackServerContext* context,
                                 const v1::GetSessionRequest* request,
                                 v1::GetSessionResponse* reply) override {
    return StartUnary(runtime_, "GetSession", &Api::GetSession, context, request, reply);
  }

 private:
  CallRuntime* runtime_;
};

class MaintenanceService final : public v1::MaintenanceService::CallbackService {
 public:
  explicit MaintenanceService(CallRuntime* runtime) : runtime_(runtime) {}

  grpc::ServerWriteReactor<v1::PruneResponse>* Prune(CallbackServerContext* context,
                                                     const v1::PruneRequest* request) override {
    return StartWork(runtime_, "Prune", &query::ServiceCore::OpenPrune, context, request);
  }
  grpc::ServerWriteReactor<v1::CompactResponse>* Compact(
      CallbackServerContext* context, const v1::CompactRequest* request) override {
    return StartWork(runtime_, "Compact", &query::ServiceCore::OpenCompact, context, request);
  }
  grpc::ServerWriteReactor<v1::RevertResponse>* Revert(CallbackServerContext* context,
                                                       const v1::RevertRequest* request) override {
    return StartWork(runtime_, "Revert", &query::ServiceCore::OpenRevert, context, request);
  }
  grpc::ServerWriteReactor<v1::MergeMapsResponse>* MergeMaps(
      CallbackServerContext* context, const v1::MergeMapsRequest* request) override {
    return StartWork(runtime_, "MergeMaps", &query::ServiceCore::OpenMerge, context, request);
  }
  grpc::ServerWriteReactor<v1::ReadArchiveResponse>* ReadArchive(
      CallbackServerContext* context, const v1::ReadArchiveRequest* request) override {
    return StartWork(runtime_, "ReadArchive", &query::ServiceCore::OpenArchive, context, request);
  }
  ServerUnaryReactor* SetTag(CallbackServerContext* context, const v1::SetTagRequest* request,
                             v1::SetTagResponse* reply) override {
    return StartUnary(runtime_, "SetTag", &Api::SetTag, context, request, reply);
  }
  ServerUnaryReactor* RemoveTag(CallbackServerContext* context, const v1::RemoveTagRequest* request,
                                v1::RemoveTagResponse* reply) override {
    return StartUnary(runtime_, "RemoveTag", &Api::RemoveTag, context, request, reply);
  }
  ServerUnaryReactor* ListTags(CallbackServerContext* context, const v1::ListTagsRequest* request,
                               v1::ListTagsResponse* reply) override {
    return StartUnary(runtime_, "ListTags", &Api::ListTags, context, request, reply);
  }

 private:
  CallRuntime* runtime_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeQueryService(CallRuntime* runtime) {
  return std::make_unique<QueryService>(runtime);
}

std::unique_ptr<grpc::Service> MakeMapService(CallRuntime* runtime) {
  return std::make_unique<MapService>(runtime);
}

std::unique_ptr<grpc::Service> MakeIngestService(CallRuntime* runtime) {
  return std::make_unique<IngestService>(runtime);
}

std::unique_ptr<grpc::Service> MakeMaintenanceService(CallRuntime* runtime) {
  return std::make_unique<MaintenanceService>(runtime);
}

}  // namespace dsg::server
