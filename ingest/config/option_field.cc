// SPDX-License-Identifier: Apache-2.0
#include "ingest/config/option_field.h"

#include <array>
#include <charconv>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// The shortest text that reads back as the same number.
std::string Text(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace

absl::Status ValidateFields(std::span<const BoundOption> fields) {
  for (const BoundOption& field : fields) {
    const double value = *field.value;
    if (value >= field.min && value <= field.max) continue;
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(field.name, " is ", Text(value), "; give ", Text(field.min),
                                  " to ", Text(field.max)),
                     {{"field", field.name}, {"value", Text(value)}});
  }
  return absl::OkStatus();
}

std::string DigestFields(std::span<const BoundOption> fields,
                         std::span<const BoundOption> defaults) {
  std::string text;
  for (size_t i = 0; i < fields.size(); ++i) {
    const double value = *fields[i].value;
    if (i < defaults.size() && value == *defaults[i].value) continue;
    absl::StrAppend(&text, text.empty() ? "" : " ", fields[i].name, "=", Text(value));
  }
  return text;
}

}  // namespace dsg::ingest
