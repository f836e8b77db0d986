// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/delta_sink.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/commit/delta_size.h"
#include "ingest/commit/undone_session.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr int kCommitTriesMax = 3;
// Each names hundreds of nodes that the map has forgotten; they can be forgotten while we mend.
constexpr int kMendTriesMax = 100;

int64_t PoseCount(const GraphDelta& delta) {
  int64_t count = 0;
  for (const TrajectoryAppend& append : delta.appends) {
    count += static_cast<int64_t>(append.poses.size());
  }
  return count;
}

}  // namespace

void DeltaSink::NumberByNews() {
  numbers_by_news_ = true;
  is_followed_ = true;
  sequence_ = committed_sequence_ = last_sequence_;
}

absl::Status DeltaSink::BeginEnd() {
  if (sequence_ < last_sequence_) return IsShorter();
  is_at_end_ = true;
  header_.session_id = EndSessionId(session_id_);
  last_sequence_ = end_sequence_;
  sequence_ = committed_sequence_ = 0;
  return absl::OkStatus();
}

absl::Status DeltaSink::Put(GraphDelta delta) {
  if (delta.empty()) return absl::OkStatus();
  // Edges that end depend on what the map held before the log. They all go with the first part,
  // uncounted: a resumed run, which finds them gone, must cut the rest at the same places.
  std::vector<EdgeKey> ends = std::exchange(delta.edge_removals, {});
  std::vector<GraphDelta> parts = SplitToSize(std::move(delta));
  if (parts.empty()) parts.emplace_back();
  parts.front().edge_removals = std::move(ends);
  // An agent's node stands before its poses, so their count must be known before the first part.
  if (sequence_ + static_cast<int64_t>(parts.size()) > last_sequence_) {
    DSG_RETURN_IF_ERROR(reconciler_.CountNews(parts));
  }
  for (GraphDelta& part : parts) {
    DSG_RETURN_IF_ERROR(PutPart(std::move(part)));
  }
  return absl::OkStatus();
}

absl::Status DeltaSink::PutAsIs(GraphDelta delta) {
  if (delta.empty()) return absl::OkStatus();
  for (GraphDelta& part : SplitToSize(std::move(delta))) {
    DSG_RETURN_IF_ERROR(PutPartAsIs(std::move(part)));
  }
  return absl::OkStatus();
}

absl::Status DeltaSink::PutCorrection(GraphDelta delta) {
  if (delta.empty()) return absl::OkStatus();
  if (!is_size_bounded_) return PutPartAsIs(std::move(delta));
  GraphDelta factors;
  factors.factors = std::exchange(delta.factors, {});
  if (!delta.empty()) {
    for (GraphDelta& part : CutCorrection(std::move(delta))) {
      DSG_RETURN_IF_ERROR(PutPartAsIs(std::move(part)));
    }
  }
  return PutAsIs(std::move(factors));
}

absl::Status DeltaSink::PutPart(GraphDelta delta) {
  ++sequence_;
  if (sequence_ <= last_sequence_) {
    reconciler_.ObserveCommitted(delta);
    forgotten_.ObserveCommitted(delta);
    counts_.skipped_pose_count += PoseCount(delta);
    committed_sequence_ = sequence_;
    return absl::OkStatus();
  }
  forgotten_.Observe(delta);
  for (const Node& node : delta.nodes) {
    if (forgotten_.HasReturned(node.id)) reconciler_.ForgetNode(node.id);
  }
  DSG_RETURN_IF_ERROR(reconciler_.Reconcile(&delta));
  return CommitNext(std::move(delta));
}

absl::Status DeltaSink::PutPartAsIs(GraphDelta delta) {
  ++sequence_;
  if (sequence_ > last_sequence_) {
    forgotten_.Observe(delta);
    return CommitNext(std::move(delta));
  }
  reconciler_.ObserveCommitted(delta);
  forgotten_.ObserveCommitted(delta);
  committed_sequence_ = sequence_;
  return absl::OkStatus();
}

absl::Status DeltaSink::CommitNext(GraphDelta delta) {
  DSG_RETURN_IF_ERROR(forgotten_.LeaveOut(&delta));
  if (delta.empty()) {
    if (numbers_by_news_) --sequence_;
    return absl::OkStatus();
  }
  if (end_sequence_ > 0 && !is_at_end_) return EndWasTold();
  // Sequences have no holes, or a resumed run could not count its way back to here: deltas
  // without news are committed empty once there is news after them.
  while (committed_sequence_ + 1 < sequence_) {
    GraphDelta nothing;
    FillHeader(committed_sequence_ + 1, &nothing);
    DSG_RETURN_IF_ERROR(Commit(std::move(nothing)));
  }
  FillHeader(sequence_, &delta);
  return Commit(std::move(delta));
}

absl::Status DeltaSink::EndWasTold() const {
  return absl::FailedPreconditionError(
      absl::StrCat(header_.message, ": an earlier run has told map \"", header_.map,
                   "\" the end of this log, and it has grown since; what it showed then cannot be "
                   "continued: take the whole log into another --map"));
}

absl::Status DeltaSink::IsShorter() const {
  return absl::FailedPreconditionError(absl::StrCat(
      header_.message, ": map \"", header_.map, "\" holds ", last_sequence_,
      " parts of this log, and it ends after ", sequence_,
      "; its end is not told to the map: run the same again on the whole log, or take this one "
      "into another --map"));
}

void DeltaSink::FillHeader(int64_t sequence, GraphDelta* delta) const {
  delta->map = header_.map;
  delta->session_id = header_.session_id;
  delta->sequence = sequence;
  delta->author = header_.author;
  const std::string about = delta->message.empty() ? "" : absl::StrCat(": ", delta->message);
  delta->message = absl::StrCat(header_.message, ", part ", sequence, about);
  delta->config_digest = header_.config_digest;
}

absl::Status DeltaSink::Commit(GraphDelta delta) {
  // Nothing is told behind a gap. Other logs send delta after delta: to look before each would cost
  // a fifth of their time on a server, and what has changed between is found right after.
  if (is_followed_) DSG_RETURN_IF_ERROR(CheckIsKept(counts_.last_revision));
  committed_sequence_ = delta.sequence;
  absl::StatusOr<CommitResult> result = Send(delta);
  for (int tries = 0; tries < kMendTriesMax && !result.ok(); ++tries) {
    if (!forgotten_.Mend(result.status(), &delta)) break;
    result = Send(delta);
  }
  Count(delta);
  if (!result.ok()) return Annotate(result.status(), delta.message);
  forgotten_.ObserveTaken(delta);
  const Revision previous = std::exchange(counts_.last_revision, result->revision);
  if (result->revision <= previous + 1) return absl::OkStatus();
  // Somebody else has committed before this.
  return CheckIsKept(previous);
}

absl::Status DeltaSink::CheckIsKept(Revision from) const {
  if (from == 0) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::optional<Undoing> undoing, FindUndoing(map_, session_id_, from));
  if (!undoing.has_value()) return absl::OkStatus();
  return UndoneError(header_.message, header_.map, *undoing);
}

absl::StatusOr<CommitResult> DeltaSink::Send(const GraphDelta& delta) {
  absl::StatusOr<CommitResult> result;
  for (int tries = 0; tries < kCommitTriesMax; ++tries) {
    result = writer_.Commit(delta);
    // The same session and sequence again settles what became of it.
    if (ReasonOf(result.status()) != Reason::kCommitOutcomeUnknown) break;
  }
  return result;
}

void DeltaSink::Count(const GraphDelta& delta) {
  ++counts_.revision_count;
  for (const Node& node : delta.nodes) nodes_.insert(node.id);
  counts_.edge_count += std::ssize(delta.edges);
  for (const Stay& stay : delta.stays) stays_.insert({stay.agent, stay.enter_ns});
  counts_.pose_count += PoseCount(delta);
}

CommitCounts DeltaSink::counts() const {
  CommitCounts counts = counts_;
  counts.node_count = static_cast<int64_t>(nodes_.size());
  counts.stay_count = static_cast<int64_t>(stays_.size());
  counts.skipped_pose_count += reconciler_.skipped_pose_count();
  return counts;
}

}  // namespace dsg::ingest
