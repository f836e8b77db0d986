// SPDX-License-Identifier: Apache-2.0
// The Connect protocol (connectrpc.com/docs/protocol): types of bodies, errors as JSON, envelopes
// of streams, timeouts. Text to text; knows neither sockets nor calls.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::server {

/// How the body of a call is written.
struct ConnectType {
  /// In envelopes, as streams are.
  bool is_stream = false;
  /// As JSON, otherwise in protobuf's binary form.
  bool is_json = false;
};

/// Reads a Content-Type; no value for any but the four of Connect, to the letter.
std::optional<ConnectType> ReadConnectType(std::string_view content_type);
std::string_view NameOf(const ConnectType& type);

/// The time that a caller gives its call: the value of Connect-Timeout-Ms.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID unless it has one to ten digits.
absl::StatusOr<std::chrono::milliseconds> ReadTimeout(std::string_view text);

/// The status that answers an error, by Connect's table.
int HttpStatusOf(absl::StatusCode code);

/// An error as the body of an answer: its code, its message, and the details of its ErrorStatus.
std::string ErrorJson(const absl::Status& error);

/// Bytes of an envelope before its message.
inline constexpr size_t kEnvelopeBytes = 5;

/// The envelope of a message of a stream, without the message.
std::string EnvelopeOf(size_t message_bytes);

/// The last envelope of a stream, with its message: how the stream ended.
std::string EndOfStream(const absl::Status& status);

/// The message of a request of a stream.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID unless `body` is one envelope that is not compressed.
absl::StatusOr<std::string_view> OpenEnvelope(std::string_view body);

}  // namespace dsg::server
