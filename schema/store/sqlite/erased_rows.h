// SPDX-License-Identifier: Apache-2.0
// Takes rows of the past out of their tables, and notes what the records of revisions lose by it.
// Refuses to decide what is to go.
#pragma once

#include <set>

#include "schema/model/graph_delta.h"
#include "schema/store/sqlite/past.h"

namespace dsg::sqlite {

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
