// SPDX-License-Identifier: Apache-2.0
// A strict reader of tables of numbers: a known header, then rows of as many fields.
// Refuses quotes, blanks, empty fields and a last line without its end.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "schema/model/geometry.h"

namespace dsg::truth {

/// Reads fields in order and remembers the first error; callers read on and look once a row.
///
///   CsvTable table(bytes, file, kHeader);
///   while (table.NextRow()) { row.time_ns = table.Integer(); ... }
///   return table.status();
class CsvTable {
 public:
  /// `bytes`, `file` and `header` must outlive this.
  CsvTable(std::string_view bytes, const std::string& file, std::string_view header);

  /// False at the end and after an error, also when the row before was not read to its end.
  bool NextRow();
  int64_t Integer();
  /// A finite number.
  double Number();
  Eigen::Vector3d Vector();
  /// Position, then quaternion x y z w of unit norm.
  Pose3d Pose();
  /// FILE_MALFORMED: "file:line: field x: what".
  void Fail(std::string_view what);

  const absl::Status& status() const { return status_; }

 private:
  std::string_view NextField();
  std::string_view FieldName() const;

  std::string_view rest_;
  const std::string& file_;
  std::string_view header_;
  std::string_view row_;
  int64_t line_ = 1;
  int64_t field_count_ = 0;
  bool has_field_ = false;
  absl::Status status_;
};

/// The shortest text that reads back as the same bits.
void AppendExact(double value, std::string* out);

}  // namespace dsg::truth
