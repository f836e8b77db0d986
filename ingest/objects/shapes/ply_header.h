// SPDX-License-Identifier: Apache-2.0
// The header of a PLY file: what follows it, element by element.
// Refuses headers that do not add up with the file's size.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::ingest {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

int ByteCount(PlyType type);
inline bool IsInteger(PlyType type) { return type != PlyType::kFloat && type != PlyType::kDouble; }

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;
};

struct PlyElement {
  std::string name;
  int64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Index of a property; -1 = there is none.
  int Find(std::string_view property_name) const;
};

struct PlyHeader {
  bool is_ascii = false;
  std::vector<PlyElement> elements;
  /// Where the data begin, and in which line.
  size_t body_offset = 0;
  int64_t body_line = 0;
};

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file and line.
absl::StatusOr<PlyHeader> ReadPlyHeader(std::string_view bytes, const std::string& file);

}  // namespace dsg::ingest
