// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/manifest_fields.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace dsg {
namespace {

using Json = nlohmann::ordered_json;

// A list of objects in an object, and some to spare. Values are copied a call deep for each level.
constexpr int kDepthMax = 8;

bool IsSmallInteger(const Json& value) {
  return value.is_number_integer() && value.get<double>() >= std::numeric_limits<int>::min() &&
         value.get<double>() <= std::numeric_limits<int>::max();
}

bool IsListOfObjects(const Json& value) {
  return value.is_array() &&
         std::all_of(value.begin(), value.end(), [](const Json& one) { return one.is_object(); });
}

}  // namespace

struct ManifestFields::Value {
  Json json;
};

ManifestFields::ManifestFields(std::string_view text) : object_(std::make_unique<Value>()) {
  bool is_too_deep = false;
  const auto is_taken = [&](int depth, Json::parse_event_t, Json&) {
    is_too_deep = is_too_deep || depth > kDepthMax;
    return depth <= kDepthMax;
  };
  object_->json = Json::parse(text, is_taken, /*allow_exceptions=*/false);
  if (is_too_deep) {
    problem_ = "it is nested too deeply";
  } else if (!object_->json.is_object()) {
    problem_ = "it is not one JSON object";
  }
}

ManifestFields::ManifestFields(std::unique_ptr<Value> object) : object_(std::move(object)) {}
ManifestFields::~ManifestFields() = default;
ManifestFields::ManifestFields(ManifestFields&&) noexcept = default;

void ManifestFields::Refuse(const char* name, std::string_view why) {
  if (problem_.empty()) problem_ = absl::StrCat("field \"", name, "\" ", std::string(why));
}

ManifestFields::Value ManifestFields::Take(const char* name, Kind kind) {
  const Json nothing[] = {"", 0, 0.0, Json::array()};
  Value value{nothing[static_cast<size_t>(kind)]};
  if (!problem_.empty()) return value;
  const auto found = object_->json.find(name);
  if (found == object_->json.end()) {
    Refuse(name, "is missing");
  } else if (kind == Kind::kText && !found->is_string()) {
    Refuse(name, "is not a text");
  } else if (kind == Kind::kSmallInteger && !IsSmallInteger(*found)) {
    Refuse(name, "is not a whole number of at most 32 bits");
  } else if (kind == Kind::kNumber && !found->is_number()) {
    Refuse(name, "is not a number");
  } else if (kind == Kind::kObjects && !IsListOfObjects(*found)) {
    Refuse(name, "is not a list of objects");
  } else {
    value.json = *found;
  }
  return value;
}

std::string ManifestFields::Text(const char* name) { return Take(name, Kind::kText).json; }

int64_t ManifestFields::Integer(const char* name) {
  int64_t value = 0;
  const std::string text = Text(name);
  if (!absl::SimpleAtoi(text, &value)) Refuse(name, "is not a whole number written as a text");
  return value;
}

int64_t ManifestFields::Count(const char* name) {
  const int64_t value = Integer(name);
  if (value < 0) Refuse(name, "is negative");
  return value;
}

int ManifestFields::SmallInteger(const char* name) { return Take(name, Kind::kSmallInteger).json; }

double ManifestFields::Number(const char* name) { return Take(name, Kind::kNumber).json; }

Sha256 ManifestFields::Digest(const char* name) {
  const std::string text = Text(name);
  Sha256 digest{};
  if (text.size() != 2 * digest.size() ||
      text.find_first_not_of("0123456789abcdef") != std::string::npos) {
    Refuse(name, "is not a digest of 64 hexadecimal digits");
    return digest;
  }
  const std::string bytes = absl::HexStringToBytes(text);
  std::copy(bytes.begin(), bytes.end(), digest.begin());
  return digest;
}

std::vector<ManifestFields> ManifestFields::Objects(const char* name) {
  std::vector<ManifestFields> objects;
  for (Json& one : Take(name, Kind::kObjects).json) {
    objects.push_back(ManifestFields(std::make_unique<Value>(Value{std::move(one)})));
  }
  return objects;
}

}  // namespace dsg
