// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/json_fields.h"

#include "absl/strings/str_cat.h"
#include "schema/interop/file_errors.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

const Json& EmptyArray() {
  static const Json empty = Json::array();
  return empty;
}

const Json& EmptyObject() {
  static const Json empty = Json::object();
  return empty;
}

std::string Expected(const char* expected, const Json& value) {
  return absl::StrCat("is ", value.is_number() ? "a number out of range" : value.type_name(),
                      "; expected ", expected);
}

// Where all is well no path is made, which would cost more than the value.
bool IsUnsigned(const Json& value, uint64_t max) {
  return value.is_number_unsigned() && value.get<uint64_t>() <= max;
}

bool IsPoint(const Json& value) {
  return value.is_array() && value.size() == 3 && value[0].is_number() && value[1].is_number() &&
         value[2].is_number();
}

}  // namespace

void JsonSource::Fail(const std::string& where, const std::string& what) {
  if (!status.ok()) return;
  status = FileError(file, where, what);
  first_where = where;
  first_what = what;
}

JsonFields::JsonFields(const Json& value, std::string where, JsonSource* source)
    : value_(&value), where_(std::move(where)), source_(source) {
  if (value.is_object()) return;
  source->Fail(where_.empty() ? "the file" : where_, Expected("an object", value));
  value_ = &EmptyObject();
}

std::string JsonFields::PathOf(const char* name) const {
  return where_.empty() ? name : absl::StrCat(where_, ".", name);
}

void JsonFields::Fail(const char* name, const std::string& what) const {
  source_->Fail(PathOf(name), what);
}

const Json* JsonFields::Find(const char* name) const {
  const auto found = value_->find(name);
  return found == value_->end() ? nullptr : &*found;
}

bool JsonFields::Has(const char* name) const { return Find(name) != nullptr; }

uint64_t JsonFields::Unsigned(const char* name, uint64_t max,
                              std::optional<uint64_t> fallback) const {
  const Json* value = Find(name);
  if (value != nullptr && IsUnsigned(*value, max)) return value->get<uint64_t>();
  if (value != nullptr) return UnsignedOf(*value, max, PathOf(name), source_);
  if (!fallback.has_value()) Fail(name, "is missing");
  return fallback.value_or(0);
}

int64_t JsonFields::Signed(const char* name, std::optional<int64_t> fallback) const {
  const Json* value = Find(name);
  if (value == nullptr) {
    if (!fallback.has_value()) Fail(name, "is missing");
    return fallback.value_or(0);
  }
  const bool fits =
      value->is_number_integer() && (!value->is_number_unsigned() ||
                                     value->get<uint64_t>() <= std::numeric_limits<int64_t>::max());
  if (fits) return value->get<int64_t>();
  Fail(name, Expected("a 64-bit integer", *value));
  return 0;
}

double JsonFields::Number(const char* name, std::optional<double> fallback) const {
  const Json* value = Find(name);
  if (value != nullptr && value->is_number()) return value->get<double>();
  if (value != nullptr) return NumberOf(*value, PathOf(name), source_);
  if (!fallback.has_value()) Fail(name, "is missing");
  return fallback.value_or(0.0);
}

bool JsonFields::Bool(const char* name, std::optional<bool> fallback) const {
  const Json* value = Find(name);
  if (value != nullptr && value->is_boolean()) return value->get<bool>();
  if (value != nullptr) Fail(name, Expected("true or false", *value));
  if (value == nullptr && !fallback.has_value()) Fail(name, "is missing");
  return fallback.value_or(false);
}

std::string JsonFields::Text(const char* name, std::optional<std::string> fallback) const {
  const Json* value = Find(name);
  if (value != nullptr && value->is_string()) return value->get<std::string>();
  if (value != nullptr) Fail(name, Expected("a text", *value));
  if (value == nullptr && !fallback.has_value()) Fail(name, "is missing");
  return std::move(fallback).value_or("");
}

Eigen::Vector3d JsonFields::Vector(const char* name) const {
  const Json* value = Find(name);
  if (value != nullptr && IsPoint(*value)) {
    return {(*value)[0].get<double>(), (*value)[1].get<double>(), (*value)[2].get<double>()};
  }
  if (value != nullptr) return VectorOf(*value, PathOf(name), source_);
  Fail(name, "is missing");
  return Eigen::Vector3d::Zero();
}

Eigen::Quaterniond JsonFields::Quaternion(const char* name) const {
  if (!Has(name)) return Eigen::Quaterniond::Identity();
  const JsonFields parts = Object(name, true);
  const double w = parts.Number("w");
  return {w, parts.Number("x"), parts.Number("y"), parts.Number("z")};
}

const Json& JsonFields::Array(const char* name) const {
  const Json* value = Find(name);
  if (value == nullptr || value->is_null()) return EmptyArray();
  if (value->is_array()) return *value;
  Fail(name, Expected("an array", *value));
  return EmptyArray();
}

JsonFields JsonFields::Object(const char* name, bool required) const {
  const Json* value = Find(name);
  if (value != nullptr) return {*value, PathOf(name), source_};
  if (required) Fail(name, "is missing");
  return {EmptyObject(), PathOf(name), source_};
}

std::string DumpJson(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json QuaternionJson(const Eigen::Quaterniond& q) {
  return {{"w", q.w()}, {"x", q.x()}, {"y", q.y()}, {"z", q.z()}};
}

double NumberOf(const Json& value, const std::string& where, JsonSource* source) {
  if (value.is_number()) return value.get<double>();
  if (!value.is_null()) source->Fail(where, Expected("a number", value));
  return std::numeric_limits<double>::quiet_NaN();
}

uint64_t UnsignedOf(const Json& value, uint64_t max, const std::string& where, JsonSource* source) {
  if (IsUnsigned(value, max)) return value.get<uint64_t>();
  source->Fail(where, Expected(absl::StrCat("an integer from 0 to ", max).c_str(), value));
  return 0;
}

Eigen::Vector3d VectorOf(const Json& value, const std::string& where, JsonSource* source) {
  if (!value.is_array() || value.size() != 3) {
    source->Fail(where, Expected("an array of 3 numbers", value));
    return Eigen::Vector3d::Zero();
  }
  return {NumberOf(value[0], where, source), NumberOf(value[1], where, source),
          NumberOf(value[2], where, source)};
}

}  // namespace dsg
