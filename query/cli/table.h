// SPDX-License-Identifier: Apache-2.0
// Tables of text for people: a heading line, then one line per row, each column as wide as its
// widest cell. Control characters and marks that turn the direction of writing are replaced, so
// names from a log cannot control the terminal, nor pass for other names.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "schema/base/counted.h"

namespace dsg::cli {

/// A number with a fixed count of decimals; "-0.00" is written "0.00".
std::string Fixed(double value, int decimals);

enum class Align { kLeft, kRight };

struct Column {
  std::string heading;
  Align align = Align::kLeft;
};

class Table {
 public:
  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /// Missing cells at the end are empty. Requires: no more cells than columns.
  void AddRow(std::vector<std::string> cells);

  /// Rows that no Take has given out.
  size_t row_count() const { return rows_.size(); }

  /// Lines end with '\n', without trailing blanks; two blanks separate the columns.
  std::string Render() const { return Table(*this).Take(); }

  /// The text of the rows since the last call, which are then dropped: a long table in parts. The
  /// first part begins with the headings; columns never become narrower.
  std::string Take();

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<std::string>> rows_;
  /// Empty until the headings are given out.
  std::vector<size_t> widths_;
};

using Field = std::pair<std::string, std::string>;

/// One line per field, values aligned; fields without a value are left out.
std::string RenderFields(const std::vector<Field>& fields);

}  // namespace dsg::cli
