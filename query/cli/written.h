// SPDX-License-Identifier: Apache-2.0
// Tells which files a verb has written, and what is in them.
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "schema/model/revision.h"

namespace dsg::cli {

/// A file that was written; told at the end, since a later file may fail.
struct Written {
  std::string format;
  std::string path;
  int64_t byte_count = 0;
  /// What is in it: "vertices", "faces", ...
  std::vector<std::pair<std::string, int64_t>> counts;
};

/// A line a file, or one JSON object.
void TellWritten(const std::vector<Written>& files, Revision revision, bool as_json,
                 std::ostream& out);

}  // namespace dsg::cli
