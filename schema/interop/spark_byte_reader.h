// SPDX-License-Identifier: Apache-2.0
// Tagged values from the bytes of a Spark-DSG binary file, never past their end.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace dsg {

/// Reads little-endian values that are each preceded by a type byte (those of msgpack). Keeps the
/// first error; after it every read returns zero and consumes nothing, so callers check once, and
/// in every loop.
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

}  // namespace dsg
