// SPDX-License-Identifier: Apache-2.0
#include "server/services.h"

#include <functional>
#include <string>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/api/api.h"
#include "schema/base/check.h"
#include "server/stream_call.h"
#include "server/unary_call_internal.h"

namespace dsg::server {
namespace {

using Context = grpc::GenericCallbackServerContext;

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
    query::ForEachMethod([&](const query::MethodInfo& info, auto ask) {
      // Maintenance runs beside the commits, as it writes too and may wait for them.
      Add(info, ask, info.writes ? commits : questions);
    });
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

  template <typename Request, typename Reply>
  void Add(const query::MethodInfo& info, AskUnary<Request, Reply> ask, CallRuntime* runtime) {
    Add(std::make_unique<Method>(info, Request::descriptor()),
        [=](const Method* method, Context* context) {
          return new UnaryCall<Request, Reply>(runtime, method, ask, context);
        });
  }

  template <typename Request, typename Reply>
  void Add(const query::MethodInfo& info, OpenStream<Request, Reply> open, CallRuntime* runtime) {
    Add(std::make_unique<Method>(info, Request::descriptor()),
        [=](const Method* method, Context* context) {
          return new StreamCall<Request, Reply>(runtime, method, open, context);
        });
  }

  // `begin` gets the method, whose address stays.
  template <typename Begin>
  void Add(std::unique_ptr<Method> method, const Begin& begin) {
    const Method* const kept = method.get();
    std::string path = absl::StrCat("/dsg.v1.", std::string(kept->info.service), "/",
                                    std::string(kept->info.name));
    Entry entry{std::move(method),
                [begin, kept](Context* context) { return begin(kept, context); }};
    const bool is_new = methods_.emplace(std::move(path), std::move(entry)).second;
    DSG_CHECK(is_new);
  }

  // By path: "/dsg.v1.MapService/ListMaps".
  std::unordered_map<std::string, Entry> methods_;
};

}  // namespace

std::unique_ptr<grpc::CallbackGenericService> MakeServices(CallRuntime* questions,
                                                           CallRuntime* commits) {
  return std::make_unique<Services>(questions, commits);
}

}  // namespace dsg::server
