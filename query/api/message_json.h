// SPDX-License-Identifier: Apache-2.0
// The messages of the services as JSON, in the one form that `dsg --json` prints and the HTTP port
// sends: protobuf JSON with the field names of the .proto files. Fields with zeros and empty
// strings are written too, so every field that is not a message is there; 64-bit integers are
// strings.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace google::protobuf {
class Descriptor;
class Message;
}  // namespace google::protobuf

namespace dsg::query {

enum class JsonLayout {
  /// Over several lines, with a newline at the end.
  kIndented,
  /// On one line, with a newline at the end.
  kOneLine,
};

/// The same message gives the same text, also if it came over the wire.
///
/// Errors: INTERNAL if it cannot be written, such as text that is not UTF-8;
/// RESOURCE_EXHAUSTED/LIMIT_EXCEEDED above `bytes_max`.
absl::StatusOr<std::string> JsonOfMessage(const google::protobuf::Message& message,
                                          JsonLayout layout, size_t bytes_max = std::string::npos);

/// The binary form of the message of that type which `json` describes. Field names may also be in
/// lowerCamelCase, as protobuf JSON has them by itself.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for what is no such message, and for unknown fields.
absl::StatusOr<std::string> BytesOfJson(std::string_view json,
                                        const google::protobuf::Descriptor& type);

}  // namespace dsg::query
