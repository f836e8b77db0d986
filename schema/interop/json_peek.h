// SPDX-License-Identifier: Apache-2.0
// Looks into JSON that may have any shape. Refuses to fail: what is not there is null, 0 or NaN.
#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

namespace dsg {

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

}  // namespace dsg
