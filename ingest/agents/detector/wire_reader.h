// SPDX-License-Identifier: Apache-2.0
// Walks messages in the wire format of protocol buffers without knowing their types.
// Refuses broken ones; never reads beyond the bytes it was given.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "absl/status/status.h"
#include "schema/base/status.h"

namespace dsg::ingest {

struct WireField {
  uint64_t number = 0;
  /// A string, message or packed list; else a number, in `value` when it is a varint.
  bool is_bytes = false;
  uint64_t value = 0;
  /// Also of numbers of four and eight bytes.
  std::string_view bytes;
};

class WireReader {
 public:
  explicit WireReader(std::string_view bytes) : rest_(bytes) {}

  bool AtEnd() const { return rest_.empty(); }
  /// Nothing when the message is broken.
  std::optional<uint64_t> Varint();
  std::optional<WireField> Next();

 private:
  std::string_view rest_;
};

/// INVALID_ARGUMENT/FILE_MALFORMED for a message that is broken.
absl::Status BrokenMessage();

/// Calls `visit`, which gives a status, for each field; stops at the first error.
template <typename Visit>
absl::Status ForEachField(std::string_view message, const Visit& visit) {
  WireReader reader(message);
  while (!reader.AtEnd()) {
    const std::optional<WireField> field = reader.Next();
    if (!field.has_value()) return BrokenMessage();
    DSG_RETURN_IF_ERROR(visit(*field));
  }
  return absl::OkStatus();
}

}  // namespace dsg::ingest
