// SPDX-License-Identifier: Apache-2.0
// Errors on their way out: absl codes become gRPC's, which are the same numbers, and the reason
// with its facts goes into a trailer. Nothing that goes out is longer than a peer must accept.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "grpcpp/support/status.h"
#include "schema/codec/status_decode.h"

namespace dsg::server {

/// Longer messages are cut here, longer values in the metadata at half of it: a peer refuses
/// trailers of more than 8 KiB altogether, and the caller sent us the long text anyway.
inline constexpr size_t kMessageBytesMax = 512;

grpc::Status ToGrpc(const absl::Status& status);

/// The same error, with paths given relative to the store's folder: remote callers know maps, and
/// where they lie is not for them to know. `folder` is absolute; empty hides nothing.
absl::Status HideFolder(const absl::Status& status, std::string_view folder);

/// The bytes for kErrorTrailer; empty when the error has no reason.
std::string EncodeErrorDetail(const absl::Status& status);

/// At most `bytes_max` bytes of `text`, never half a character; what is not UTF-8 becomes '?'.
std::string CutText(std::string_view text, size_t bytes_max);

}  // namespace dsg::server
