// SPDX-License-Identifier: Apache-2.0
#include "schema/base/byte_size.h"

#include <limits>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

absl::Status BadSize(std::string_view text, std::string_view rule) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("\"", std::string(text), "\" ", std::string(rule)),
                   {{"value", std::string(text)}});
}

// 0 for an unknown unit.
int64_t BytesOfUnit(std::string unit) {
  if (unit.ends_with('b')) unit.pop_back();
  const bool is_binary = unit.size() == 2 && unit[1] == 'i';
  if (is_binary) unit.pop_back();
  if (unit.empty()) return 1;
  const size_t power = std::string_view("kmgt").find(unit[0]);
  if (unit.size() > 1 || power == std::string_view::npos) return 0;
  int64_t bytes = 1;
  for (size_t i = 0; i <= power; ++i) bytes *= is_binary ? 1024 : 1000;
  return bytes;
}

}  // namespace

absl::StatusOr<int64_t> ParseByteSize(std::string_view text) {
  constexpr char kRule[] = "is no size in bytes; write a whole number of 0 or more: 500MiB, 10GB";
  const size_t end = text.find_first_not_of("0123456789");
  const std::string digits(text.substr(0, end));
  std::string unit(end == std::string_view::npos ? "" : text.substr(end));
  absl::StripAsciiWhitespace(&unit);
  absl::AsciiStrToLower(&unit);
  const int64_t factor = BytesOfUnit(unit);
  if (digits.empty() || factor == 0) return BadSize(text, kRule);
  int64_t number = 0;
  if (!absl::SimpleAtoi(digits, &number) || number > std::numeric_limits<int64_t>::max() / factor) {
    return BadSize(text, "is more bytes than can be counted; write a smaller size");
  }
  return number * factor;
}

std::string TakeByteSize(std::string& text) {
  const absl::StatusOr<int64_t> bytes = ParseByteSize(text);
  if (!bytes.ok()) return std::string(bytes.status().message());
  text = absl::StrCat(*bytes);
  return "";
}

}  // namespace dsg
