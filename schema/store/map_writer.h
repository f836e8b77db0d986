// SPDX-License-Identifier: Apache-2.0
// Keeping a map for years: names for revisions, and forgetting what nobody will ask for again.
// Only the process that writes the map may do this.
#pragma once

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/store/graph_writer.h"

namespace dsg {

/// A revision that has a name, and stays readable when its neighbours are compacted.
struct Tag {
  std::string name;
  Revision revision = 0;
  /// Wall clock at which it was set.
  TimeNs created_ns = 0;
  std::string note;
};

struct CompactReport {
  Revision oldest = 0;
  int64_t revision_count = 0;
  /// Rows that no readable revision shows, now gone.
  int64_t row_count = 0;
  int64_t bytes_before = 0;
  int64_t bytes_after = 0;
  /// False when a reader kept the log from being copied back: the file shrinks at a later time.
  bool is_shrunk = true;
};

/// Gets a fraction from 0 to 1; may be empty.
using Progress = std::function<void(double)>;

/// Threads: one caller at a time.
class MapWriter : public GraphWriter {
 public:
  /// Names a revision; a name that is there already moves to it.
  /// Errors: OUT_OF_RANGE as MapReader::At; INVALID_ARGUMENT/FIELD_INVALID for a name that is not
  /// 1 to 64 letters, digits, '.', '_' or '-', or looks like a number; or a note above 1000 bytes.
  virtual absl::StatusOr<Tag> SetTag(const std::string& name, Revision revision,
                                     const std::string& note) = 0;
  /// Errors: NOT_FOUND/TAG_UNKNOWN naming those there are.
  virtual absl::Status RemoveTag(const std::string& name) = 0;

  /// Makes the revisions before `keep_from` unreadable, but for those with tags, drops the rows
  /// that only they show, and gives the space back to the file system. What is kept reads as
  /// before. Done in steps: when stopped or killed, the next call goes on.
  ///
  /// Errors: OUT_OF_RANGE/REVISION_IN_FUTURE or REVISION_COMPACTED; what `stop` returned.
  virtual absl::StatusOr<CompactReport> Compact(Revision keep_from, const StopCheck& stop,
                                                const Progress& progress) = 0;
};

}  // namespace dsg
