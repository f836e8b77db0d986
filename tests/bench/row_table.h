// SPDX-License-Identifier: Apache-2.0
// The rival: one SQLite row a pose, WITHOUT ROWID, keyed (agent, t), with the same pragmas as our
// store and prepared statements. What a careful engineer would write in an afternoon.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/graph_delta.h"
#include "schema/store/snapshot.h"

struct sqlite3;
struct sqlite3_stmt;

namespace dsg::bench {

/// Threads: one caller at a time.
class RowTable {
 public:
  /// Makes "<folder>/rows.db". Agents are the first `agent_count` of a crowd.
  static absl::StatusOr<std::unique_ptr<RowTable>> Create(const std::string& folder,
                                                          int agent_count);
  /// `cache_bytes`: what our side may use for its own caches, so that memory is equal.
  static absl::StatusOr<std::unique_ptr<RowTable>> OpenForReading(const std::string& folder,
                                                                  size_t cache_bytes);
  ~RowTable();
  RowTable(const RowTable&) = delete;
  RowTable& operator=(const RowTable&) = delete;

  /// One transaction.
  absl::Status Insert(const std::vector<TrajectoryAppend>& appends);
  /// Copies the write-ahead log into the file.
  absl::Status Checkpoint();
  /// Changes one row in a transaction of its own: what a synced commit costs at least.
  absl::Status Touch(NodeId agent, TimeNs time_ns);

  /// Reads every row. Returns how many there are.
  absl::StatusOr<int64_t> ReadAll();
  /// The rows on both sides, interpolated as our store does.
  absl::StatusOr<LocatedPose> Locate(NodeId agent, TimeNs at_ns);
  /// Agents with a row inside the box in [from_ns, to_ns), ascending: for each agent a scan of the
  /// key's range that stops at the first hit.
  absl::StatusOr<std::vector<NodeId>> AgentsInBox(const Box3d& box, TimeNs from_ns, TimeNs to_ns);
  /// Rows of one agent in [from_ns, to_ns].
  absl::StatusOr<std::vector<TimedPose>> Poses(NodeId agent, TimeNs from_ns, TimeNs to_ns);

 private:
  RowTable() = default;
  absl::Status Open(const std::string& folder, bool writable);
  absl::Status Execute(const std::string& sql);
  absl::Status Prepare(const char* sql, sqlite3_stmt** statement);
  absl::Status Error(const std::string& doing) const;

  sqlite3* db_ = nullptr;
  sqlite3_stmt* insert_ = nullptr;
  sqlite3_stmt* touch_ = nullptr;
  sqlite3_stmt* bracket_ = nullptr;
  sqlite3_stmt* in_box_ = nullptr;
  sqlite3_stmt* range_ = nullptr;
};

}  // namespace dsg::bench
