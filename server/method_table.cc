// SPDX-License-Identifier: Apache-2.0
#include "server/method_table.h"

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

// All but `make`.
template <typename Request>
Method DescribeMethod(const query::MethodInfo& info, CallRuntime* runtime) {
  Method method;
  method.info = info;
  method.request = Request::descriptor();
  method.cost = std::make_unique<const RequestCost>(Request::descriptor());
  method.maps = std::make_unique<const MapFields>(*Request::descriptor(), info.role);
  method.runtime = runtime;
  return method;
}

template <typename Call, typename Function>
void SetMake(Function function, Method* method) {
  method->make = [function](const Method* of, CallWire* wire,
                            std::shared_ptr<Connection> connection, CallerDeadline deadline) {
    return std::make_unique<Call>(of, function, wire, std::move(connection), deadline);
  };
}

template <typename Request, typename Reply>
Method MakeMethod(const query::MethodInfo& info, AskUnary<Request, Reply> ask,
                  CallRuntime* runtime) {
  Method method = DescribeMethod<Request>(info, runtime);
  SetMake<UnaryCall<Request, Reply>>(ask, &method);
  return method;
}

template <typename Request, typename Reply>
Method MakeMethod(const query::MethodInfo& info, OpenStream<Request, Reply> open,
                  CallRuntime* runtime) {
  Method method = DescribeMethod<Request>(info, runtime);
  method.is_stream = true;
  SetMake<StreamCall<Request, Reply>>(open, &method);
  return method;
}

}  // namespace

MethodTable::MethodTable(CallRuntime* questions, CallRuntime* commits) {
  query::ForEachMethod([&](const query::MethodInfo& info, auto function) {
    // Maintenance shares the workers of commits: it writes too and may wait for commits.
    auto method = std::make_unique<const Method>(
        MakeMethod(info, function, info.writes ? commits : questions));
    std::string path =
        absl::StrCat("/dsg.v1.", std::string(info.service), "/", std::string(info.name));
    const bool is_new = methods_.emplace(std::move(path), std::move(method)).second;
    DSG_CHECK(is_new);
  });
}

const Method* MethodTable::Find(const std::string& path) const {
  const auto found = methods_.find(path);
  return found == methods_.end() ? nullptr : found->second.get();
}

}  // namespace dsg::server
