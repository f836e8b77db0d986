// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/wire_reader.h"

namespace dsg::ingest {

std::optional<uint64_t> WireReader::Varint() {
  uint64_t value = 0;
  for (int shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
    const uint8_t byte = static_cast<uint8_t>(rest_.front());
    rest_.remove_prefix(1);
    value |= static_cast<uint64_t>(byte & 0x7f) << shift;
    if (byte < 0x80) return value;
  }
  return std::nullopt;
}

std::optional<WireField> WireReader::Next() {
  const std::optional<uint64_t> key = Varint();
  if (!key.has_value() || *key >> 3 == 0) return std::nullopt;
  WireField field;
  field.number = *key >> 3;
  std::optional<uint64_t> size;
  switch (*key & 7) {
    case 0: {
      const std::optional<uint64_t> value = Varint();
      if (!value.has_value()) return std::nullopt;
      field.value = *value;
      return field;
    }
    case 1:
      size = 8;
      break;
    case 2:
      size = Varint();
      break;
    case 5:
      size = 4;
      break;
    default:
      return std::nullopt;
  }
  if (!size.has_value() || *size > rest_.size()) return std::nullopt;
  field.is_bytes = (*key & 7) == 2;
  field.bytes = rest_.substr(0, *size);
  rest_.remove_prefix(*size);
  return field;
}

absl::Status BrokenMessage() {
  return MakeError(Reason::kFileMalformed,
                   "is no ONNX file, or only a part of one; was the copy cut short?");
}

}  // namespace dsg::ingest
