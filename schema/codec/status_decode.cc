// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/status_decode.h"

#include <string>
#include <utility>

#include "dsg/v1/errors.pb.h"
#include "schema/base/status.h"

namespace dsg {

absl::Status DecodeStatus(int code, std::string_view message, std::string_view detail) {
  if (code == 0) return absl::OkStatus();
  // gRPC numbers its codes as absl does; anything else came from a peer that is not gRPC.
  const bool is_known_code = code > 0 && code <= 16;
  const auto status_code =
      is_known_code ? static_cast<absl::StatusCode>(code) : absl::StatusCode::kUnknown;
  // gRPC itself says no more when a server lacks a call.
  if (status_code == absl::StatusCode::kUnimplemented && message.empty()) {
    message = "the server does not know this call; it is older than this program: update it";
  }
  absl::Status plain(status_code, absl::string_view(message.data(), message.size()));

  v1::ErrorDetail parsed;
  if (detail.empty() || !parsed.ParseFromArray(detail.data(), static_cast<int>(detail.size())) ||
      parsed.domain() != "dsg" || !v1::Reason_IsValid(parsed.reason())) {
    return plain;
  }
  const auto reason = static_cast<Reason>(parsed.reason());
  if (CodeOf(reason) != status_code) return plain;
  ErrorMetadata metadata(parsed.metadata().begin(), parsed.metadata().end());
  return MakeError(reason, message, std::move(metadata));
}

}  // namespace dsg
