// SPDX-License-Identifier: Apache-2.0
// Turns a Status into what a caller gets: the code (absl and gRPC use the same numbers), the
// message, and details with the reason and its metadata: ours, and those that all clients of gRPC
// know. All of it fits the size that a gRPC peer accepts.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace google::rpc {
class Status;
}  // namespace google::rpc
namespace grpc {
class Status;
}  // namespace grpc

namespace dsg::server {

/// Messages are cut to this size, values of the metadata to half of it and all of the metadata to
/// one and a half times as much: a peer refuses trailers of more than 8 KiB in total, and long text
/// in an error comes from the caller's own request.
inline constexpr size_t kMessageBytesMax = 512;

/// An error as tools and libraries of gRPC read it: code, message, and, if the error has a reason,
/// the details dsg.v1.ErrorDetail, google.rpc.ErrorInfo (domain "dsgdb"), RetryInfo if the metadata
/// has retry_after_ms, and BadRequest if the code is INVALID_ARGUMENT and the metadata has a field.
/// In this order: programs may expect the first one first.
google::rpc::Status ErrorStatus(const absl::Status& status);

/// Code, message, and as the binary details of gRPC the whole `error`, if it has any details.
grpc::Status ToGrpc(const google::rpc::Status& error);

/// The serialized dsg.v1.ErrorDetail of an ErrorStatus; empty when the error has no reason.
std::string OwnDetail(const google::rpc::Status& error);

/// The same error with paths relative to the store's folder: remote callers must not learn where
/// the server keeps its maps. `folder` is absolute; an empty one changes nothing.
absl::Status HideFolder(const absl::Status& status, std::string_view folder);

/// At most `bytes_max` bytes of `text`, in whole characters. Each byte that is not part of valid
/// UTF-8 becomes '?'.
std::string CutText(std::string_view text, size_t bytes_max);

}  // namespace dsg::server
