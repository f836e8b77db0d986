// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_record.h"

namespace dsg::ingest {

uint64_t LittleEndian(std::string_view bytes, size_t at, size_t size) {
  uint64_t value = 0;
  for (size_t i = size; i > 0; --i) value = value << 8 | static_cast<uint8_t>(bytes[at + i - 1]);
  return value;
}

TimeNs BagTime(std::string_view bytes, size_t at) {
  return static_cast<TimeNs>(LittleEndian(bytes, at, 4)) * kNsPerSecond +
         static_cast<TimeNs>(LittleEndian(bytes, at + 4, 4));
}

std::optional<BagFields> BagFields::Parse(std::string_view header) {
  BagFields result;
  while (!header.empty()) {
    if (header.size() < 4) return std::nullopt;
    const uint64_t size = LittleEndian(header, 0, 4);
    header.remove_prefix(4);
    if (size > header.size()) return std::nullopt;
    const std::string_view field = header.substr(0, size);
    const size_t equals = field.find('=');
    if (equals == std::string_view::npos || equals == 0) return std::nullopt;
    result.fields_[field.substr(0, equals)] = field.substr(equals + 1);
    header.remove_prefix(size);
  }
  return result;
}

bool BagFields::Is(BagOp op) const { return Integer("op", 1) == static_cast<uint64_t>(op); }

std::optional<std::string_view> BagFields::Text(std::string_view name) const {
  const auto found = fields_.find(name);
  if (found == fields_.end()) return std::nullopt;
  return found->second;
}

std::optional<uint64_t> BagFields::Integer(std::string_view name, size_t size) const {
  const auto found = fields_.find(name);
  if (found == fields_.end() || found->second.size() != size) return std::nullopt;
  return LittleEndian(found->second, 0, size);
}

}  // namespace dsg::ingest
