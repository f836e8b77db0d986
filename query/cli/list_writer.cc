// SPDX-License-Identifier: Apache-2.0
#include "query/cli/list_writer.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "query/cli/csv.h"
#include "schema/base/check.h"

namespace dsg::cli {
namespace {

// So many rows settle the widths of a table, which may grow later.
constexpr size_t kRowsPerPart = 1000;

bool IsShown(const ListColumn& column, const TimeText& times) {
  return column.type != CellType::kDate || times.has_dates();
}

std::vector<Column> TableColumns(const std::vector<ListColumn>& columns, const TimeText& times) {
  std::vector<Column> shown;
  for (const ListColumn& column : columns) {
    if (!IsShown(column, times)) continue;
    const bool is_number = column.type == CellType::kCount || column.type == CellType::kReal ||
                           column.type == CellType::kTime || column.type == CellType::kDuration;
    shown.push_back({column.heading, is_number ? Align::kRight : Align::kLeft});
  }
  return shown;
}

}  // namespace

ListWriter::ListWriter(const CommonOptions& common, const TimeText& times, std::string list,
                       std::vector<ListColumn> columns, std::ostream* out)
    : format_(common.format),
      is_json_(common.json),
      times_(times),
      columns_(std::move(columns)),
      out_(*out),
      json_(std::move(list), out),
      table_(TableColumns(columns_, times)) {}

absl::Status ListWriter::End(std::string_view footer) {
  if (is_json_) json_.End();
  if (is_table()) out_ << table_.Take() << footer;
  return CheckWritten();
}

void ListWriter::AddRow(const Row& row) {
  DSG_CHECK(row.size() == columns_.size());
  if (format_ == ListFormat::kCsv) return WriteCsvRow(row);
  std::vector<std::string> cells;
  for (size_t i = 0; i < row.size(); ++i) {
    if (IsShown(columns_[i], times_)) cells.push_back(Shown(columns_[i], row[i]));
  }
  table_.AddRow(std::move(cells));
  if (table_.row_count() >= kRowsPerPart) out_ << table_.Take();
}

std::string ListWriter::Shown(const ListColumn& column, const Cell& cell) const {
  if (std::holds_alternative<std::monostate>(cell)) return column.unknown;
  switch (column.type) {
    case CellType::kText:
      return std::get<std::string>(cell);
    case CellType::kCount:
      return absl::StrCat(std::get<int64_t>(cell));
    case CellType::kReal:
      return Fixed(std::get<double>(cell), column.decimals);
    case CellType::kTime:
      return times_.Relative(std::get<int64_t>(cell));
    case CellType::kDuration:
      return DurationText(0, std::get<int64_t>(cell));
    case CellType::kSpan:
      return times_.Span(std::get<Interval>(cell).from_ns, std::get<Interval>(cell).to_ns);
    case CellType::kNode:
      return NamedId(std::get<NodeCell>(cell).id, std::get<NodeCell>(cell).name);
    case CellType::kDate:
      return times_.Date(std::get<int64_t>(cell));
  }
  return "";
}

void ListWriter::WriteCsvHeadings() {
  std::vector<std::string> names;
  const auto add_time = [&](const std::string& name) {
    names.push_back(absl::StrCat(name, "_ns"));
    if (times_.has_dates()) names.push_back(absl::StrCat(name, "_utc"));
  };
  for (const ListColumn& column : columns_) {
    const std::string name =
        column.name.empty() ? absl::StrReplaceAll(column.heading, {{" ", "_"}}) : column.name;
    switch (column.type) {
      case CellType::kTime:
        add_time(name);
        break;
      case CellType::kDuration:
        names.push_back(absl::StrCat(name, "_ns"));
        break;
      case CellType::kSpan:
        add_time(absl::StrCat(name, "_from"));
        add_time(absl::StrCat(name, "_to"));
        break;
      case CellType::kNode:
        names.insert(names.end(), {absl::StrCat(name, "_id"), absl::StrCat(name, "_name")});
        break;
      case CellType::kDate:
        break;
      default:
        names.push_back(name);
    }
  }
  std::string line;
  AppendCsvRecord(names, &line);
  out_ << line;
}

void ListWriter::WriteCsvRow(const Row& row) {
  std::vector<std::string> cells;
  for (size_t i = 0; i < row.size(); ++i) AppendCsv(columns_[i], row[i], &cells);
  std::string line;
  AppendCsvRecord(cells, &line);
  out_ << line;
}

void ListWriter::AppendCsv(const ListColumn& column, const Cell& cell,
                           std::vector<std::string>* cells) const {
  const bool is_known = !std::holds_alternative<std::monostate>(cell);
  const auto add_time = [&](TimeNs time_ns) {
    const bool is_closed = is_known && time_ns != kTimeMin && time_ns != kTimeMax;
    cells->push_back(is_closed ? absl::StrCat(time_ns) : "");
    if (times_.has_dates()) cells->push_back(is_closed ? FormatRfc3339(time_ns) : "");
  };
  switch (column.type) {
    case CellType::kTime:
      return add_time(is_known ? std::get<int64_t>(cell) : 0);
    case CellType::kSpan: {
      const Interval span = is_known ? std::get<Interval>(cell) : Interval();
      add_time(span.from_ns);
      return add_time(span.to_ns);
    }
    case CellType::kNode: {
      const NodeCell node = is_known ? std::get<NodeCell>(cell) : NodeCell();
      cells->insert(cells->end(), {node.id, node.name});
      return;
    }
    case CellType::kDate:
      return;
    case CellType::kReal:
      return cells->push_back(is_known ? ExactNumber(std::get<double>(cell)) : "");
    case CellType::kCount:
    case CellType::kDuration:
      return cells->push_back(is_known ? absl::StrCat(std::get<int64_t>(cell)) : "");
    case CellType::kText:
      return cells->push_back(is_known ? std::get<std::string>(cell) : "");
  }
}

absl::Status ListWriter::CheckWritten() const {
  // A full disk or a closed pipe must not look like a complete answer.
  if (out_) return absl::OkStatus();
  return absl::UnavailableError("the answer could not be written out in full");
}

}  // namespace dsg::cli
