// SPDX-License-Identifier: Apache-2.0
// Values of Spark-DSG's binary form: little-endian, each behind a type byte of msgpack.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace dsg {

/// Never reads past the end. Keeps the first error; after it every read returns zero and consumes
/// nothing, so callers check once, and in every loop.
class SparkByteReader {
 public:
  /// `bytes` must outlive the reader.
  SparkByteReader(std::string_view bytes, std::string file);

  const absl::Status& status() const { return status_; }
  bool ok() const { return status_.ok(); }
  size_t left() const { return ok() ? bytes_.size() - offset_ : 0; }

  bool NextIsBool() const;
  bool NextIsInteger() const;
  /// An array whose first element is itself an array or text.
  bool NextIsArrayOfArrays() const;

  bool Bool(const char* field);
  /// Any integer width and sign that holds a value in range.
  uint64_t Unsigned(const char* field, uint64_t max);
  int64_t Signed(const char* field);
  /// A 32- or 64-bit float.
  double Number(const char* field);
  /// UTF-8 of at most `max` bytes.
  std::string Text(const char* field, size_t max);
  /// Consumes nil and says whether it was there.
  bool TakeNil();

  /// Count of elements, each of at least `element_bytes`, all of which the bytes left can hold.
  size_t Array(const char* field, size_t element_bytes);
  /// An array header that must say `count`.
  void Marker(const char* field, size_t count);
  /// Begins a list of unknown length.
  void ListBegin(const char* field);
  /// True at the end of that list (consumed) and after an error.
  bool ListEnd();

  /// Three bare numbers.
  Eigen::Vector3d Vector(const char* field);
  /// Array of w, x, y, z. Not normalised.
  Eigen::Quaterniond Quaternion(const char* field);
  /// Rows, columns and `out`'s count of values, row by row.
  void Matrix(const char* field, double* out, size_t rows, size_t columns);

  /// Makes `what` the error of this reader, at the present offset, if it is the first.
  void Fail(const char* field, const std::string& what);

 private:
  uint8_t Peek(size_t ahead = 0) const;
  uint8_t TakeTag(const char* field);
  uint64_t TakeWord(const char* field, size_t width);
  uint32_t TakeCount(const char* field);

  std::string_view bytes_;
  std::string file_;
  size_t offset_ = 0;
  absl::Status status_;
};

/// The inverse. Callers write only what the format has.
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
