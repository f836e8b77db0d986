// SPDX-License-Identifier: Apache-2.0
// Tracks as they are streamed: each pose with the revisions that show it, in pieces that every
// backend cuts alike, whatever the segments are in which it keeps poses (docs/adr/0012).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "schema/codec/trajectory_codec.h"
#include "schema/model/layer.h"
#include "schema/store/row_stream.h"

namespace dsg {

/// How far a track reaches from a revision on, until the next of its ends.
struct TrackEnd {
  Revision revision = 0;
  /// Of the last pose; kTimeMin if there is none.
  TimeNs last_ns = kTimeMin;
  int64_t pose_count = 0;
};

/// The first of some ascending revisions that is not before `revision`; kRevisionMax if none is.
Revision FirstFrom(const std::vector<Revision>& revisions, Revision revision);

/// The ends as of the revisions that have a record, without those that change nothing.
/// Requires: both ascend.
std::vector<TrackEnd> EndsAtRecords(const std::vector<TrackEnd>& ends,
                                    const std::vector<Revision>& records);

/// Tells since when the poses of a piece or segment are shown: from the first revision, not before
/// that of the piece, in which the track reaches as far.
class PieceClock {
 public:
  /// `ends` must ascend and outlive this.
  PieceClock(const std::vector<TrackEnd>* ends, Revision from);
  /// kRevisionMax if the track never reaches so far. Requires: times that ascend from call to call.
  Revision At(TimeNs time_ns);

 private:
  const std::vector<TrackEnd>& ends_;
  const Revision from_;
  /// Of the next end that may count; those before are passed.
  size_t next_ = 0;
  TimeNs reached_ns_ = kTimeMin;
  Revision reached_at_ = 0;
};

/// A pose that [from, to) shows; both are revisions with a record, `to` may be kRevisionMax.
struct PoseLife {
  Revision from = 0;
  Revision to = 0;
  StoredPose pose;
};

/// Shows the ends of a track, then its pieces in the order of their first times. A piece has one
/// `to`, no gap in it, and no pose of another piece between its own that a revision shows together
/// with them.
///
/// Memory: the pieces of one gap's time.
class TrackStreamer {
 public:
  /// `ends` are those of EndsAtRecords. All must outlive this.
  TrackStreamer(const MapSpec* spec, NodeId agent, const std::vector<TrackEnd>* ends,
                const RowSink* sink)
      : spec_(*spec), agent_(agent), ends_(*ends), sink_(*sink) {}

  absl::Status ShowEnds() const;
  /// Requires: ascending times; of one time ascending revisions.
  absl::Status Add(PoseLife life);
  /// The last call.
  absl::Status Finish();

 private:
  struct Piece {
    Revision to;
    PieceClock clock;
    SegmentEncoder encoder;
    bool is_closed = false;
  };

  absl::Status Cut(const PoseLife& life);
  absl::Status ShowClosed();
  /// Of q and -q the one near the pose before; segments keep either.
  void AlignSign(StoredPose* pose);

  const MapSpec& spec_;
  const NodeId agent_;
  const std::vector<TrackEnd>& ends_;
  const RowSink& sink_;
  /// The last life, which the next may go on.
  std::optional<PoseLife> pending_;
  std::optional<StoredPose> before_;
  /// By first time and revision.
  std::map<std::pair<TimeNs, Revision>, Piece> pieces_;
};

/// The poses of a streamed piece. Errors: DATA_LOSS/STORE_CORRUPT, also for times that do not
/// ascend, or that lie outside of the map.
absl::StatusOr<std::vector<StoredPose>> PosesOfPiece(const MapSpec& spec, const StreamRow& row);

}  // namespace dsg
