// SPDX-License-Identifier: Apache-2.0
// Reads from parsed JSON. JsonFields reads typed members and remembers the first error, so that
// callers read on and check once. The Peek functions never fail: what is not there is null, 0 or
// NaN.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "absl/status/status.h"

namespace dsg {

/// Shared by all readers of one file: its name for messages, and the first error.
struct JsonSource {
  std::string file;
  absl::Status status;
  /// Of the first error.
  std::string first_where = {};
  std::string first_what = {};

  bool ok() const { return status.ok(); }
  /// Keeps the error if it is the first.
  void Fail(const std::string& where, const std::string& what);
};

/// One object. A missing field yields its fallback, or is an error where there is none; a field of
/// the wrong type or range is always an error and yields the fallback or zero.
class JsonFields {
 public:
  /// `value` and `source` must outlive this reader; `where` is the object's path in the file.
  JsonFields(const nlohmann::json& value, std::string where, JsonSource* source);

  const std::string& where() const { return where_; }
  bool Has(const char* name) const;
  /// nullptr when absent.
  const nlohmann::json* Find(const char* name) const;

  uint64_t Unsigned(const char* name, uint64_t max,
                    std::optional<uint64_t> fallback = std::nullopt) const;
  int64_t Signed(const char* name, std::optional<int64_t> fallback = std::nullopt) const;
  /// null reads as NaN, as the format has it.
  double Number(const char* name, std::optional<double> fallback = std::nullopt) const;
  bool Bool(const char* name, std::optional<bool> fallback = std::nullopt) const;
  std::string Text(const char* name, std::optional<std::string> fallback = std::nullopt) const;
  /// [x, y, z]; null entries read as NaN.
  Eigen::Vector3d Vector(const char* name) const;
  /// {w, x, y, z}; identity when absent. Not normalised.
  Eigen::Quaterniond Quaternion(const char* name) const;
  /// The elements; an empty array when absent or null.
  const nlohmann::json& Array(const char* name) const;
  /// A nested object; an empty one when absent, which is an error if `required`.
  JsonFields Object(const char* name, bool required) const;

  /// Records that field `name` is wrong.
  void Fail(const char* name, const std::string& what) const;

 private:
  std::string PathOf(const char* name) const;

  const nlohmann::json* value_;
  std::string where_;
  JsonSource* source_;
};

/// What one array element reads as; `where` names it in errors.
double NumberOf(const nlohmann::json& value, const std::string& where, JsonSource* source);
uint64_t UnsignedOf(const nlohmann::json& value, uint64_t max, const std::string& where,
                    JsonSource* source);
Eigen::Vector3d VectorOf(const nlohmann::json& value, const std::string& where, JsonSource* source);

inline const nlohmann::json& NullJson() {
  static const nlohmann::json null;
  return null;
}

inline const nlohmann::json& Peek(const nlohmann::json& value, const char* name) {
  const auto found = value.is_object() ? value.find(name) : value.end();
  return value.is_object() && found != value.end() ? *found : NullJson();
}

inline const nlohmann::json& PeekAt(const nlohmann::json& value, size_t index) {
  return value.is_array() && index < value.size() ? value[index] : NullJson();
}

inline double PeekNumber(const nlohmann::json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

inline uint64_t PeekUnsigned(const nlohmann::json& value) {
  const bool is_natural =
      value.is_number_unsigned() || (value.is_number_integer() && value.get<int64_t>() >= 0);
  return is_natural ? value.get<uint64_t>() : 0;
}

inline int64_t PeekSigned(const nlohmann::json& value) {
  return value.is_number_integer() ? value.get<int64_t>() : 0;
}

inline bool PeekBool(const nlohmann::json& value) {
  return value.is_boolean() && value.get<bool>();
}

/// Text without blanks; bytes that are not UTF-8 are replaced.
std::string DumpJson(const nlohmann::json& value);

/// [x, y, z].
template <typename V>
nlohmann::json VectorJson(const V& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// {w, x, y, z}.
nlohmann::json QuaternionJson(const Eigen::Quaterniond& q);

}  // namespace dsg
