// SPDX-License-Identifier: Apache-2.0
#include "ingest/truth/csv_table.h"

#include <charconv>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::truth {
namespace {

// Messages quote what they found, but not megabytes of it.
std::string Quoted(std::string_view text) {
  return absl::StrCat("\"", std::string(text.substr(0, 40)), text.size() > 40 ? "..." : "", "\"");
}

}  // namespace

CsvTable::CsvTable(std::string_view bytes, const std::string& file, std::string_view header)
    : rest_(bytes), file_(file), header_(header) {
  const size_t end = bytes.find('\n');
  if (end == std::string_view::npos || bytes.substr(0, end) != header) {
    Fail(absl::StrCat("the first line is ", Quoted(bytes.substr(0, end)), ", not the header ",
                      Quoted(header), "; write the truth again"));
    return;
  }
  rest_.remove_prefix(end + 1);
}

std::string_view CsvTable::FieldName() const {
  std::string_view names = header_;
  for (int64_t i = 1; i < field_count_; ++i) {
    const size_t comma = names.find(',');
    if (comma == std::string_view::npos) return "beyond the last";
    names.remove_prefix(comma + 1);
  }
  return names.substr(0, names.find(','));
}

void CsvTable::Fail(std::string_view what) {
  if (!status_.ok()) return;
  const std::string field =
      field_count_ == 0 ? "" : absl::StrCat("field ", std::string(FieldName()), ": ");
  status_ = MakeError(Reason::kFileMalformed,
                      absl::StrCat(file_, ":", line_, ": ", field, std::string(what)),
                      {{"path", file_}, {"line", absl::StrCat(line_)}});
}

bool CsvTable::NextRow() {
  if (status_.ok() && has_field_) Fail("the row goes on after it");
  if (!status_.ok() || rest_.empty()) return false;
  ++line_;
  field_count_ = 0;
  const size_t end = rest_.find('\n');
  if (end == std::string_view::npos) {
    Fail("the last line has no end; the file was cut, write the truth again");
    return false;
  }
  row_ = rest_.substr(0, end);
  rest_.remove_prefix(end + 1);
  has_field_ = true;
  return true;
}

std::string_view CsvTable::NextField() {
  ++field_count_;
  if (!has_field_) {
    Fail("is missing");
    return "";
  }
  const size_t comma = row_.find(',');
  has_field_ = comma != std::string_view::npos;
  const std::string_view field = row_.substr(0, comma);
  if (has_field_) row_.remove_prefix(comma + 1);
  return field;
}

int64_t CsvTable::Integer() {
  const std::string_view text = NextField();
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size()) return value;
  Fail(absl::StrCat(Quoted(text), " is not a 64-bit integer"));
  return 0;
}

double CsvTable::Number() {
  const std::string_view text = NextField();
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  if (is_whole && std::isfinite(value)) return value;
  Fail(absl::StrCat(Quoted(text), " is not a finite number"));
  return 0.0;
}

Eigen::Vector3d CsvTable::Vector() {
  const double x = Number();
  const double y = Number();
  return {x, y, Number()};
}

Pose3d CsvTable::Pose() {
  Pose3d pose;
  pose.position = Vector();
  for (int i = 0; i < 4; ++i) pose.orientation.coeffs()[i] = Number();
  if (status_.ok() && !IsValidPose(pose)) Fail("the quaternion that ends here is not of unit norm");
  return pose;
}

void AppendExact(double value, std::string* out) {
  char digits[32];
  const auto [end, error] = std::to_chars(digits, digits + sizeof(digits), value);
  out->append(digits, end);
}

}  // namespace dsg::truth
