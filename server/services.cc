// SPDX-License-Identifier: Apache-2.0
#include "server/services.h"

#include <functional>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/check.h"
#include "server/stream_call.h"
#include "server/unary_call_internal.h"

namespace dsg::server {
namespace {

using Context = grpc::GenericCallbackServerContext;
using query::Api;
using query::ServiceCore;

class UnknownMethod final : public grpc::ServerGenericBidiReactor {
 public:
  explicit UnknownMethod(const std::string& path) {
    Finish(grpc::Status(grpc::StatusCode::UNIMPLEMENTED,
                        absl::StrCat("no method ", path, "; see proto/dsg/v1")));
  }
  void OnDone() override { delete this; }
};

class Services final : public grpc::CallbackGenericService {
 public:
  Services(CallRuntime* questions, CallRuntime* commits) {
    AddQueries(questions);
    AddMaps(questions);
    AddIngest(commits);
    // Beside the commits, as it writes too and may wait for them.
    AddMaintenance(commits);
  }

  grpc::ServerGenericBidiReactor* CreateReactor(Context* context) override {
    const auto found = methods_.find(context->method());
    if (found == methods_.end()) return new UnknownMethod(context->method());
    return found->second.begin(context);
  }

 private:
  struct Entry {
    std::unique_ptr<Method> method;
    std::function<grpc::ServerGenericBidiReactor*(Context*)> begin;
  };
  // Where the methods of one service go.
  struct Service {
    std::string name;
    CallRuntime* runtime = nullptr;
  };

  // `begin` gets the method, whose address stays.
  template <typename Begin>
  void Add(const Service& service, std::unique_ptr<Method> method, const Begin& begin) {
    const Method* const kept = method.get();
    std::string path = absl::StrCat("/dsg.v1.", service.name, "/", method->name);
    Entry entry{std::move(method),
                [begin, kept](Context* context) { return begin(kept, context); }};
    const bool is_new = methods_.emplace(std::move(path), std::move(entry)).second;
    DSG_CHECK(is_new);
  }

  template <typename Request, typename Reply>
  void AddUnary(const Service& service, const std::string& name,
                absl::Status (Api::*ask)(const query::CallContext&, const Request&, Reply*)) {
    CallRuntime* const runtime = service.runtime;
    auto method = std::make_unique<Method>(name, Request::descriptor());
    // Commits have workers of their own, one each, and keep nobody waiting while they wait.
    method->may_wait = std::is_same_v<Request, v1::CommitRequest>;
    Add(service, std::move(method), [=](const Method* kept, Context* context) {
      return new UnaryCall<Request, Reply>(runtime, kept, ask, context);
    });
  }

  template <typename Request, typename Reply>
  void AddStream(const Service& service, const std::string& name, StreamKind kind,
                 absl::StatusOr<std::unique_ptr<query::StreamCursor<Reply>>> (ServiceCore::*open)(
                     const Request&)) {
    CallRuntime* const runtime = service.runtime;
    Add(service, std::make_unique<Method>(name, Request::descriptor()),
        [=](const Method* kept, Context* context) {
          return new StreamCall<Request, Reply>(runtime, kept, kind, open, context);
        });
  }

  void AddQueries(CallRuntime* runtime);
  void AddMaps(CallRuntime* runtime);
  void AddIngest(CallRuntime* runtime);
  void AddMaintenance(CallRuntime* runtime);

  // By path: "/dsg.v1.MapService/ListMaps".
  std::unordered_map<std::string, Entry> methods_;
};

void Services::AddQueries(CallRuntime* runtime) {
  const Service service{"QueryService", runtime};
  AddUnary(service, "LocateAgent", &Api::LocateAgent);
  AddUnary(service, "BatchLocateAgents", &Api::BatchLocateAgents);
  AddStream(service, "GetTrajectory", StreamKind::kAnswer, &ServiceCore::OpenTrajectory);
  AddUnary(service, "ListPresence", &Api::ListPresence);
  AddUnary(service, "GetNode", &Api::GetNode);
  AddUnary(service, "ListNodes", &Api::ListNodes);
  AddUnary(service, "ListEdges", &Api::ListEdges);
  AddUnary(service, "ListNearestNodes", &Api::ListNearestNodes);
  AddStream(service, "GetMesh", StreamKind::kAnswer, &ServiceCore::OpenMesh);
  AddStream(service, "GetAgentShape", StreamKind::kAnswer, &ServiceCore::OpenAgentShape);
  AddUnary(service, "BatchGetNodes", &Api::BatchGetNodes);
  AddUnary(service, "GetNeighbors", &Api::GetNeighbors);
  AddStream(service, "GetSubgraph", StreamKind::kAnswer, &ServiceCore::OpenSubgraph);
  AddUnary(service, "SearchNodes", &Api::SearchNodes);
  AddUnary(service, "ListEncounters", &Api::ListEncounters);
  AddUnary(service, "ListInteractions", &Api::ListInteractions);
  AddUnary(service, "PlanPath", &Api::PlanPath);
  AddUnary(service, "PlanPaths", &Api::PlanPaths);
  AddUnary(service, "CheckCollision", &Api::CheckCollision);
  AddUnary(service, "PredictAgent", &Api::PredictAgent);
}

void Services::AddMaps(CallRuntime* runtime) {
  const Service service{"MapService", runtime};
  AddUnary(service, "CreateMap", &Api::CreateMap);
  AddUnary(service, "ListMaps", &Api::ListMaps);
  AddUnary(service, "GetMapStats", &Api::GetMapStats);
  AddUnary(service, "ListRevisions", &Api::ListRevisions);
  AddUnary(service, "DiffRevisions", &Api::DiffRevisions);
  AddStream(service, "WatchMap", StreamKind::kWatch, &ServiceCore::OpenWatch);
  AddUnary(service, "GetServerInfo", &Api::GetServerInfo);
}

void Services::AddIngest(CallRuntime* runtime) {
  const Service service{"IngestService", runtime};
  AddUnary(service, "Commit", &Api::Commit);
  AddUnary(service, "GetSession", &Api::GetSession);
}

void Services::AddMaintenance(CallRuntime* runtime) {
  const Service service{"MaintenanceService", runtime};
  AddStream(service, "Prune", StreamKind::kWork, &ServiceCore::OpenPrune);
  AddStream(service, "Compact", StreamKind::kWork, &ServiceCore::OpenCompact);
  AddStream(service, "Revert", StreamKind::kWork, &ServiceCore::OpenRevert);
  AddStream(service, "MergeMaps", StreamKind::kWork, &ServiceCore::OpenMerge);
  AddStream(service, "ReadArchive", StreamKind::kWork, &ServiceCore::OpenArchive);
  AddUnary(service, "SetTag", &Api::SetTag);
  AddUnary(service, "RemoveTag", &Api::RemoveTag);
  AddUnary(service, "ListTags", &Api::ListTags);
}

}  // namespace

std::unique_ptr<grpc::CallbackGenericService> MakeServices(CallRuntime* questions,
                                                           CallRuntime* commits) {
  return std::make_unique<Services>(questions, commits);
}

}  // namespace dsg::server
