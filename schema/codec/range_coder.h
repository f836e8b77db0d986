// SPDX-License-Identifier: Apache-2.0
// An adaptive binary range coder: bits that are easy to foretell take a fraction of a bit.
// The coder that uses it gives the bits their meaning.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace dsg {

/// How likely a bit is, learnt from the bits of its kind so far.
class BitModel {
 public:
  /// Of a one, in 1/65536; never 0.
  uint32_t probability() const { return probability_; }

  void Learn(bool bit) {
    // Quick at first, since a body of few numbers has no time to lose; slow later.
    const int32_t target = bit ? 65535 - kFloor : kFloor;
    const auto step = (target - static_cast<int32_t>(probability_)) / (seen_count_ + 2);
    probability_ = static_cast<uint16_t>(probability_ + step);
    if (seen_count_ < kSeenCountMax) ++seen_count_;
  }

 private:
  static constexpr int32_t kFloor = 32;
  static constexpr uint8_t kSeenCountMax = 60;

  uint16_t probability_ = 32768;
  uint8_t seen_count_ = 0;
};

/// Appends to a string that must outlive it.
class RangeEncoder {
 public:
  explicit RangeEncoder(std::string* out) : out_(out) {}

  void Encode(bool bit, BitModel* model);
  /// The low `width` bits (0 to 64), each taken for a coin toss.
  void EncodeRaw(uint64_t value, int width);
  /// Requires: once, at the end.
  void Finish();

 private:
  void Narrow(bool bit, uint32_t probability);

  std::string* out_;
  uint32_t low_ = 0;
  uint32_t high_ = 0xffffffff;
};

/// Reads what an encoder wrote. Bytes of any other origin give bits of no meaning, never a crash.
class RangeDecoder {
 public:
  explicit RangeDecoder(std::string_view bytes);

  bool Decode(BitModel* model);
  uint64_t DecodeRaw(int width);
  /// False once more was read than any encoder wrote.
  bool ok() const { return at_ <= bytes_.size() + kOverrunMax; }
  /// Whether the bytes end where an encoder that wrote what was read has ended them.
  bool IsAtEnd() const { return at_ == bytes_.size() + kOverrunMax - (low_ > 0 ? 1 : 0); }

 private:
  /// The four bytes that the decoder holds, of which the encoder may have left out all.
  static constexpr size_t kOverrunMax = 4;

  bool Narrow(uint32_t probability);
  uint32_t NextByte();

  std::string_view bytes_;
  size_t at_ = 0;
  uint32_t low_ = 0;
  uint32_t high_ = 0xffffffff;
  uint32_t code_ = 0;
};

}  // namespace dsg
