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

/// "name,red,green,blue,alpha,id" and its rows.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field and value.
absl::StatusOr<LabelTable> ReadLabelTable(const LogFile& file);

}  // namespace dsg::ingest
