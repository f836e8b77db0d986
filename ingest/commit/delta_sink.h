// SPDX-License-Identifier: Apache-2.0
// Numbers the deltas of one log and commits those that the map does not hold yet.
// Refuses to write a log without news: then no revision is made at all.
#pragma once

#include <set>
#include <string>
#include <unordered_set>
#include <utility>

#include "ingest/commit/forgotten.h"
#include "ingest/commit/map_view.h"
#include "ingest/commit/reconciler.h"
#include "schema/store/graph_writer.h"

namespace dsg::ingest {

/// What was written. A node or stay that was written more than once counts once.
struct CommitCounts {
  int64_t revision_count = 0;
  int64_t node_count = 0;
  int64_t edge_count = 0;
  int64_t pose_count = 0;
  int64_t stay_count = 0;
  /// Poses that an earlier run or another log had brought.
  int64_t skipped_pose_count = 0;
  /// 0 = nothing was written.
  Revision last_revision = 0;
};

/// The header that all deltas of a session share.
struct SessionHeader {
  std::string map;
  std::string session_id;
  std::string author;
  std::string message;
  std::string config_digest;
};

/// Threads: one caller at a time.
class DeltaSink {
 public:
  /// `last_sequence`: how far an earlier run of the session got. `is_size_bounded`: deltas must fit
  /// into messages to a server.
  /// Requires: `map` and `writer` outlive the sink.
  DeltaSink(SessionHeader header, int64_t last_sequence, bool is_size_bounded, const MapView& map,
            GraphWriter& writer)
      : header_(std::move(header)),
        session_id_(header_.session_id),
        last_sequence_(last_sequence),
        is_size_bounded_(is_size_bounded),
        map_(map),
        reconciler_(map),
        forgotten_(map),
        writer_(writer) {}

  /// For a log that is cut into other deltas each time it is read, as it grows: what an earlier run
  /// has committed is known by the map that holds it, and not by the number of its delta. Before
  /// the first Put; goes with Put only.
  void NumberByNews();

  /// For a log that may grow on after its end: its last deltas, from BeginEnd on, are a session of
  /// their own (EndSessionId), so that those before keep their numbers. `end_sequence`: how far an
  /// earlier run of that session got; then news before BeginEnd are refused with
  /// FAILED_PRECONDITION, since the log has grown after its end was told.
  void SplitEnd(int64_t end_sequence) {
    end_sequence_ = end_sequence;
    is_followed_ = true;
  }
  /// Errors: FAILED_PRECONDITION if an earlier run has committed more of the log than has come: it
  /// has become shorter, and its end is another.
  absl::Status BeginEnd();

  /// Takes the next delta of the log, whatever its size. An empty one is passed over.
  ///
  /// Errors: what Reconciler::Reconcile and GraphWriter::Commit return; ABORTED if the map was
  /// reverted since the delta before, to what it held before that.
  absl::Status Put(GraphDelta delta);

  /// As Put, for what only this session speaks of: it is not compared with what the map held before
  /// the log, so what a session says, takes back and says again is stored as it says it.
  absl::Status PutAsIs(GraphDelta delta);

  /// As PutAsIs, for a correction of much that was told: one revision whatever its size, or
  /// CutCorrection's parts where sizes are bounded.
  absl::Status PutCorrection(GraphDelta delta);

  CommitCounts counts() const;

 private:
  absl::Status PutPart(GraphDelta delta);
  absl::Status PutPartAsIs(GraphDelta delta);
  absl::Status CommitNext(GraphDelta delta);
  void FillHeader(int64_t sequence, GraphDelta* delta) const;
  absl::Status EndWasTold() const;
  absl::Status IsShorter() const;
  absl::Status Commit(GraphDelta delta);
  /// Whether the map still holds what was committed at `from` and later.
  absl::Status CheckIsKept(Revision from) const;
  absl::StatusOr<CommitResult> Send(const GraphDelta& delta);
  void Count(const GraphDelta& delta);

  SessionHeader header_;
  /// Of all deltas but those of the end.
  std::string session_id_;
  int64_t last_sequence_;
  bool is_size_bounded_;
  /// Only deltas with news have numbers.
  bool numbers_by_news_ = false;
  /// Its deltas come seconds apart, so that somebody else may well have reverted the map between.
  bool is_followed_ = false;
  /// Of the session of the end; 0 = nothing of it was told.
  int64_t end_sequence_ = 0;
  bool is_at_end_ = false;
  /// Of the delta that came last.
  int64_t sequence_ = 0;
  /// Of the delta that the writer got last.
  int64_t committed_sequence_ = 0;
  const MapView& map_;
  Reconciler reconciler_;
  Forgotten forgotten_;
  GraphWriter& writer_;
  CommitCounts counts_;
  std::unordered_set<NodeId> nodes_;
  std::set<std::pair<NodeId, TimeNs>> stays_;
};

}  // namespace dsg::ingest
