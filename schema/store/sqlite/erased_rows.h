// SPDX-License-Identifier: Apache-2.0
// Takes rows of the past out of their tables, and makes right what the records of revisions say:
// sums, digests, lists of what was touched. Refuses to decide what is to go.
#pragma once

#include <map>
#include <set>

#include "schema/model/graph_delta.h"
#include "schema/store/content_rows.h"
#include "schema/store/erase_list.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// How the past of a map differs from what its records say.
class PastChange {
 public:
  /// A row that was shown from revision `from` on, until before `to`.
  void Take(const RowSums& row, Revision from, Revision to);
  void Put(const RowSums& row, Revision from, Revision to);

  /// Keys whose rows of the past are gone.
  ForgottenKeys forgotten;

  /// Writes the records anew. Within a transaction.
  absl::Status Apply(Database& db) const;

 private:
  absl::Status ApplySums(Database& db) const;
  absl::StatusOr<bool> ApplyToLists(Database& db) const;

  std::map<Revision, RowSums> changes_;
};

/// What has been taken out since the records were last made right.
struct ErasedRows {
  Database& db;
  const MapSpec& spec;
  PastChange past = {};
  int64_t row_count = 0;
  int64_t pose_count = 0;
  /// Of payloads.
  int64_t byte_count = 0;
  /// Referred to by rows that went.
  std::set<Sha256> assets = {};

  void Take(const RowSums& sums, Revision from, Revision to, size_t payload_bytes);
};

/// All past versions of a node and of the edges at it, and past stays in it. Current edges at it
/// begin no earlier than its current row. Of an agent that is gone all else too.
absl::Status EraseNodeRows(NodeId id, ErasedRows* erased);
absl::Status EraseEdgeRows(const EdgeRowKey& key, ErasedRows* erased);
absl::Status EraseMeshRows(const BlockIndex& index, ErasedRows* erased);
/// Past stays of the agent that touch the span.
absl::Status EraseStayRows(const TrackSpan& span, ErasedRows* erased);
/// Past shapes and factors with times in the span.
absl::Status EraseBatchRows(const TrackSpan& span, ErasedRows* erased);
/// All shapes and factors of an agent that is gone.
absl::Status EraseAllBatches(NodeId agent, ErasedRows* erased);
/// Past poses in the span.
absl::Status ErasePoses(const TrackSpan& span, ErasedRows* erased);
/// The track of an agent that is gone.
absl::Status EraseTrack(NodeId agent, ErasedRows* erased);

/// Makes the times of the first and last pose right in the records of all revisions.
absl::Status RepairPoseTimes(Database& db);

}  // namespace dsg::sqlite
