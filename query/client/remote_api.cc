// SPDX-License-Identifier: Apache-2.0
#include "query/client/remote_api.h"

#include <grpcpp/channel.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>

#include "dsg/v1/ingest_service.grpc.pb.h"
#include "dsg/v1/maintenance_service.grpc.pb.h"
#include "dsg/v1/map_service.grpc.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "query/client/call.h"
#include "query/client/channel.h"
#include "schema/base/status.h"

namespace dsg::client {
namespace {

using query::CallContext;
using QueryStub = v1::QueryService::Stub;
using MapStub = v1::MapService::Stub;
using IngestStub = v1::IngestService::Stub;
using MaintenanceStub = v1::MaintenanceService::Stub;
template <class Reply>
using Send = std::function<bool(const Reply&)>;

// Signs of life of a watch; see map_service.proto.
constexpr int64_t kWatchIdleDefaultNs = 5'000'000'000;
constexpr int64_t kWatchIdleMaxNs = 86'400'000'000'000;

// Maintenance takes as long as it takes; the keepalive of the channel finds a server that is gone.
constexpr CallLimits kWorkLimits{std::chrono::seconds(0), std::chrono::nanoseconds(0)};

class RemoteApi final : public query::Api {
 public:
  explicit RemoteApi(std::string address)
      : address_(std::move(address)),
        channel_(MakeChannel(address_)),
        query_(channel_),
        map_(channel_),
        ingest_(channel_),
        maintenance_(channel_) {}

  absl::Status LocateAgent(const CallContext& call, const v1::LocateAgentRequest& request,
                           v1::LocateAgentResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncLocateAgent, request, reply);
  }
  absl::Status BatchLocateAgents(const CallContext& call,
                                 const v1::BatchLocateAgentsRequest& request,
                                 v1::BatchLocateAgentsResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncBatchLocateAgents, request, reply);
  }
  absl::Status GetTrajectory(const CallContext& call, const v1::GetTrajectoryRequest& request,
                             const Send<v1::GetTrajectoryResponse>& send) override {
    return Stream(call, &query_, &QueryStub::PrepareAsyncGetTrajectory, request, send);
  }
  absl::Status ListPresence(const CallContext& call, const v1::ListPresenceRequest& request,
                            v1::ListPresenceResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncListPresence, request, reply);
  }
  absl::Status GetNode(const CallContext& call, const v1::GetNodeRequest& request,
                       v1::GetNodeResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncGetNode, request, reply);
  }
  absl::Status ListNodes(const CallContext& call, const v1::ListNodesRequest& request,
                         v1::ListNodesResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncListNodes, request, reply);
  }
  absl::Status ListEdges(const CallContext& call, const v1::ListEdgesRequest& request,
                         v1::ListEdgesResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncListEdges, request, reply);
  }
  absl::Status ListNearestNodes(const CallContext& call, const v1::ListNearestNodesRequest& request,
                                v1::ListNearestNodesResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncListNearestNodes, request, reply);
  }
  absl::Status GetMesh(const CallContext& call, const v1::GetMeshRequest& request,
                       const Send<v1::GetMeshResponse>& send) override {
    return Stream(call, &query_, &QueryStub::PrepareAsyncGetMesh, request, send);
  }
  absl::Status GetAgentShape(const CallContext& call, const v1::GetAgentShapeRequest& request,
                             const Send<v1::GetAgentShapeResponse>& send) override {
    return Stream(call, &query_, &QueryStub::PrepareAsyncGetAgentShape, request, send);
  }
  absl::Status BatchGetNodes(const CallContext& call, const v1::BatchGetNodesRequest& request,
                             v1::BatchGetNodesResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncBatchGetNodes, request, reply);
  }
  absl::Status GetNeighbors(const CallContext& call, const v1::GetNeighborsRequest& request,
                            v1::GetNeighborsResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncGetNeighbors, request, reply);
  }
  absl::Status SearchNodes(const CallContext& call, const v1::SearchNodesRequest& request,
                           v1::SearchNodesResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncSearchNodes, request, reply);
  }
  absl::Status ListEncounters(const CallContext& call, const v1::ListEncountersRequest& request,
                              v1::ListEncountersResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncListEncounters, request, reply);
  }
  absl::Status ListInteractions(const CallContext& call, const v1::ListInteractionsRequest& request,
                                v1::ListInteractionsResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncListInteractions, request, reply);
  }
  absl::Status PlanPath(const CallContext& call, const v1::PlanPathRequest& request,
                        v1::PlanPathResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncPlanPath, request, reply);
  }
  absl::Status PlanPaths(const CallContext& call, const v1::PlanPathsRequest& request,
                         v1::PlanPathsResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncPlanPaths, request, reply);
  }
  absl::Status CheckCollision(const CallContext& call, const v1::CheckCollisionRequest& request,
                              v1::CheckCollisionResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncCheckCollision, request, reply);
  }
  absl::Status PredictAgent(const CallContext& call, const v1::PredictAgentRequest& request,
                            v1::PredictAgentResponse* reply) override {
    return Read(call, &query_, &QueryStub::PrepareAsyncPredictAgent, request, reply);
  }
  absl::Status GetSubgraph(const CallContext& call, const v1::GetSubgraphRequest& request,
                           const Send<v1::GetSubgraphResponse>& send) override {
    return Stream(call, &query_, &QueryStub::PrepareAsyncGetSubgraph, request, send);
  }

  // Not retried: whether the map was made is unknown, and a second try would say MAP_EXISTS.
  absl::Status CreateMap(const CallContext& call, const v1::CreateMapRequest& request,
                         v1::CreateMapResponse* reply) override {
    return CallOnce(call, address_, &map_, &MapStub::PrepareAsyncCreateMap, request, reply);
  }
  absl::Status ListMaps(const CallContext& call, const v1::ListMapsRequest& request,
                        v1::ListMapsResponse* reply) override {
    return Read(call, &map_, &MapStub::PrepareAsyncListMaps, request, reply);
  }
  absl::Status GetMapStats(const CallContext& call, const v1::GetMapStatsRequest& request,
                           v1::GetMapStatsResponse* reply) override {
    return Read(call, &map_, &MapStub::PrepareAsyncGetMapStats, request, reply);
  }
  absl::Status ListRevisions(const CallContext& call, const v1::ListRevisionsRequest& request,
                             v1::ListRevisionsResponse* reply) override {
    return Read(call, &map_, &MapStub::PrepareAsyncListRevisions, request, reply);
  }
  absl::Status DiffRevisions(const CallContext& call, const v1::DiffRevisionsRequest& request,
                             v1::DiffRevisionsResponse* reply) override {
    return Read(call, &map_, &MapStub::PrepareAsyncDiffRevisions, request, reply);
  }
  absl::Status WatchMap(const CallContext& call, const v1::WatchMapRequest& request,
                        const Send<v1::WatchMapResponse>& send) override {
    // Lasts until its caller has enough, or nothing is heard for three signs of life.
    const int64_t idle_ns =
        request.idle_period_ns() > 0 ? request.idle_period_ns() : kWatchIdleDefaultNs;
    const CallLimits limits{std::chrono::seconds(0),
                            std::chrono::seconds(10) +
                                3 * std::chrono::nanoseconds(std::min(idle_ns, kWatchIdleMaxNs))};
    return Stream(call, &map_, &MapStub::PrepareAsyncWatchMap, request, send, limits);
  }
  absl::Status GetServerInfo(const CallContext& call, const v1::GetServerInfoRequest& request,
                             v1::GetServerInfoResponse* reply) override {
    return Read(call, &map_, &MapStub::PrepareAsyncGetServerInfo, request, reply);
  }

  // Not retried here: a writer that repeats a commit settles its outcome by the session first.
  absl::Status Commit(const CallContext& call, const v1::CommitRequest& request,
                      v1::CommitResponse* reply) override {
    return CallOnce(call, address_, &ingest_, &IngestStub::PrepareAsyncCommit, request, reply);
  }
  absl::Status GetSession(const CallContext& call, const v1::GetSessionRequest& request,
                          v1::GetSessionResponse* reply) override {
    return Read(call, &ingest_, &IngestStub::PrepareAsyncGetSession, request, reply);
  }

  absl::Status Prune(const CallContext& call, const v1::PruneRequest& request,
                     const Send<v1::PruneResponse>& send) override {
    return Work(call, &MaintenanceStub::PrepareAsyncPrune, request, send);
  }
  absl::Status Compact(const CallContext& call, const v1::CompactRequest& request,
                       const Send<v1::CompactResponse>& send) override {
    return Work(call, &MaintenanceStub::PrepareAsyncCompact, request, send);
  }
  absl::Status Revert(const CallContext& call, const v1::RevertRequest& request,
                      const Send<v1::RevertResponse>& send) override {
    return Work(call, &MaintenanceStub::PrepareAsyncRevert, request, send);
  }
  absl::Status MergeMaps(const CallContext& call, const v1::MergeMapsRequest& request,
                         const Send<v1::MergeMapsResponse>& send) override {
    return Work(call, &MaintenanceStub::PrepareAsyncMergeMaps, request, send);
  }
  absl::Status ReadArchive(const CallContext& call, const v1::ReadArchiveRequest& request,
                           const Send<v1::ReadArchiveResponse>& send) override {
    return Work(call, &MaintenanceStub::PrepareAsyncReadArchive, request, send);
  }
  // Tags are not retried: a second try could move a tag that another has set meanwhile.
  absl::Status SetTag(const CallContext& call, const v1::SetTagRequest& request,
                      v1::SetTagResponse* reply) override {
    return CallOnce(call, address_, &maintenance_, &MaintenanceStub::PrepareAsyncSetTag, request,
                    reply);
  }
  absl::Status RemoveTag(const CallContext& call, const v1::RemoveTagRequest& request,
                         v1::RemoveTagResponse* reply) override {
    return CallOnce(call, address_, &maintenance_, &MaintenanceStub::PrepareAsyncRemoveTag, request,
                    reply);
  }
  absl::Status ListTags(const CallContext& call, const v1::ListTagsRequest& request,
                        v1::ListTagsResponse* reply) override {
    return Read(call, &maintenance_, &MaintenanceStub::PrepareAsyncListTags, request, reply);
  }

 private:
  template <class Stub, class Request, class Reply>
  absl::Status Read(const CallContext& call, Stub* stub,
                    std::unique_ptr<grpc::ClientAsyncResponseReader<Reply>> (Stub::*prepare)(
                        grpc::ClientContext*, const Request&, grpc::CompletionQueue*),
                    const Request& request, Reply* reply) {
    return RetryRead(call, [&] { return CallOnce(call, address_, stub, prepare, request, reply); });
  }

  template <class Stub, class Request, class Reply>
  using PrepareStream = std::unique_ptr<grpc::ClientAsyncReader<Reply>> (Stub::*)(
      grpc::ClientContext*, const Request&, grpc::CompletionQueue*);

  template <class Stub, class Request, class Reply>
  absl::Status Stream(const CallContext& call, Stub* stub,
                      PrepareStream<Stub, Request, Reply> prepare, const Request& request,
                      const Send<Reply>& send, const CallLimits& limits = {});
  template <class Request, class Reply>
  absl::Status Work(const CallContext& call, PrepareStream<MaintenanceStub, Request, Reply> prepare,
                    const Request& request, const Send<Reply>& send) {
    return Stream(call, &maintenance_, prepare, request, send, kWorkLimits);
  }
  // Sets `started` once a message has reached `send`: from then on a repeat would send it twice.
  template <class Stub, class Request, class Reply>
  absl::Status StreamOnce(const CallContext& call, Stub* stub,
                          PrepareStream<Stub, Request, Reply> prepare, const Request& request,
                          const Send<Reply>& send, const CallLimits& limits, bool* started);

  const std::string address_;
  const std::shared_ptr<grpc::Channel> channel_;
  QueryStub query_;
  MapStub map_;
  IngestStub ingest_;
  MaintenanceStub maintenance_;
};

template <class Stub, class Request, class Reply>
absl::Status RemoteApi::StreamOnce(const CallContext& call, Stub* stub,
                                   PrepareStream<Stub, Request, Reply> prepare,
                                   const Request& request, const Send<Reply>& send,
                                   const CallLimits& limits, bool* started) {
  CallInFlight flight(call, address_, limits);
  auto rpc = (stub->*prepare)(flight.context(), request, flight.queue());
  rpc->StartCall(flight.tag());
  bool stopped = false;
  Reply message;
  if (flight.Wait()) {
    for (rpc->Read(&message, flight.tag()); flight.Wait(); rpc->Read(&message, flight.tag())) {
      *started = true;
      if (!send(message)) {
        stopped = true;
        flight.context()->TryCancel();
        break;
      }
    }
  }
  grpc::Status status;
  rpc->Finish(&status, flight.tag());
  flight.Wait();
  // The caller had enough, so the cancellation is ours and no error.
  return stopped ? absl::OkStatus() : flight.Outcome(status);
}

template <class Stub, class Request, class Reply>
absl::Status RemoteApi::Stream(const CallContext& call, Stub* stub,
                               PrepareStream<Stub, Request, Reply> prepare, const Request& request,
                               const Send<Reply>& send, const CallLimits& limits) {
  bool started = false;
  absl::Status broken;
  const absl::Status status = RetryRead(call, [&] {
    broken = StreamOnce(call, stub, prepare, request, send, limits, &started);
    return started ? absl::OkStatus() : broken;
  });
  return started ? broken : status;
}

}  // namespace

absl::StatusOr<std::unique_ptr<query::Api>> Connect(const std::string& address) {
  DSG_RETURN_IF_ERROR(CheckAddress(address));
  return std::make_unique<RemoteApi>(address);
}

}  // namespace dsg::client
