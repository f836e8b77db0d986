// SPDX-License-Identifier: Apache-2.0
#include "server/http/connect.h"

#include <google/protobuf/any.pb.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "google/rpc/status.pb.h"
#include "query/api/message_json.h"
#include "schema/base/status.h"
#include "schema/codec/status_decode.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

using nlohmann::ordered_json;

constexpr char kEndFlag = 0x02;

struct TypeName {
  ConnectType type;
  std::string_view name;
};

constexpr TypeName kTypeNames[] = {
    {{false, true}, "application/json"},
    {{false, false}, "application/proto"},
    {{true, true}, "application/connect+json"},
    {{true, false}, "application/connect+proto"},
};

struct CodeName {
  absl::StatusCode code;
  int http_status;
  const char* name;
};

constexpr CodeName kCodeNames[] = {
    {absl::StatusCode::kCancelled, 499, "canceled"},
    {absl::StatusCode::kUnknown, 500, "unknown"},
    {absl::StatusCode::kInvalidArgument, 400, "invalid_argument"},
    {absl::StatusCode::kDeadlineExceeded, 504, "deadline_exceeded"},
    {absl::StatusCode::kNotFound, 404, "not_found"},
    {absl::StatusCode::kAlreadyExists, 409, "already_exists"},
    {absl::StatusCode::kPermissionDenied, 403, "permission_denied"},
    {absl::StatusCode::kResourceExhausted, 429, "resource_exhausted"},
    {absl::StatusCode::kFailedPrecondition, 400, "failed_precondition"},
    {absl::StatusCode::kAborted, 409, "aborted"},
    {absl::StatusCode::kOutOfRange, 400, "out_of_range"},
    {absl::StatusCode::kUnimplemented, 501, "unimplemented"},
    {absl::StatusCode::kInternal, 500, "internal"},
    {absl::StatusCode::kUnavailable, 503, "unavailable"},
    {absl::StatusCode::kDataLoss, 500, "data_loss"},
    {absl::StatusCode::kUnauthenticated, 401, "unauthenticated"},
};

const CodeName& Find(absl::StatusCode code) {
  const auto* const found = std::find_if(std::begin(kCodeNames), std::end(kCodeNames),
                                         [&](const CodeName& entry) { return entry.code == code; });
  return found == std::end(kCodeNames) ? kCodeNames[1] : *found;
}

// Connect wants no padding.
std::string Base64(const std::string& bytes) {
  std::string text = absl::Base64Escape(bytes);
  while (!text.empty() && text.back() == '=') text.pop_back();
  return text;
}

std::string Dump(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

// Any detail, with its JSON if this program knows its type.
ordered_json DetailJson(const google::protobuf::Any& detail) {
  const std::string type = detail.type_url().substr(detail.type_url().rfind('/') + 1);
  ordered_json json = {{"type", type}, {"value", Base64(detail.value())}};
  const auto* const descriptor =
      google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(type);
  if (descriptor == nullptr) return json;
  const std::unique_ptr<google::protobuf::Message> told(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(descriptor)->New());
  if (!told->ParseFromString(detail.value())) return json;
  const auto text = query::JsonOfMessage(*told, query::JsonLayout::kOneLine);
  if (text.ok()) json["debug"] = ordered_json::parse(*text);
  return json;
}

ordered_json ErrorOf(const google::rpc::Status& error) {
  ordered_json json = {{"code", Find(static_cast<absl::StatusCode>(error.code())).name},
                       {"message", error.message()}};
  for (const google::protobuf::Any& detail : error.details()) {
    json["details"].push_back(DetailJson(detail));
  }
  return json;
}

std::string Envelope(char flags, size_t bytes) {
  std::string text(1, flags);
  for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(bytes >> shift & 0xff);
  return text;
}

absl::Status EnvelopeError(const std::string& what) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("the request is not one message in an envelope: ", what,
                                "; send a zero, the message's length as four bytes, the highest "
                                "first, and the message"),
                   {{"field", ""}});
}

}  // namespace

std::optional<ConnectType> ReadConnectType(std::string_view content_type) {
  for (const TypeName& entry : kTypeNames) {
    if (content_type == entry.name) return entry.type;
  }
  return std::nullopt;
}

std::string_view NameOf(const ConnectType& type) {
  return kTypeNames[(type.is_stream ? 2 : 0) + (type.is_json ? 0 : 1)].name;
}

absl::StatusOr<std::chrono::milliseconds> ReadTimeout(std::string_view text) {
  constexpr size_t kDigitsMax = 10;
  const bool is_number = !text.empty() && text.size() <= kDigitsMax &&
                         text.find_first_not_of("0123456789") == std::string_view::npos;
  if (is_number) return std::chrono::milliseconds(std::stoll(std::string(text)));
  const std::string shown = CutText(text, 32);
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("Connect-Timeout-Ms is \"", shown,
                                "\"; give a number of milliseconds of at most ten digits"),
                   {{"field", "Connect-Timeout-Ms"}, {"value", shown}});
}

int HttpStatusOf(absl::StatusCode code) { return Find(code).http_status; }

std::string ErrorJson(const absl::Status& error) { return Dump(ErrorOf(ErrorStatus(error))); }

std::string EnvelopeOf(size_t message_bytes) { return Envelope(0, message_bytes); }

std::string EndOfStream(const absl::Status& status) {
  ordered_json end = ordered_json::object();
  if (!status.ok()) {
    const google::rpc::Status error = ErrorStatus(status);
    end["error"] = ErrorOf(error);
    // What gRPC sends as the trailer of that name.
    const std::string detail = OwnDetail(error);
    if (!detail.empty()) end["metadata"] = {{kErrorTrailer, ordered_json::array({Base64(detail)})}};
  }
  const std::string text = Dump(end);
  return Envelope(kEndFlag, text.size()) + text;
}

absl::StatusOr<std::string_view> OpenEnvelope(std::string_view body) {
  if (body.size() < kEnvelopeBytes) {
    return EnvelopeError(absl::StrCat("it has ", body.size(), " bytes"));
  }
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(body[i]); };
  if (byte(0) != 0) {
    return EnvelopeError(absl::StrCat("its flags are ", static_cast<int>(byte(0)),
                                      ", and messages are neither compressed nor the last"));
  }
  size_t length = 0;
  for (size_t i = 1; i < kEnvelopeBytes; ++i) length = length << 8 | byte(i);
  if (length != body.size() - kEnvelopeBytes) {
    return EnvelopeError(absl::StrCat("it tells of ", length, " bytes, and ",
                                      body.size() - kEnvelopeBytes, " follow"));
  }
  return body.substr(kEnvelopeBytes);
}

}  // namespace dsg::server
