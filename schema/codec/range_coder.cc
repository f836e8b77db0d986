// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/range_coder.h"

namespace dsg {
namespace {

// The last number of the lower part, which stands for a one. Low < high, so both parts have at
// least one number; where low == high all bytes have been shifted out and the range is whole again.
uint32_t Split(uint32_t low, uint32_t high, uint32_t probability) {
  return low + static_cast<uint32_t>((uint64_t{high - low} * probability) >> 16);
}

bool SameTopByte(uint32_t a, uint32_t b) { return ((a ^ b) >> 24) == 0; }

}  // namespace

void RangeEncoder::Narrow(bool bit, uint32_t probability) {
  const uint32_t split = Split(low_, high_, probability);
  if (bit) {
    high_ = split;
  } else {
    low_ = split + 1;
  }
  while (SameTopByte(low_, high_)) {
    out_->push_back(static_cast<char>(high_ >> 24));
    low_ <<= 8;
    high_ = (high_ << 8) | 0xff;
  }
}

void RangeEncoder::Encode(bool bit, BitModel* model) {
  Narrow(bit, model->probability());
  model->Learn(bit);
}

void RangeEncoder::EncodeRaw(uint64_t value, int width) {
  while (width-- > 0) Narrow(((value >> width) & 1) != 0, 32768);
}

void RangeEncoder::Finish() {
  // The decoder reads zeros beyond the end: one byte that lies inside the range says enough.
  if (low_ > 0) out_->push_back(static_cast<char>((low_ >> 24) + 1));
}

RangeDecoder::RangeDecoder(std::string_view bytes) : bytes_(bytes) {
  for (int i = 0; i < 4; ++i) code_ = (code_ << 8) | NextByte();
}

uint32_t RangeDecoder::NextByte() {
  const size_t at = at_++;
  return at < bytes_.size() ? static_cast<uint8_t>(bytes_[at]) : 0;
}

bool RangeDecoder::Narrow(uint32_t probability) {
  const uint32_t split = Split(low_, high_, probability);
  const bool bit = code_ <= split;
  if (bit) {
    high_ = split;
  } else {
    low_ = split + 1;
  }
  while (SameTopByte(low_, high_)) {
    low_ <<= 8;
    high_ = (high_ << 8) | 0xff;
    code_ = (code_ << 8) | NextByte();
  }
  return bit;
}

bool RangeDecoder::Decode(BitModel* model) {
  const bool bit = Narrow(model->probability());
  model->Learn(bit);
  return bit;
}

uint64_t RangeDecoder::DecodeRaw(int width) {
  uint64_t value = 0;
  while (width-- > 0) value = (value << 1) | (Narrow(32768) ? 1 : 0);
  return value;
}

}  // namespace dsg
