// SPDX-License-Identifier: Apache-2.0
#include "server/grpc_services.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "google/rpc/status.pb.h"
#include "grpcpp/ext/proto_server_reflection_plugin.h"
#include "grpcpp/generic/async_generic_service.h"
#include "grpcpp/health_check_service_interface.h"
#include "grpcpp/impl/rpc_service_method.h"
#include "grpcpp/impl/server_builder_option.h"
#include "grpcpp/impl/service_type.h"
#include "server/call_runtime.h"
#include "server/grpc_call.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

// Reflection of gRPC 1.51 keeps a thread for each of its streams. The first thread waits for them.
constexpr int kReflectionThreadMax = 4;

class UnknownMethod final : public grpc::ServerGenericBidiReactor {
 public:
  explicit UnknownMethod(const std::string& path) {
    Finish(ToGrpc(ErrorStatus(UnknownMethodError(path))));
  }
  void OnDone() override { delete this; }
};

// Decides alone what answers beside our services: libraries of gRPC that are linked add themselves
// to every server of the process.
class Plugins final : public grpc::ServerBuilderOption {
 public:
  explicit Plugins(bool with_reflection) : with_reflection_(with_reflection) {}

  void UpdateArguments(grpc::ChannelArguments*) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    plugins->clear();
    if (!with_reflection_) return;
    plugins->push_back(std::make_unique<grpc::reflection::ProtoServerReflectionPlugin>());
  }

 private:
  const bool with_reflection_;
};

// "dsg.v1.MapService" of "/dsg.v1.MapService/ListMaps".
std::string ServiceOf(const std::string& path) { return path.substr(1, path.rfind('/') - 1); }

}  // namespace

// The methods of one service. gRPC hands over bytes instead of messages, so that a request is
// charged for before it is parsed, and calls of every kind are streams of both sides to it, so that
// it reads nothing before the call wants it.
class GrpcServices::NamedService final : public grpc::Service {
 public:
  // `path` must live as long as the service.
  void Add(const std::string& path, const Method* method) {
    AddMethod(new grpc::internal::RpcServiceMethod(
        path.c_str(), grpc::internal::RpcMethod::BIDI_STREAMING, nullptr));
    MarkMethodRawCallback(
        method_count_++,
        new grpc::internal::CallbackBidiHandler<grpc::ByteBuffer, grpc::ByteBuffer>(
            [method](grpc::CallbackServerContext* context) {
              return new GrpcCall(method, context);
            }));
  }

 private:
  int method_count_ = 0;
};

// Every other path.
class GrpcServices::UnknownMethods final : public grpc::CallbackGenericService {
 public:
  grpc::ServerGenericBidiReactor* CreateReactor(
      grpc::GenericCallbackServerContext* context) override {
    return new UnknownMethod(context->method());
  }
};

GrpcServices::GrpcServices(const MethodTable* methods)
    : unknown_(std::make_unique<UnknownMethods>()) {
  for (const auto& [path, method] : methods->methods()) {
    std::string name = ServiceOf(path);
    if (names_.empty() || names_.back() != name) {
      names_.push_back(std::move(name));
      services_.push_back(std::make_unique<NamedService>());
    }
    services_.back()->Add(path, method.get());
  }
}

GrpcServices::~GrpcServices() = default;

void GrpcServices::AddTo(grpc::ServerBuilder* builder, bool with_reflection) {
  grpc::EnableDefaultHealthCheckService(true);
  builder->SetOption(std::make_unique<Plugins>(with_reflection));
  builder->SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder->SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 1);
  builder->SetResourceQuota(grpc::ResourceQuota().SetMaxThreads(kReflectionThreadMax));
  for (const auto& service : services_) builder->RegisterService(service.get());
  builder->RegisterCallbackGenericService(unknown_.get());
}

void GrpcServices::ReportServing(grpc::Server* server) const {
  for (const std::string& name : names_) {
    server->GetHealthCheckService()->SetServingStatus(name, true);
  }
}

}  // namespace dsg::server
