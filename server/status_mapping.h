// SPDX-License-Identifier: Apache-2.0
// Turns a Status into what a caller gets: the code (absl and gRPC use the same numbers), the
// message, and a detail with the reason and its metadata. All of it fits the size that a gRPC peer
// accepts.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace grpc {
class Status;
}  // namespace grpc

namespace dsg::server {

/// Messages are cut to this size and values of the metadata to half of it: a peer refuses trailers
/// of more than 8 KiB in total, and long text in an error comes from the caller's own request.
inline constexpr size_t kMessageBytesMax = 512;

grpc::Status ToGrpc(const absl::Status& status);

/// The same error with paths relative to the store's folder: remote callers must not learn where
/// the server keeps its maps. `folder` is absolute; an empty one changes nothing.
absl::Status HideFolder(const absl::Status& status, std::string_view folder);

/// A serialized dsg.v1.ErrorDetail; empty when the error has no reason.
std::string EncodeErrorDetail(const absl::Status& status);

/// At most `bytes_max` bytes of `text`, in whole characters. Each byte that is not part of valid
/// UTF-8 becomes '?'.
std::string CutText(std::string_view text, size_t bytes_max);

}  // namespace dsg::server
