// SPDX-License-Identifier: Apache-2.0
// Tagged values of Spark-DSG's binary form, little-endian. Refuses nothing: callers give it what
// the format has.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

namespace dsg {

class SparkByteWriter {
 public:
  std::string& bytes() { return out_; }

  void Nil() { Byte(0xC0); }
  void Bool(bool value) { Byte(value ? 0xC3 : 0xC2); }
  void Float(float value) { Tagged(0xCA, std::bit_cast<uint32_t>(value), 4); }
  void Double(double value) { Tagged(0xCB, std::bit_cast<uint64_t>(value), 8); }
  void Unsigned8(uint8_t value) { Tagged(0xCC, value, 1); }
  void Unsigned32(uint32_t value) { Tagged(0xCE, value, 4); }
  void Unsigned64(uint64_t value) { Tagged(0xCF, value, 8); }
  void Signed32(int32_t value) { Tagged(0xD2, static_cast<uint32_t>(value), 4); }
  void Signed64(int64_t value) { Tagged(0xD3, static_cast<uint64_t>(value), 8); }
  /// Also the head of a text and of a fixed group.
  void Array(size_t count) { Tagged(0xDD, count, 4); }
  void Text(std::string_view text) {
    Array(text.size());
    out_ += text;
  }
  void ListBegin() { Byte(0x00); }
  void ListEnd() { Byte(0x01); }
  void MatrixHead(size_t rows, size_t columns) {
    Array(rows * columns + 2);
    Signed64(static_cast<int64_t>(rows));
    Signed64(static_cast<int64_t>(columns));
  }

 private:
  void Byte(uint8_t byte) { out_.push_back(static_cast<char>(byte)); }
  void Tagged(uint8_t tag, uint64_t word, int width) {
    Byte(tag);
    for (int i = 0; i < width; ++i) Byte(static_cast<uint8_t>(word >> (8 * i)));
  }

  std::string out_;
};

}  // namespace dsg
