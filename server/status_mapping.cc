// SPDX-License-Identifier: Apache-2.0
#include "server/status_mapping.h"

#include <algorithm>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_replace.h"
#include "dsg/v1/errors.pb.h"
#include "google/protobuf/util/time_util.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg::server {
namespace {

// Bytes of the UTF-8 character at `at`, 0 if there is none.
size_t CharacterLength(std::string_view text, size_t at) {
  for (size_t length = 1; length <= std::min<size_t>(4, text.size() - at); ++length) {
    if (IsUtf8(text.substr(at, length))) return length;
  }
  return 0;
}

// A value of the metadata is cut to the first, and pairs beyond the second are left out: each pair
// is sent three times.
constexpr size_t kValueBytesMax = kMessageBytesMax / 2;
constexpr size_t kMetadataBytesMax = 768;

ErrorMetadata MetadataThatFits(const absl::Status& status) {
  ErrorMetadata kept;
  size_t left = kMetadataBytesMax;
  for (const auto& [key, value] : MetadataOf(status)) {
    std::string cut = CutText(value, kValueBytesMax);
    if (key.size() + cut.size() > left) continue;
    left -= key.size() + cut.size();
    kept.emplace(key, std::move(cut));
  }
  return kept;
}

// Empty if there is none.
std::string ValueOf(const ErrorMetadata& metadata, const std::string& key) {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : found->second;
}

v1::ErrorDetail MakeDetail(Reason reason, const ErrorMetadata& metadata) {
  v1::ErrorDetail detail;
  detail.set_reason(static_cast<v1::Reason>(reason));
  detail.set_domain("dsg");
  detail.mutable_metadata()->insert(metadata.begin(), metadata.end());
  return detail;
}

}  // namespace

std::string CutText(std::string_view text, size_t bytes_max) {
  std::string out;
  for (size_t at = 0; at < text.size();) {
    const size_t length = CharacterLength(text, at);
    const std::string_view piece = length == 0 ? std::string_view("?") : text.substr(at, length);
    if (out.size() + piece.size() > bytes_max) break;
    out += piece;
    at += length == 0 ? 1 : length;
  }
  return out;
}

absl::Status HideFolder(const absl::Status& status, std::string_view folder) {
  if (status.ok() || folder.size() < 2) return status;
  const std::string path(folder);
  const auto hide = [&](absl::string_view text) {
    return absl::StrReplaceAll(
        text, {{"store " + path, "the store"}, {path + "/", std::string()}, {path, "the store"}});
  };
  const Reason reason = ReasonOf(status);
  const std::string message = hide(status.message());
  if (reason == Reason::kUnspecified) return absl::Status(status.code(), message);
  ErrorMetadata metadata = MetadataOf(status);
  for (auto& [key, value] : metadata) value = hide(value);
  return MakeError(reason, message, std::move(metadata));
}

google::rpc::Status ErrorStatus(const absl::Status& status) {
  const std::string_view message(status.message().data(), status.message().size());
  google::rpc::Status told;
  told.set_code(static_cast<int>(status.code()));
  told.set_message(CutText(message, kMessageBytesMax));
  const Reason reason = ReasonOf(status);
  if (reason == Reason::kUnspecified) return told;
  const ErrorMetadata metadata = MetadataThatFits(status);
  told.add_details()->PackFrom(MakeDetail(reason, metadata));
  google::rpc::ErrorInfo info;
  info.set_reason(v1::Reason_Name(static_cast<v1::Reason>(reason)));
  info.set_domain("dsgdb");
  info.mutable_metadata()->insert(metadata.begin(), metadata.end());
  told.add_details()->PackFrom(info);
  int64_t retry_ms = 0;
  if (absl::SimpleAtoi(ValueOf(metadata, "retry_after_ms"), &retry_ms) && retry_ms > 0) {
    google::rpc::RetryInfo retry;
    *retry.mutable_retry_delay() =
        google::protobuf::util::TimeUtil::MillisecondsToDuration(retry_ms);
    told.add_details()->PackFrom(retry);
  }
  const std::string field = ValueOf(metadata, "field");
  if (status.code() == absl::StatusCode::kInvalidArgument && !field.empty()) {
    google::rpc::BadRequest bad;
    auto* const violation = bad.add_field_violations();
    violation->set_field(field);
    violation->set_description(CutText(message, kValueBytesMax));
    told.add_details()->PackFrom(bad);
  }
  return told;
}

grpc::Status ToGrpc(const google::rpc::Status& error) {
  return grpc::Status(static_cast<grpc::StatusCode>(error.code()), error.message(),
                      error.details().empty() ? "" : error.SerializeAsString());
}

std::string OwnDetail(const google::rpc::Status& error) {
  return error.details().empty() ? "" : error.details(0).value();
}

}  // namespace dsg::server
