// SPDX-License-Identifier: Apache-2.0
// The classes of label images: names, colours and numbers, as uHumans2 writes them.
// Refuses to merge names: many share a number, and some a colour.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"
#include "schema/model/layer.h"

namespace dsg::ingest {

struct LabelRow {
  std::string name;
  /// Red << 16 | green << 8 | blue.
  uint32_t rgb = 0;
  int32_t class_id = 0;
};

struct LabelTable {
  std::vector<LabelRow> rows;

  /// Class of a colour; colours that several classes share take the first row's.
  std::map<uint32_t, int32_t> ClassOfColor() const;
  /// Each class once, ascending by id: of several names the first row's.
  std::vector<SemanticLabel> Classes() const;
};

/// What the numbers in pictures of labels mean, whoever wrote them.
struct LabelIds {
  static constexpr size_t kCount = 65536;
  /// By number: class << 8, 0 = unknown.
  std::vector<uint16_t> label_of_id = std::vector<uint16_t>(kCount, 0);
  /// By number: whether the table has it.
  std::vector<bool> is_listed = std::vector<bool>(kCount, false);
  /// Ascending by id. The ids are the numbers, or count from 1 if these do not fit 1 to 255.
  std::vector<SemanticLabel> classes;
  bool is_renumbered = false;
};

/// A table with a header that has the columns "id" (0 to 65535) and "name", or without one whose
/// first two columns they are. Columns stand between commas, semicolons or tabs, or the id before
/// the first blank. A number that is named unknown, unlabeled, void, background and the like is no
/// class, and numbers of one name are one class, that of the lowest.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field and value: an id that stands
/// twice, more than 255 classes, none.
absl::StatusOr<LabelIds> ReadLabelIds(const LogFile& file);

/// The classes of a network: a table of ReadLabelIds, or one name a line, numbered from 0.
struct ClassList {
  LabelIds ids;
  /// One more than the largest number.
  size_t count = 0;
};
/// Errors: of ReadLabelIds.
absl::StatusOr<ClassList> ReadClassList(const LogFile& file);

/// "name,red,green,blue,alpha,id" and its rows.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field and value.
absl::StatusOr<LabelTable> ReadLabelTable(const LogFile& file);

}  // namespace dsg::ingest
