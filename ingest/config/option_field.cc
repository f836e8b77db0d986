// SPDX-License-Identifier: Apache-2.0
#include "ingest/config/option_field.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// The shortest text that reads back as the same number.
std::string ToText(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

// The two ends of a range are rows of one table.
absl::Status CheckRange(std::span<const BoundOption> fields, const BoundOption& upper) {
  if (upper.lower_end == nullptr) return absl::OkStatus();
  const auto lower = std::find_if(fields.begin(), fields.end(), [&](const BoundOption& field) {
    return std::string_view(field.name) == upper.lower_end;
  });
  if (lower == fields.end() || lower->Get() <= upper.Get()) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(lower->name, " is ", lower->Text(), ", above ", upper.name,
                                ", which is ", upper.Text(), "; give at most that"),
                   {{"field", lower->name}, {"value", lower->Text()}});
}

}  // namespace

double BoundOption::Get() const {
  if (const auto* count = std::get_if<int*>(&value)) return **count;
  if (const auto* time = std::get_if<TimeNs*>(&value)) {
    return static_cast<double>(**time) / static_cast<double>(kNsPerSecond);
  }
  return *std::get<double*>(value);
}

std::string BoundOption::Text() const { return ToText(Get()); }

absl::Status BoundOption::Check(double number) const {
  const bool is_due = !IsCount() || number == std::floor(number);
  if (is_due && number >= min && number <= max) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat(name, " is ", ToText(number), "; give ", IsCount() ? "a whole number, " : "",
                   ToText(min), " to ", ToText(max)),
      {{"field", name}, {"value", ToText(number)}});
}

void BoundOption::Set(double number) const {
  if (const auto* count = std::get_if<int*>(&value)) {
    **count = static_cast<int>(number);
  } else if (const auto* time = std::get_if<TimeNs*>(&value)) {
    **time = std::llround(number * static_cast<double>(kNsPerSecond));
  } else {
    *std::get<double*>(value) = number;
  }
}

absl::Status ValidateFields(std::span<const BoundOption> fields) {
  for (const BoundOption& field : fields) DSG_RETURN_IF_ERROR(field.Check(field.Get()));
  for (const BoundOption& field : fields) DSG_RETURN_IF_ERROR(CheckRange(fields, field));
  return absl::OkStatus();
}

std::string DigestFields(std::span<const BoundOption> fields,
                         std::span<const BoundOption> defaults) {
  std::string text;
  for (size_t i = 0; i < fields.size(); ++i) {
    if (i < defaults.size() && fields[i].Get() == defaults[i].Get()) continue;
    absl::StrAppend(&text, text.empty() ? "" : " ", fields[i].name, "=", fields[i].Text());
  }
  return text;
}

absl::Status ValidateGroups(std::span<const OptionGroup> groups) {
  for (const OptionGroup& group : groups) DSG_RETURN_IF_ERROR(ValidateFields(group.fields));
  return absl::OkStatus();
}

std::string DigestGroups(std::span<const OptionGroup> groups,
                         std::span<const OptionGroup> defaults) {
  std::string text;
  for (size_t i = 0; i < groups.size(); ++i) {
    const std::string digest = DigestFields(groups[i].fields, defaults[i].fields);
    if (!digest.empty()) absl::StrAppend(&text, text.empty() ? "" : " ", digest);
  }
  return text;
}

}  // namespace dsg::ingest
