// SPDX-License-Identifier: Apache-2.0
// Replies for machines: protobuf JSON with the field names of the .proto files.
#pragma once

#include <ostream>
#include <string>
#include <utility>

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

/// Writes a reply that comes in parts as WriteJson would write it whole, and keeps none of them:
/// one list of it grows from part to part, all else stands in the first.
class JsonListWriter {
 public:
  /// `list` is a repeated message field of the reply. `out` must outlive this.
  JsonListWriter(std::string list, std::ostream* out) : list_(std::move(list)), out_(*out) {}

  absl::Status Add(const google::protobuf::Message& part);
  /// Writes what stands after the list; nothing if there was no part.
  void End();

 private:
  const std::string list_;
  std::ostream& out_;
  bool has_begun_ = false;
  bool has_entries_ = false;
  /// From the end of the list on.
  std::string rest_;
};

}  // namespace dsg::cli
