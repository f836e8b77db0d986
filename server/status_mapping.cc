// SPDX-License-Identifier: Apache-2.0
#include "server/status_mapping.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "dsg/v1/errors.pb.h"
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

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const std::string_view message(status.message().data(), status.message().size());
  return grpc::Status(static_cast<grpc::StatusCode>(status.code()),
                      CutText(message, kMessageBytesMax));
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

std::string EncodeErrorDetail(const absl::Status& status) {
  const Reason reason = ReasonOf(status);
  if (reason == Reason::kUnspecified) return "";
  v1::ErrorDetail detail;
  detail.set_reason(static_cast<v1::Reason>(reason));
  detail.set_domain("dsg");
  for (const auto& [key, value] : MetadataOf(status)) {
    (*detail.mutable_metadata())[key] = CutText(value, kMessageBytesMax / 2);
  }
  return detail.SerializeAsString();
}

}  // namespace dsg::server
