// SPDX-License-Identifier: Apache-2.0
// Bytes, varints and fixed-width bit fields, the parts that the trajectory codec is made of.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace dsg {

inline uint64_t ZigZag(int64_t v) {
  return (static_cast<uint64_t>(v) << 1) ^ static_cast<uint64_t>(v >> 63);
}
inline int64_t UnZigZag(uint64_t v) {
  return static_cast<int64_t>(v >> 1) ^ -static_cast<int64_t>(v & 1);
}

/// Little-endian.
template <typename T>
void AppendFixed(T value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

void AppendVarint(uint64_t value, std::string* out);
/// Bytes that AppendVarint would add.
int VarintSize(uint64_t value);

/// Reads what was appended; every read is checked against the end, and a failed read is
/// remembered, so that a whole header can be read before asking ok().
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  T Fixed() {
    T value{};
    if (bytes_.size() - at_ < sizeof(T)) {
      ok_ = false;
      return value;
    }
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  uint64_t Varint();
  /// They live as long as what is read.
  std::string_view Bytes(uint64_t size) {
    if (remaining() < size) {
      ok_ = false;
      return {};
    }
    const std::string_view bytes = bytes_.substr(at_, size);
    at_ += size;
    return bytes;
  }
  bool ok() const { return ok_; }
  size_t position() const { return at_; }
  size_t remaining() const { return bytes_.size() - at_; }

 private:
  std::string_view bytes_;
  size_t at_ = 0;
  bool ok_ = true;
};

/// Packs fields of 0 to 64 bits, least significant bit first.
class BitWriter {
 public:
  explicit BitWriter(std::string* out) : out_(out) {}
  void Append(uint64_t value, int width);
  /// Fills up the last byte with zeros.
  void Flush();

 private:
  std::string* out_;
  uint64_t pending_ = 0;
  int pending_bits_ = 0;
};

/// The packed field number `index` of `width` bits. Requires 9 readable bytes beyond the field's
/// first byte; the codec pads its output for that.
inline uint64_t ReadBits(const char* data, size_t index, int width) {
  if (width == 0) return 0;
  const size_t bit = index * static_cast<size_t>(width);
  const char* at = data + bit / 8;
  const int shift = static_cast<int>(bit % 8);
  uint64_t low = 0;
  std::memcpy(&low, at, 8);
  low >>= shift;
  if (width + shift > 64) {
    low |= static_cast<uint64_t>(static_cast<uint8_t>(at[8])) << (64 - shift);
  }
  return width == 64 ? low : low & ((uint64_t{1} << width) - 1);
}

/// Readable bytes that must follow the last packed field.
inline constexpr size_t kBitPadding = 9;

}  // namespace dsg
