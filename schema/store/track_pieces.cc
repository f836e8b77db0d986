// SPDX-License-Identifier: Apache-2.0
#include "schema/store/track_pieces.h"

#include <algorithm>

#include "schema/model/value_check.h"
#include "schema/store/commit_protocol.h"

namespace dsg {

Revision FirstFrom(const std::vector<Revision>& revisions, Revision revision) {
  const auto found = std::lower_bound(revisions.begin(), revisions.end(), revision);
  return found == revisions.end() ? kRevisionMax : *found;
}

std::vector<TrackEnd> EndsAtRecords(const std::vector<TrackEnd>& ends,
                                    const std::vector<Revision>& records) {
  std::vector<TrackEnd> at_records;
  for (size_t i = 0; i < ends.size(); ++i) {
    const Revision record = FirstFrom(records, ends[i].revision);
    const bool is_overtaken = i + 1 < ends.size() && ends[i + 1].revision <= record;
    if (record == kRevisionMax || is_overtaken) continue;
    const TrackEnd before = at_records.empty() ? TrackEnd() : at_records.back();
    const TimeNs last_ns = ends[i].pose_count == 0 ? kTimeMin : ends[i].last_ns;
    if (last_ns == before.last_ns && ends[i].pose_count == before.pose_count) continue;
    at_records.push_back({record, last_ns, ends[i].pose_count});
  }
  return at_records;
}

PieceClock::PieceClock(const std::vector<TrackEnd>* ends, Revision from)
    : ends_(*ends), from_(from), reached_at_(from) {
  const auto after = std::upper_bound(
      ends_.begin(), ends_.end(), from,
      [](Revision revision, const TrackEnd& end) { return revision < end.revision; });
  next_ = static_cast<size_t>(after - ends_.begin());
  if (next_ > 0) reached_ns_ = ends_[next_ - 1].last_ns;
}

Revision PieceClock::At(TimeNs time_ns) {
  while (reached_ns_ < time_ns) {
    if (next_ == ends_.size()) return kRevisionMax;
    reached_ns_ = ends_[next_].last_ns;
    reached_at_ = ends_[next_++].revision;
  }
  return reached_at_;
}

absl::Status TrackStreamer::ShowEnds() const {
  for (const TrackEnd& end : ends_) {
    DSG_RETURN_IF_ERROR(sink_(
        {row_kinds::kTrackEnd, {KeyOf(agent_), end.revision, end.last_ns, end.pose_count}, {}}));
  }
  return absl::OkStatus();
}

absl::Status TrackStreamer::Add(PoseLife life) {
  // No record shows it.
  if (life.from >= life.to) return absl::OkStatus();
  if (pending_.has_value()) {
    std::string identity;
    std::string scratch;
    identity = PoseIdentity(agent_, pending_->pose, spec_.codec, &scratch);
    // A backend may have written the pose anew beside one that was corrected.
    if (pending_->to == life.from &&
        identity == PoseIdentity(agent_, life.pose, spec_.codec, &scratch)) {
      pending_->to = life.to;
      return absl::OkStatus();
    }
    DSG_RETURN_IF_ERROR(Cut(*pending_));
  }
  pending_ = std::move(life);
  return absl::OkStatus();
}

absl::Status TrackStreamer::Finish() {
  if (pending_.has_value()) DSG_RETURN_IF_ERROR(Cut(*pending_));
  for (auto& [key, piece] : pieces_) piece.is_closed = true;
  return ShowClosed();
}

void TrackStreamer::AlignSign(StoredPose* pose) {
  // Segments begin after a gap, and keep the sign of their first pose.
  const bool is_free = spec_.codec != TrajectoryCodec::kQuantized || !before_.has_value() ||
                       pose->time_ns - before_->time_ns > spec_.gap_ns_max;
  if (is_free) return;
  double dot = 0.0;
  for (size_t c = 3; c < 7; ++c) {
    dot += static_cast<double>(before_->columns[c]) * static_cast<double>(pose->columns[c]);
  }
  // At a right angle neither is nearer: the first component that is not 0 shall be positive.
  if (dot == 0.0) {
    const auto first = std::find_if(pose->columns.begin() + 3, pose->columns.end(),
                                    [](int64_t component) { return component != 0; });
    dot = first != pose->columns.end() && *first < 0 ? -1.0 : 1.0;
  }
  if (dot < 0.0) {
    for (size_t c = 3; c < 7; ++c) pose->columns[c] = -pose->columns[c];
  }
}

absl::Status TrackStreamer::Cut(const PoseLife& life) {
  StoredPose pose = life.pose;
  AlignSign(&pose);
  before_ = pose;
  bool is_joined = false;
  for (auto& [key, piece] : pieces_) {
    if (piece.is_closed) continue;
    const TimeNs last_ns = piece.encoder.poses().back().time_ns;
    const bool is_gap = pose.time_ns - last_ns > spec_.gap_ns_max;
    const bool is_apart = life.to <= key.second || piece.to <= life.from;
    if (is_apart && !is_gap) continue;
    // Where the track had reached further before, a reader would take the pose for an older one.
    const bool joins = !is_joined && !is_gap && piece.to == life.to &&
                       piece.clock.At(pose.time_ns) == life.from && piece.encoder.Add(pose);
    is_joined |= joins;
    piece.is_closed = !joins;
  }
  if (!is_joined) {
    Piece piece{life.to, PieceClock(&ends_, life.from), SegmentEncoder(spec_.codec)};
    piece.encoder.Add(pose);
    pieces_.emplace(std::make_pair(pose.time_ns, life.from), std::move(piece));
  }
  return ShowClosed();
}

absl::Status TrackStreamer::ShowClosed() {
  for (auto it = pieces_.begin(); it != pieces_.end() && it->second.is_closed;) {
    DSG_RETURN_IF_ERROR(sink_({row_kinds::kPoses,
                               {KeyOf(agent_), it->first.second, it->second.to},
                               {it->second.encoder.Encode()}}));
    it = pieces_.erase(it);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<StoredPose>> PosesOfPiece(const MapSpec& spec, const StreamRow& row) {
  std::vector<StoredPose> poses;
  const auto reader = SegmentReader::Parse(row.texts[0]);
  if (reader == nullptr || reader->codec() != spec.codec || !reader->DecodeAll(&poses)) {
    return BadRowError(spec.name, row, "holds no poses");
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    DSG_RETURN_IF_ERROR(CheckTimeInMap(poses[i].time_ns, spec));
    const bool is_sound = (i == 0 || poses[i - 1].time_ns < poses[i].time_ns) &&
                          values::IsSane(PositionOf(poses[i], spec.codec));
    if (!is_sound) return BadRowError(spec.name, row, "has poses out of order or out of space");
  }
  return poses;
}

}  // namespace dsg
