// SPDX-License-Identifier: Apache-2.0
#include "query/cli/csv.h"

#include <array>
#include <charconv>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace dsg::cli {

void AppendCsvRecord(const std::vector<std::string>& cells, std::string* text) {
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) text->push_back(',');
    const std::string& cell = cells[i];
    const bool has_blank_end = cell.starts_with(' ') || cell.ends_with(' ') ||
                               cell.starts_with('\t') || cell.ends_with('\t');
    // Readers may cut blanks outside of quotes.
    if (!has_blank_end && cell.find_first_of(",\"\r\n") == std::string::npos) {
      text->append(cell);
    } else {
      absl::StrAppend(text, "\"", absl::StrReplaceAll(cell, {{"\"", "\"\""}}), "\"");
    }
  }
  text->append("\r\n");
}

std::string ExactNumber(double value) {
  // The longest is 24 characters: sign, 17 digits, point, exponent.
  std::array<char, 32> digits;
  const auto written = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  return std::string(digits.data(), written.ptr);
}

}  // namespace dsg::cli
