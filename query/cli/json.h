// SPDX-License-Identifier: Apache-2.0
// Replies for machines: protobuf JSON with the field names of the .proto files.
#pragma once

#include <ostream>

#include "absl/status/status.h"

namespace google::protobuf {
class Message;
}  // namespace google::protobuf

namespace dsg::cli {

/// One JSON object and a line end. Zeros and empty strings are written too, so that scripts may
/// count on every field that is not a message; 64-bit integers are strings, as protobuf has it.
absl::Status WriteJson(const google::protobuf::Message& reply, std::ostream& out);

/// The same on one line, for answers that come one after the other.
absl::Status WriteJsonLine(const google::protobuf::Message& reply, std::ostream& out);

}  // namespace dsg::cli
