// SPDX-License-Identifier: Apache-2.0
// Lists as they go out: a table for people, CSV, a JSON object a line, or the whole reply as JSON.
// Rows are written as they come, so a list of any length needs the memory of a few thousand rows.
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "query/cli/answer_text.h"
#include "query/cli/arguments.h"
#include "query/cli/json.h"
#include "query/cli/table.h"
#include "schema/base/status.h"
#include "schema/base/time.h"

namespace dsg::cli {

/// What the cells of a column are. A table shows them for people; CSV has them exactly.
enum class CellType {
  kText,
  kCount,
  /// Tables round it.
  kReal,
  /// In a table relative to the map's epoch. In CSV `HEADING_ns`, and on a UNIX clock
  /// `HEADING_utc`.
  kTime,
  /// `HEADING_ns`.
  kDuration,
  /// Two times, `HEADING_from` and `HEADING_to`; empty where they are open.
  kSpan,
  /// `HEADING_id` and `HEADING_name`.
  kNode,
  /// The date of a time: in tables of maps with dates alone.
  kDate,
};

struct ListColumn {
  std::string heading;
  CellType type = CellType::kText;
  /// Of kReal in tables.
  int decimals = 2;
  /// What a table shows without a value; in CSV the cell is empty.
  std::string unknown{};
  /// The heading in CSV; empty = `heading` with underscores for blanks.
  std::string name{};
};

struct NodeCell {
  std::string id;
  std::string name;
};

/// kText: string; kCount, kTime, kDuration, kDate: int64_t; kReal: double; kSpan: Interval; kNode:
/// NodeCell. None: unknown.
using Cell = std::variant<std::monostate, std::string, int64_t, double, Interval, NodeCell>;
using Row = std::vector<Cell>;

class ListWriter {
 public:
  /// `list`: the repeated field of the reply, for JSON. `times` and `out` must outlive this.
  ListWriter(const CommonOptions& common, const TimeText& times, std::string list,
             std::vector<ListColumn> columns, std::ostream* out);

  /// Writes a part of the reply, which has `entries`; `row_of(entry)` gives the Row of each and is
  /// called for tables and CSV only. Errors: UNAVAILABLE if nothing more can be written.
  template <class Reply, class Entries, class RowOf>
  absl::Status Add(const Reply& part, const Entries& entries, const RowOf& row_of) {
    count_ += static_cast<int64_t>(entries.size());
    if (is_json_) {
      DSG_RETURN_IF_ERROR(json_.Add(part));
      return CheckWritten();
    }
    if (format_ == ListFormat::kCsv && !has_begun_) WriteCsvHeadings();
    has_begun_ = true;
    for (const auto& entry : entries) {
      if (format_ == ListFormat::kJsonLines) {
        DSG_RETURN_IF_ERROR(WriteJsonLine(entry, out_));
      } else {
        AddRow(row_of(entry));
      }
    }
    return CheckWritten();
  }

  /// Ends the list; tables end with `footer`. Errors: as Add.
  absl::Status End(std::string_view footer);

  /// Tables and CSV, which alone need the names of nodes.
  bool has_rows() const { return !is_json_ && format_ != ListFormat::kJsonLines; }
  bool is_table() const { return !is_json_ && format_ == ListFormat::kTable; }
  /// Entries so far.
  int64_t count() const { return count_; }

 private:
  void AddRow(const Row& row);
  void WriteCsvHeadings();
  void WriteCsvRow(const Row& row);
  void AppendCsv(const ListColumn& column, const Cell& cell, std::vector<std::string>* cells) const;
  std::string Shown(const ListColumn& column, const Cell& cell) const;
  absl::Status CheckWritten() const;

  const ListFormat format_;
  const bool is_json_;
  const TimeText& times_;
  const std::vector<ListColumn> columns_;
  std::ostream& out_;
  JsonListWriter json_;
  Table table_;
  bool has_begun_ = false;
  int64_t count_ = 0;
};

/// What the last page says of a paged list.
struct PageEnd {
  int64_t revision = 0;
  /// There are more entries than were asked for.
  bool is_cut = false;

  template <class Reply>
  static PageEnd Of(const Reply& page) {
    return {page.header().read_revision(), !page.next_page_token().empty()};
  }
};

}  // namespace dsg::cli
