// SPDX-License-Identifier: Apache-2.0
// Typed reads from a JSON object that remember the first thing that was wrong.
// Callers read on and check once, so that readers of formats stay as plain as the formats.
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

}  // namespace dsg
