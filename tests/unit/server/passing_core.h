// SPDX-License-Identifier: Apache-2.0
// A core that passes every question on to another, for tests that change or count a single one.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "query/engine/service_core.h"

namespace dsg::server {

class PassingCore : public query::ServiceCore {
 public:
  explicit PassingCore(std::unique_ptr<query::ServiceCore> core) : core_(std::move(core)) {}

  const std::string& store_folder() const override { return core_->store_folder(); }

  absl::StatusOr<std::unique_ptr<query::TrajectoryCursor>> OpenTrajectory(
      const v1::GetTrajectoryRequest& request) override {
    return core_->OpenTrajectory(request);
  }
  absl::Status GetTrajectory(
      const query::CallContext& call, const v1::GetTrajectoryRequest& request,
      const std::function<bool(const v1::GetTrajectoryResponse&)>& send) override {
    return core_->GetTrajectory(call, request, send);
  }
  absl::StatusOr<std::unique_ptr<query::MeshCursor>> OpenMesh(
      const v1::GetMeshRequest& request) override {
    return core_->OpenMesh(request);
  }
  absl::Status GetMesh(const query::CallContext& call, const v1::GetMeshRequest& request,
                       const std::function<bool(const v1::GetMeshResponse&)>& send) override {
    return core_->GetMesh(call, request, send);
  }
  absl::StatusOr<std::unique_ptr<query::AgentShapeCursor>> OpenAgentShape(
      const v1::GetAgentShapeRequest& request) override {
    return core_->OpenAgentShape(request);
  }
  absl::Status GetAgentShape(
      const query::CallContext& call, const v1::GetAgentShapeRequest& request,
      const std::function<bool(const v1::GetAgentShapeResponse&)>& send) override {
    return core_->GetAgentShape(call, request, send);
  }

  absl::StatusOr<std::unique_ptr<query::SubgraphCursor>> OpenSubgraph(
      const v1::GetSubgraphRequest& request) override {
    return core_->OpenSubgraph(request);
  }
  absl::Status GetSubgraph(
      const query::CallContext& call, const v1::GetSubgraphRequest& request,
      const std::function<bool(const v1::GetSubgraphResponse&)>& send) override {
    return core_->GetSubgraph(call, request, send);
  }
  absl::StatusOr<std::unique_ptr<query::WatchCursor>> OpenWatch(
      const v1::WatchMapRequest& request) override {
    return core_->OpenWatch(request);
  }
  absl::Status WatchMap(const query::CallContext& call, const v1::WatchMapRequest& request,
                        const std::function<bool(const v1::WatchMapResponse&)>& send) override {
    return core_->WatchMap(call, request, send);
  }

// Streams of maintenance.
#define DSG_PASS_STREAM_ON(Method, Kind)                                                       \
  absl::StatusOr<std::unique_ptr<query::Kind##Cursor>> Open##Kind(                             \
      const v1::Method##Request& request) override {                                           \
    return core_->Open##Kind(request);                                                         \
  }                                                                                            \
  absl::Status Method(const query::CallContext& call, const v1::Method##Request& request,      \
                      const std::function<bool(const v1::Method##Response&)>& send) override { \
    return core_->Method(call, request, send);                                                 \
  }
  DSG_PASS_STREAM_ON(Prune, Prune)
  DSG_PASS_STREAM_ON(Compact, Compact)
  DSG_PASS_STREAM_ON(Revert, Revert)
  DSG_PASS_STREAM_ON(MergeMaps, Merge)
  DSG_PASS_STREAM_ON(ReadArchive, Archive)
#undef DSG_PASS_STREAM_ON

// Passed on as they are.
#define DSG_PASS_ON(Method)                                                               \
  absl::Status Method(const query::CallContext& call, const v1::Method##Request& request, \
                      v1::Method##Response* reply) override {                             \
    return core_->Method(call, request, reply);                                           \
  }
  DSG_PASS_ON(LocateAgent)
  DSG_PASS_ON(BatchLocateAgents)
  DSG_PASS_ON(ListPresence)
  DSG_PASS_ON(GetNode)
  DSG_PASS_ON(ListNodes)
  DSG_PASS_ON(ListEdges)
  DSG_PASS_ON(ListNearestNodes)
  DSG_PASS_ON(BatchGetNodes)
  DSG_PASS_ON(GetNeighbors)
  DSG_PASS_ON(SearchNodes)
  DSG_PASS_ON(ListEncounters)
  DSG_PASS_ON(ListInteractions)
  DSG_PASS_ON(PlanPath)
  DSG_PASS_ON(PlanPaths)
  DSG_PASS_ON(CheckCollision)
  DSG_PASS_ON(PredictAgent)
  DSG_PASS_ON(DiffRevisions)
  DSG_PASS_ON(CreateMap)
  DSG_PASS_ON(ListMaps)
  DSG_PASS_ON(GetMapStats)
  DSG_PASS_ON(ListRevisions)
  DSG_PASS_ON(GetServerInfo)
  DSG_PASS_ON(Commit)
  DSG_PASS_ON(GetSession)
  DSG_PASS_ON(SetTag)
  DSG_PASS_ON(RemoveTag)
  DSG_PASS_ON(ListTags)
#undef DSG_PASS_ON

 private:
  std::unique_ptr<query::ServiceCore> core_;
};

}  // namespace dsg::server
