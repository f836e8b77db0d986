// SPDX-License-Identifier: Apache-2.0
#include "server/http/call_plan.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

constexpr size_t kBodyBytesMax = size_t{1} << 20;

// By Connect's table of statuses, unless HTTP has one of its own.
Refusal RefusalOf(const absl::Status& error, std::optional<int> http_status = std::nullopt,
                  std::string_view fields = "") {
  return {http_status.value_or(HttpStatusOf(error.code())), error, fields};
}

Refusal RefuseType(const Method& method, std::string_view content_type) {
  const std::string what(method.info.name);
  const std::string shown = CutText(content_type, 100);
  if (method.is_stream) {
    return RefusalOf(
        absl::UnimplementedError(absl::StrCat(
            "the Content-Type is \"", shown, "\", and ", what,
            " answers with a stream; send application/connect+json or application/connect+proto")),
        415, "Accept-Post: application/connect+json, application/connect+proto\r\n");
  }
  return RefusalOf(absl::UnimplementedError(
                       absl::StrCat("the Content-Type is \"", shown, "\", and ", what,
                                    " has one reply; send application/json or application/proto")),
                   415, "Accept-Post: application/json, application/proto\r\n");
}

std::optional<Refusal> CheckProtocol(const RequestHead& head) {
  const std::string_view version = head.Find("connect-protocol-version").value_or("1");
  if (version != "1") {
    return RefusalOf(absl::InvalidArgumentError(
        absl::StrCat("Connect-Protocol-Version is \"", CutText(version, 32), "\"; send 1")));
  }
  for (const char* name : {"content-encoding", "connect-content-encoding"}) {
    const std::string_view encoding = head.Find(name).value_or("identity");
    if (encoding == "identity") continue;
    return RefusalOf(absl::UnimplementedError(
        absl::StrCat("the ", name, " is \"", CutText(encoding, 32),
                     "\", and compressed requests are not taken; send it as it is")));
  }
  return std::nullopt;
}

}  // namespace

std::variant<CallPlan, Refusal> PlanCall(const MethodTable& methods, const RequestHead& head,
                                         bool may_write) {
  CallPlan plan;
  plan.method = methods.Find(std::string(head.target));
  if (plan.method == nullptr) return RefusalOf(UnknownMethodError(head.target), 404);
  const Method& method = *plan.method;
  if (!method.info.may_repeat && !may_write) {
    return RefusalOf(absl::PermissionDeniedError(
        absl::StrCat(std::string(method.info.name),
                     " changes maps, and this HTTP port only reads; call it over gRPC, or start "
                     "dsg-server with --http-write")));
  }
  const std::string_view content_type = head.Find("content-type").value_or("");
  const std::optional<ConnectType> type = ReadConnectType(content_type);
  if (!type.has_value() || type->is_stream != method.is_stream) {
    return RefuseType(method, content_type);
  }
  plan.type = *type;
  if (auto refusal = CheckProtocol(head)) return *std::move(refusal);
  if (const auto text = head.Find("connect-timeout-ms"); text.has_value()) {
    const auto timeout = ReadTimeout(*text);
    if (!timeout.ok()) return RefusalOf(timeout.status());
    plan.deadline = CallerDeadline::clock::now() + *timeout;
  }
  // Only commits wait for memory, and only they are long.
  plan.body_bytes_max = method.info.waits_for_memory
                            ? size_t{kMessageBytesMaxOnWire} + kEnvelopeBytes
                            : kBodyBytesMax;
  return plan;
}

}  // namespace dsg::server
