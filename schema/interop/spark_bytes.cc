// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_bytes.h"

#include <bit>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/utf8.h"
#include "schema/interop/file_errors.h"

namespace dsg {
namespace {

// The type bytes of msgpack that the format uses; the two list marks are its own.
constexpr uint8_t kListBegin = 0x00;
constexpr uint8_t kListEnd = 0x01;
constexpr uint8_t kNil = 0xc0;
constexpr uint8_t kNeverUsed = 0xc1;
constexpr uint8_t kFalse = 0xc2;
constexpr uint8_t kTrue = 0xc3;
constexpr uint8_t kFloat32 = 0xca;
constexpr uint8_t kFloat64 = 0xcb;
constexpr uint8_t kUint8 = 0xcc;
constexpr uint8_t kUint64 = 0xcf;
constexpr uint8_t kInt8 = 0xd0;
constexpr uint8_t kInt64 = 0xd3;
constexpr uint8_t kText32 = 0xdb;
constexpr uint8_t kArray32 = 0xdd;

bool IsUnsignedTag(uint8_t tag) { return tag >= kUint8 && tag <= kUint64; }
bool IsSignedTag(uint8_t tag) { return tag >= kInt8 && tag <= kInt64; }
bool IsArrayTag(uint8_t tag) { return tag == kArray32 || tag == kText32; }

size_t WidthOf(uint8_t tag) {
  if (IsUnsignedTag(tag)) return size_t{1} << (tag - kUint8);
  if (IsSignedTag(tag)) return size_t{1} << (tag - kInt8);
  return tag == kFloat32 ? 4 : tag == kFloat64 ? 8 : 0;
}

int64_t SignExtend(uint64_t word, size_t width) {
  const int shift = static_cast<int>(64 - 8 * width);
  return static_cast<int64_t>(word << shift) >> shift;
}

}  // namespace

SparkByteReader::SparkByteReader(std::string_view bytes, std::string file)
    : bytes_(bytes), file_(std::move(file)) {}

void SparkByteReader::Fail(const char* field, const std::string& what) {
  if (!ok()) return;
  status_ = FileError(file_, absl::StrCat("byte ", offset_), absl::StrCat(field, " ", what));
}

uint8_t SparkByteReader::Peek(size_t ahead) const {
  return left() > ahead ? static_cast<uint8_t>(bytes_[offset_ + ahead]) : kNeverUsed;
}

bool SparkByteReader::NextIsBool() const { return Peek() == kTrue || Peek() == kFalse; }

bool SparkByteReader::NextIsInteger() const { return IsUnsignedTag(Peek()) || IsSignedTag(Peek()); }

bool SparkByteReader::NextIsArrayOfArrays() const {
  return IsArrayTag(Peek()) && IsArrayTag(Peek(5));
}

uint8_t SparkByteReader::TakeTag(const char* field) {
  if (left() == 0) Fail(field, "is missing: the file ends here, it is cut");
  if (!ok()) return kNeverUsed;
  return static_cast<uint8_t>(bytes_[offset_++]);
}

uint64_t SparkByteReader::TakeWord(const char* field, size_t width) {
  if (left() < width) Fail(field, absl::StrCat("needs ", width, " bytes; ", left(), " are left"));
  if (!ok()) return 0;
  uint64_t word = 0;
  for (size_t i = 0; i < width; ++i) {
    word |= static_cast<uint64_t>(static_cast<uint8_t>(bytes_[offset_ + i])) << (8 * i);
  }
  offset_ += width;
  return word;
}

bool SparkByteReader::Bool(const char* field) {
  const uint8_t tag = TakeTag(field);
  if (tag != kTrue && tag != kFalse) {
    Fail(field, absl::StrFormat("should be a bool and has type byte 0x%02x", tag));
  }
  return tag == kTrue;
}

uint64_t SparkByteReader::Unsigned(const char* field, uint64_t max) {
  const uint8_t tag = TakeTag(field);
  if (!IsUnsignedTag(tag) && !IsSignedTag(tag)) {
    Fail(field, absl::StrFormat("should be an integer and has type byte 0x%02x", tag));
    return 0;
  }
  const uint64_t word = TakeWord(field, WidthOf(tag));
  const bool is_negative = IsSignedTag(tag) && SignExtend(word, WidthOf(tag)) < 0;
  if (is_negative || word > max) Fail(field, absl::StrCat("is not from 0 to ", max));
  return ok() ? word : 0;
}

int64_t SparkByteReader::Signed(const char* field) {
  const uint8_t tag = TakeTag(field);
  if (!IsUnsignedTag(tag) && !IsSignedTag(tag)) {
    Fail(field, absl::StrFormat("should be an integer and has type byte 0x%02x", tag));
    return 0;
  }
  const uint64_t word = TakeWord(field, WidthOf(tag));
  if (IsSignedTag(tag)) return SignExtend(word, WidthOf(tag));
  if (word > static_cast<uint64_t>(INT64_MAX)) {
    Fail(field, "does not fit in 64 signed bits");
    return 0;
  }
  return static_cast<int64_t>(word);
}

double SparkByteReader::Number(const char* field) {
  const uint8_t tag = TakeTag(field);
  if (tag == kFloat32) {
    return std::bit_cast<float>(static_cast<uint32_t>(TakeWord(field, 4)));
  }
  if (tag == kFloat64) return std::bit_cast<double>(TakeWord(field, 8));
  Fail(field, absl::StrFormat("should be a float and has type byte 0x%02x", tag));
  return 0.0;
}

uint32_t SparkByteReader::TakeCount(const char* field) {
  const uint8_t tag = TakeTag(field);
  if (!IsArrayTag(tag)) {
    Fail(field, absl::StrFormat("should be an array or text and has type byte 0x%02x", tag));
  }
  return static_cast<uint32_t>(TakeWord(field, 4));
}

std::string SparkByteReader::Text(const char* field, size_t max) {
  const uint32_t size = TakeCount(field);
  if (size > left()) Fail(field, absl::StrCat("claims ", size, " bytes; ", left(), " are left"));
  if (size > max) Fail(field, absl::StrCat("has ", size, " bytes; at most ", max, " are read"));
  if (!ok()) return "";
  const std::string_view text = bytes_.substr(offset_, size);
  if (!IsUtf8(text)) Fail(field, "is not UTF-8");
  if (!ok()) return "";
  offset_ += size;
  return std::string(text);
}

bool SparkByteReader::TakeNil() {
  if (Peek() != kNil) return false;
  ++offset_;
  return true;
}

size_t SparkByteReader::Array(const char* field, size_t element_bytes) {
  const size_t count = TakeCount(field);
  if (count > left() / element_bytes) {
    Fail(field,
         absl::StrCat("claims ", count, " elements; the ", left(), " bytes left cannot hold them"));
  }
  return ok() ? count : 0;
}

void SparkByteReader::Marker(const char* field, size_t count) {
  const size_t actual = TakeCount(field);
  if (actual != count) {
    Fail(field, absl::StrCat("should be an array of ", count, " and claims ", actual));
  }
}

void SparkByteReader::ListBegin(const char* field) {
  const uint8_t tag = TakeTag(field);
  if (tag != kListBegin) {
    Fail(field, absl::StrFormat("should begin a list and has type byte 0x%02x", tag));
  }
}

bool SparkByteReader::ListEnd() {
  if (!ok()) return true;
  if (Peek() != kListEnd) return false;
  ++offset_;
  return true;
}

Eigen::Vector3d SparkByteReader::Vector(const char* field) {
  const double x = Number(field);
  const double y = Number(field);
  const double z = Number(field);
  return {x, y, z};
}

Eigen::Quaterniond SparkByteReader::Quaternion(const char* field) {
  Marker(field, 4);
  const double w = Number(field);
  const double x = Number(field);
  const double y = Number(field);
  const double z = Number(field);
  return {w, x, y, z};
}

void SparkByteReader::Matrix(const char* field, double* out, size_t rows, size_t columns) {
  Marker(field, rows * columns + 2);
  if (Unsigned(field, UINT64_MAX) != rows || Unsigned(field, UINT64_MAX) != columns) {
    Fail(field, absl::StrCat("should be a matrix of ", rows, " x ", columns));
  }
  for (size_t i = 0; i < rows * columns; ++i) out[i] = Number(field);
}

}  // namespace dsg
