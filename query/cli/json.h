// SPDX-License-Identifier: Apache-2.0
// Answers for programs: replies as JSON, and reports of the files that a verb has written.
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "schema/model/revision.h"

namespace google::protobuf {
class Message;
}  // namespace google::protobuf

namespace dsg::cli {

/// One JSON object and a newline, as query/api/message_json.h writes it.
absl::Status WriteJson(const google::protobuf::Message& reply, std::ostream& out);

/// The same on one line, for streams of answers.
absl::Status WriteJsonLine(const google::protobuf::Message& reply, std::ostream& out);

/// Writes a reply that arrives in parts, with the bytes that WriteJson writes for the whole,
/// without keeping the parts: one list grows from part to part; the fields before it are those of
/// the first part, the fields behind it those of the last.
class JsonListWriter {
 public:
  /// `list` is a repeated message field of the reply. `out` must outlive this.
  JsonListWriter(std::string list, std::ostream* out) : list_(std::move(list)), out_(*out) {}

  absl::Status Add(const google::protobuf::Message& part);
  /// Writes what follows the list; nothing if there was no part.
  void End();

 private:
  const std::string list_;
  std::ostream& out_;
  bool has_begun_ = false;
  bool has_entries_ = false;
  /// What follows the list.
  std::string rest_;
};

/// A file that a verb has written. Reported at the end, since a later file may fail.
struct Written {
  std::string format;
  std::string path;
  int64_t byte_count = 0;
  /// Counts of its contents: "vertices", "faces", ...
  std::vector<std::pair<std::string, int64_t>> counts;
};

/// One line per file, or one JSON object.
void TellWritten(const std::vector<Written>& files, Revision revision, bool as_json,
                 std::ostream& out);

}  // namespace dsg::cli
