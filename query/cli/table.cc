// SPDX-License-Identifier: Apache-2.0
#include "query/cli/table.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_format.h"
#include "schema/base/check.h"
#include "schema/base/printable.h"
#include "schema/base/utf8.h"

namespace dsg::cli {
namespace {

void AppendCell(const std::string& text, size_t width, Align align, std::string* line) {
  const std::string padding(width - CountUtf8(text), ' ');
  if (align == Align::kRight) line->append(padding);
  line->append(text);
  if (align == Align::kLeft) line->append(padding);
}

}  // namespace

std::string Fixed(double value, int decimals) {
  std::string text = absl::StrFormat("%.*f", decimals, value);
  if (text[0] == '-' && text.find_first_not_of("-0.") == std::string::npos) text.erase(0, 1);
  return text;
}

void Table::AddRow(std::vector<std::string> cells) {
  DSG_CHECK(cells.size() <= columns_.size());
  cells.resize(columns_.size());
  for (std::string& cell : cells) cell = Printable(cell);
  rows_.push_back(std::move(cells));
}

std::string Table::Take() {
  const bool is_first = widths_.empty();
  widths_.resize(columns_.size());
  if (is_first) {
    std::vector<std::string> headings;
    for (const Column& column : columns_) headings.push_back(column.heading);
    rows_.insert(rows_.begin(), std::move(headings));
  }
  for (const auto& row : rows_) {
    for (size_t i = 0; i < row.size(); ++i) widths_[i] = std::max(widths_[i], CountUtf8(row[i]));
  }
  std::string text;
  for (const auto& row : rows_) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      if (i > 0) line.append("  ");
      AppendCell(row[i], widths_[i], columns_[i].align, &line);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text.append(line).append("\n");
  }
  rows_.clear();
  return text;
}

std::string RenderFields(const std::vector<Field>& fields) {
  size_t width = 0;
  for (const auto& [name, value] : fields) {
    if (!value.empty()) width = std::max(width, CountUtf8(name));
  }
  std::string text;
  for (const auto& [name, value] : fields) {
    if (value.empty()) continue;
    AppendCell(Printable(name), width, Align::kLeft, &text);
    text.append("  ").append(Printable(value)).append("\n");
  }
  return text;
}

}  // namespace dsg::cli
