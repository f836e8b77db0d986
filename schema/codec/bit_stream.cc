// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/bit_stream.h"

#include <bit>

namespace dsg {

void AppendVarint(uint64_t value, std::string* out) {
  while (value >= 0x80) {
    out->push_back(static_cast<char>(value | 0x80));
    value >>= 7;
  }
  out->push_back(static_cast<char>(value));
}

int VarintSize(uint64_t value) { return (static_cast<int>(std::bit_width(value | 1)) + 6) / 7; }

uint64_t ByteReader::Varint() {
  uint64_t value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const auto byte = Fixed<uint8_t>();
    value |= static_cast<uint64_t>(byte & 0x7f) << shift;
    if (byte < 0x80) return value;
  }
  ok_ = false;
  return value;
}

void BitWriter::Append(uint64_t value, int width) {
  if (width == 0) return;
  pending_ |= value << pending_bits_;
  const int total = pending_bits_ + width;
  if (total < 64) {
    pending_bits_ = total;
    return;
  }
  AppendFixed(pending_, out_);
  // A shift by 64 would be undefined: nothing is left over when the word was empty before.
  pending_ = pending_bits_ == 0 ? 0 : value >> (64 - pending_bits_);
  pending_bits_ = total - 64;
}

void BitWriter::Flush() {
  for (; pending_bits_ > 0; pending_bits_ -= 8) {
    out_->push_back(static_cast<char>(pending_));
    pending_ >>= 8;
  }
  pending_ = 0;
  pending_bits_ = 0;
}

}  // namespace dsg
