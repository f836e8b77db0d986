// SPDX-License-Identifier: Apache-2.0
// The records that bags are made of: headers of named fields, little endian.
// Refuses fields that reach past their header.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "schema/base/time.h"

namespace dsg::ingest {

enum class BagOp : uint8_t {
  kMessage = 2,
  kBagHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

/// An unsigned little-endian integer of 1 to 8 bytes. Requires: at + size <= bytes.size().
uint64_t LittleEndian(std::string_view bytes, size_t at, size_t size);

/// Seconds and nanoseconds, four bytes each. Requires: at + 8 <= bytes.size().
TimeNs BagTime(std::string_view bytes, size_t at);

/// The fields of a record's header. Views into the bytes that it was parsed from.
class BagFields {
 public:
  /// nullopt when a field reaches past the end or has no name.
  static std::optional<BagFields> Parse(std::string_view header);

  bool Is(BagOp op) const;
  std::optional<std::string_view> Text(std::string_view name) const;
  /// nullopt when the field is missing or has another size.
  std::optional<uint64_t> Integer(std::string_view name, size_t size) const;

 private:
  std::map<std::string_view, std::string_view> fields_;
};

}  // namespace dsg::ingest
