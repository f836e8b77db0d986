// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/encounters.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "schema/base/status.h"
#include "schema/model/geometry.h"

namespace dsg::query {
namespace {

constexpr size_t kPointsPerPiece = 32;

// Both paths straight: from_ns to to_ns, and where each is at the ends.
struct Stretch {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Eigen::Vector3d a_from, a_to, b_from, b_to;

  double length_ns() const { return static_cast<double>(TimeApart(from_ns, to_ns)); }
  TimeNs TimeAt(double fraction) const {
    return from_ns + static_cast<TimeNs>(std::ceil(fraction * length_ns()));
  }
};

// Part of [0, 1] on which |start + u * (end - start)| < limit.
std::optional<std::pair<double, double>> PartBelow(const Eigen::Vector3d& start,
                                                   const Eigen::Vector3d& end, double limit) {
  const Eigen::Vector3d change = end - start;
  const double a = change.squaredNorm();
  const double half_b = start.dot(change);
  const double c = start.squaredNorm() - limit * limit;
  if (a == 0.0) {
    if (c < 0.0) return std::pair(0.0, 1.0);
    return std::nullopt;
  }
  const double discriminant = half_b * half_b - a * c;
  if (discriminant <= 0.0) return std::nullopt;
  // The root without cancellation first, the other one from the product of both.
  const double q = -(half_b + std::copysign(std::sqrt(discriminant), half_b));
  double low = q / a;
  double high = q != 0.0 ? c / q : -low;
  if (low > high) std::swap(low, high);
  // The ends decide by their own values, so that neighbouring stretches agree.
  low = c < 0.0 ? 0.0 : std::max(low, 0.0);
  high = end.squaredNorm() - limit * limit < 0.0 ? 1.0 : std::min(high, 1.0);
  if (low >= high) return std::nullopt;
  return std::pair(low, high);
}

void MeetOnStretch(const Stretch& stretch, double limit, std::vector<Meeting>* out) {
  const Eigen::Vector3d start = stretch.b_from - stretch.a_from;
  const Eigen::Vector3d end = stretch.b_to - stretch.a_to;
  const Eigen::Vector3d change = end - start;
  const auto part = PartBelow(start, end, limit);
  if (!part.has_value()) return;
  Meeting meeting;
  meeting.during = {stretch.TimeAt(part->first),
                    part->second >= 1.0 ? stretch.to_ns : stretch.TimeAt(part->second)};
  if (meeting.during.from_ns >= meeting.during.to_ns) return;
  const double a = change.squaredNorm();
  const double best = a > 0.0 ? std::clamp(-start.dot(change) / a, part->first, part->second) : 0.0;
  meeting.distance_m_min = (start + best * change).norm();
  const auto after = static_cast<TimeNs>(std::llround(best * stretch.length_ns()));
  meeting.closest_ns =
      std::clamp(stretch.from_ns + after, meeting.during.from_ns, meeting.during.to_ns - 1);
  const Eigen::Vector3d a_best = stretch.a_from + best * (stretch.a_to - stretch.a_from);
  meeting.middle_map = a_best + 0.5 * (start + best * change);
  JoinMeeting(meeting, out);
}

// Index of the last point at or before `at_ns`, 0 if there is none.
size_t StartAt(const TrackPath& path, TimeNs at_ns) {
  const auto after =
      std::upper_bound(path.points.begin(), path.points.end(), at_ns,
                       [](TimeNs time_ns, const TrackPoint& p) { return time_ns < p.time_ns; });
  return after == path.points.begin() ? 0 : static_cast<size_t>(after - path.points.begin()) - 1;
}

struct Piece {
  int32_t path = 0;
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Box3d box_map;
};

void AppendPieces(const TrackPath& path, int32_t index, const Interval& during,
                  std::vector<Piece>* pieces) {
  for (size_t begin = 0; begin + 1 < path.points.size(); begin += kPointsPerPiece) {
    const size_t end = std::min(begin + kPointsPerPiece, path.points.size() - 1);
    Piece piece{index, std::max(path.points[begin].time_ns, during.from_ns),
                std::min(path.points[end].time_ns, during.to_ns), Box3d()};
    if (piece.from_ns >= piece.to_ns) continue;
    for (size_t i = begin; i <= end; ++i) piece.box_map.extend(path.points[i].position_map);
    pieces->push_back(piece);
  }
}

}  // namespace

void JoinMeeting(const Meeting& next, std::vector<Meeting>* meetings) {
  if (meetings->empty() || meetings->back().during.to_ns < next.during.from_ns) {
    meetings->push_back(next);
    return;
  }
  Meeting& last = meetings->back();
  last.during.to_ns = next.during.to_ns;
  if (next.distance_m_min >= last.distance_m_min) return;
  last.distance_m_min = next.distance_m_min;
  last.closest_ns = next.closest_ns;
  last.middle_map = next.middle_map;
}

std::vector<Meeting> FindMeetings(const TrackPath& a, const TrackPath& b, const Interval& during,
                                  double distance_m) {
  std::vector<Meeting> meetings;
  size_t i = StartAt(a, during.from_ns);
  size_t j = StartAt(b, during.from_ns);
  while (i + 1 < a.points.size() && j + 1 < b.points.size()) {
    const TrackPoint& a_next = a.points[i + 1];
    const TrackPoint& b_next = b.points[j + 1];
    Stretch stretch;
    stretch.from_ns = std::max({a.points[i].time_ns, b.points[j].time_ns, during.from_ns});
    stretch.to_ns = std::min({a_next.time_ns, b_next.time_ns, during.to_ns});
    if (stretch.from_ns >= during.to_ns) break;
    if (stretch.from_ns < stretch.to_ns && a.IsJoined(i) && b.IsJoined(j)) {
      stretch.a_from = PositionBetween(a.points[i], a_next, stretch.from_ns);
      stretch.a_to = PositionBetween(a.points[i], a_next, stretch.to_ns);
      stretch.b_from = PositionBetween(b.points[j], b_next, stretch.from_ns);
      stretch.b_to = PositionBetween(b.points[j], b_next, stretch.to_ns);
      MeetOnStretch(stretch, distance_m, &meetings);
    }
    const TimeNs step_ns = std::min(a_next.time_ns, b_next.time_ns);
    if (a_next.time_ns == step_ns) ++i;
    if (b_next.time_ns == step_ns) ++j;
  }
  return meetings;
}

std::vector<MeetingCandidate> FindCandidates(const std::vector<TrackPath>& paths,
                                             const Interval& during, double distance_m, int only) {
  std::vector<Piece> pieces;
  for (size_t i = 0; i < paths.size(); ++i) {
    AppendPieces(paths[i], static_cast<int32_t>(i), during, &pieces);
  }
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.from_ns < b.from_ns; });
  std::vector<MeetingCandidate> found;
  std::vector<const Piece*> open;
  for (const Piece& piece : pieces) {
    std::erase_if(open, [&](const Piece* other) { return other->to_ns <= piece.from_ns; });
    for (const Piece* other : open) {
      if (other->path == piece.path) continue;
      if (only >= 0 && piece.path != only && other->path != only) continue;
      if (piece.box_map.exteriorDistance(other->box_map) >= distance_m) continue;
      const auto [first, second] = std::minmax(piece.path, other->path);
      found.push_back({first, second, {piece.from_ns, std::min(piece.to_ns, other->to_ns)}});
    }
    open.push_back(&piece);
  }
  std::sort(found.begin(), found.end(), [](const MeetingCandidate& a, const MeetingCandidate& b) {
    return std::tuple(a.first, a.second, a.during.from_ns) <
           std::tuple(b.first, b.second, b.during.from_ns);
  });
  return found;
}

namespace {

// Walls are looked for at multiples of this, so that slices and pages see the same instants.
constexpr TimeNs kSightStepNs = kNsPerSecond / 10;
constexpr TimeNs kSightExactNs = kNsPerSecond / 1000;
// Tracks of robots and of people without bodies lie on the floor, which is no wall between them.
const Eigen::Vector3d kSightAbove(0.0, 0.0, 0.3);

TimeNs StepAtOrBefore(TimeNs time_ns) {
  TimeNs rest = time_ns % kSightStepNs;
  if (rest < 0) rest += kSightStepNs;
  return AddTime(time_ns, -rest);
}

const TrackPoint* PointBefore(const TrackPath& path, TimeNs at_ns) {
  const auto after =
      std::upper_bound(path.points.begin(), path.points.end(), at_ns,
                       [](TimeNs time_ns, const TrackPoint& p) { return time_ns < p.time_ns; });
  return after == path.points.begin() ? nullptr : &*(after - 1);
}

Eigen::Vector3d PositionAt(const TrackPath& path, TimeNs at_ns) {
  const TrackPoint* before = PointBefore(path, at_ns);
  if (before == nullptr) return path.points.front().position_map;
  if (before == &path.points.back()) return before->position_map;
  return PositionBetween(*before, *(before + 1), at_ns);
}

// The parts of a meeting during which the two saw each other, joined over short times out of sight.
class SightCutter {
 public:
  SightCutter(const EncounterQuestion& question, const TrackPath& a, const TrackPath& b)
      : sight_(*question.sight),
        gap_ns_max_(question.sight_gap_ns_max),
        distance_m_(question.distance_m),
        a_(a),
        b_(b) {}

  // `near_from_ns`: since when the two have been near without interruption.
  absl::Status Cut(const Meeting& meeting, TimeNs near_from_ns, const StopCheck& stop,
                   std::vector<Meeting>* out) {
    near_from_ns_ = near_from_ns;
    const Interval& all = meeting.during;
    TimeNs from_ns = all.from_ns;
    DSG_ASSIGN_OR_RETURN(bool is_clear, IsClearAt(from_ns));
    TimeNs clear_from_ns = from_ns;
    int step_count = 0;
    while (from_ns < all.to_ns) {
      if (stop && ++step_count % 64 == 0) DSG_RETURN_IF_ERROR(stop());
      const TimeNs to_ns = std::min(all.to_ns, AddTime(StepAtOrBefore(from_ns), kSightStepNs));
      DSG_ASSIGN_OR_RETURN(const bool is_clear_next, IsClearAt(to_ns));
      if (is_clear != is_clear_next) {
        DSG_ASSIGN_OR_RETURN(const TimeNs change_ns, FindChange(from_ns, to_ns, is_clear));
        if (is_clear) Keep({clear_from_ns, change_ns}, out);
        clear_from_ns = change_ns;
        is_clear = is_clear_next;
      }
      from_ns = to_ns;
    }
    if (is_clear) Keep({clear_from_ns, all.to_ns}, out);
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<bool> IsClearAt(TimeNs at_ns) {
    return sight_.IsClear(PositionAt(a_, at_ns) + kSightAbove, PositionAt(b_, at_ns) + kSightAbove,
                          at_ns);
  }

  absl::StatusOr<TimeNs> FindChange(TimeNs from_ns, TimeNs to_ns, bool is_clear_first) {
    while (to_ns - from_ns > kSightExactNs) {
      const TimeNs middle_ns = from_ns + (to_ns - from_ns) / 2;
      DSG_ASSIGN_OR_RETURN(const bool is_clear, IsClearAt(middle_ns));
      (is_clear == is_clear_first ? from_ns : to_ns) = middle_ns;
    }
    return to_ns;
  }

  void Keep(const Interval& during, std::vector<Meeting>* out) const {
    for (Meeting& part : FindMeetings(a_, b_, during, distance_m_)) {
      if (!out->empty()) {
        const TimeNs lost_ns = out->back().during.to_ns;
        const bool was_near = lost_ns > near_from_ns_;
        if (was_near &&
            TimeApart(lost_ns, part.during.from_ns) <= static_cast<uint64_t>(gap_ns_max_)) {
          part.during.from_ns = lost_ns;
        }
      }
      JoinMeeting(part, out);
    }
  }

  Sight& sight_;
  const TimeNs gap_ns_max_;
  const double distance_m_;
  const TrackPath& a_;
  const TrackPath& b_;
  TimeNs near_from_ns_ = kTimeMin;
};

class Search {
 public:
  Search(const Snapshot& snapshot, const EncounterQuestion& question, const StopCheck& stop)
      : snapshot_(snapshot), question_(question), stop_(stop) {}

  absl::StatusOr<std::vector<FoundEncounter>> Run() {
    DSG_RETURN_IF_ERROR(ChooseTracks());
    TimeNs from_ns = question_.during.from_ns;
    // What ended before the last page's last entry began is on an earlier page.
    if (question_.after.from_ns > from_ns) {
      const TimeNs seen_ns = AddTime(question_.after.from_ns, -GapNs());
      from_ns = std::max(from_ns, StepAtOrBefore(AddTime(seen_ns, -kSightStepNs)));
    }
    from_ns = std::max(from_ns, first_ns_);
    const TimeNs to_ns = std::min(question_.during.to_ns, AddTime(last_ns_, 1));
    while (from_ns < to_ns) {
      const TimeNs slice_to_ns = std::min(to_ns, AddTime(StepAtOrBefore(from_ns), slice_ns_));
      DSG_RETURN_IF_ERROR(SearchSlice({from_ns, slice_to_ns}));
      from_ns = slice_to_ns;
      if (IsEnough(from_ns)) break;
    }
    return Chosen();
  }

 private:
  absl::Status ChooseTracks() {
    DSG_ASSIGN_OR_RETURN(tracks_, snapshot_.Tracks(stop_));
    std::erase_if(tracks_, [&](const TrackInfo& track) {
      if (track.pose_count == 0) return true;
      return !question_.agent.empty() && !question_.other.empty() &&
             track.agent != question_.agent && track.agent != question_.other;
    });
    // Tracks() ascends by id, so indices compare as ids do.
    double poses_per_ns = 0.0;
    first_ns_ = kTimeMax;
    for (size_t i = 0; i < tracks_.size(); ++i) {
      const TrackInfo& track = tracks_[i];
      if (track.agent == question_.agent) only_ = static_cast<int>(i);
      first_ns_ = std::min(first_ns_, track.first_ns);
      last_ns_ = std::max(last_ns_, track.last_ns);
      poses_per_ns += static_cast<double>(track.pose_count) /
                      (static_cast<double>(TimeApart(track.first_ns, track.last_ns)) + 1.0);
    }
    if (!question_.agent.empty() && only_ < 0) tracks_.clear();
    if (tracks_.empty()) last_ns_ = first_ns_ = kTimeMin;
    if (poses_per_ns <= 0.0) return absl::OkStatus();
    const double span_ns =
        std::min(1e18, static_cast<double>(question_.slice_pose_count) / poses_per_ns);
    slice_ns_ = std::max(kSightStepNs, StepAtOrBefore(static_cast<TimeNs>(span_ns)));
    return absl::OkStatus();
  }

  absl::Status SearchSlice(const Interval& slice) {
    std::vector<TrackPath> paths;
    for (const TrackInfo& track : tracks_) {
      DSG_ASSIGN_OR_RETURN(paths.emplace_back(),
                           ReadTrackPath(snapshot_, track, slice.from_ns, slice.to_ns, stop_));
    }
    const std::vector<MeetingCandidate> candidates =
        FindCandidates(paths, slice, question_.distance_m, only_);
    size_t count = 0;
    for (size_t i = 0; i < candidates.size();) {
      const auto pair = std::pair(candidates[i].first, candidates[i].second);
      const TrackPath& a = paths[static_cast<size_t>(pair.first)];
      const TrackPath& b = paths[static_cast<size_t>(pair.second)];
      std::vector<Meeting> meetings;
      for (; i < candidates.size() && std::pair(candidates[i].first, candidates[i].second) == pair;
           ++i) {
        if (stop_ && ++count % 64 == 0) DSG_RETURN_IF_ERROR(stop_());
        const auto found = FindMeetings(a, b, candidates[i].during, question_.distance_m);
        for (const Meeting& meeting : found) JoinMeeting(meeting, &meetings);
      }
      std::vector<Meeting>& kept = found_[pair];
      Interval& near = near_[pair];
      for (const Meeting& meeting : meetings) {
        if (question_.sight == nullptr) {
          JoinMeeting(meeting, &kept);
          continue;
        }
        if (near.to_ns != meeting.during.from_ns) near.from_ns = meeting.during.from_ns;
        near.to_ns = meeting.during.to_ns;
        SightCutter cutter(question_, a, b);
        DSG_RETURN_IF_ERROR(cutter.Cut(meeting, near.from_ns, stop_, &kept));
      }
    }
    return absl::OkStatus();
  }

  // What ended no longer ago than this may still go on.
  TimeNs GapNs() const { return question_.sight == nullptr ? 0 : question_.sight_gap_ns_max; }

  bool IsChosen(const FoundEncounter& encounter) const {
    return encounter.key() > question_.after &&
           TimeApart(encounter.meeting.during.from_ns, encounter.meeting.during.to_ns) >=
               static_cast<uint64_t>(question_.duration_ns_min);
  }

  // Whether those found so far that can no longer change fill the page, and nothing that still can
  // comes before them.
  bool IsEnough(TimeNs until_ns) const {
    if (question_.count == 0) return false;
    std::vector<TimeNs> closed;
    TimeNs open_from_ns = kTimeMax;
    for (const auto& [pair, meetings] : found_) {
      for (const Meeting& meeting : meetings) {
        if (AddTime(meeting.during.to_ns, GapNs()) >= until_ns) {
          open_from_ns = std::min(open_from_ns, meeting.during.from_ns);
        } else if (IsChosen(Encounter(pair, meeting))) {
          closed.push_back(meeting.during.from_ns);
        }
      }
    }
    const auto early_count = std::count_if(closed.begin(), closed.end(),
                                           [&](TimeNs from_ns) { return from_ns < open_from_ns; });
    return static_cast<size_t>(early_count) >= question_.count;
  }

  FoundEncounter Encounter(const std::pair<int32_t, int32_t>& pair, const Meeting& meeting) const {
    return {tracks_[static_cast<size_t>(pair.first)].agent,
            tracks_[static_cast<size_t>(pair.second)].agent, meeting};
  }

  std::vector<FoundEncounter> Chosen() const {
    std::vector<FoundEncounter> chosen;
    for (const auto& [pair, meetings] : found_) {
      for (const Meeting& meeting : meetings) {
        FoundEncounter encounter = Encounter(pair, meeting);
        if (IsChosen(encounter)) chosen.push_back(std::move(encounter));
      }
    }
    std::sort(chosen.begin(), chosen.end(),
              [](const FoundEncounter& a, const FoundEncounter& b) { return a.key() < b.key(); });
    return chosen;
  }

  const Snapshot& snapshot_;
  const EncounterQuestion& question_;
  const StopCheck& stop_;
  std::vector<TrackInfo> tracks_;
  int only_ = -1;
  TimeNs first_ns_ = kTimeMin;
  TimeNs last_ns_ = kTimeMin;
  TimeNs slice_ns_ = kNsPerSecond;
  std::map<std::pair<int32_t, int32_t>, std::vector<Meeting>> found_;
  // The last time during which a pair was near, in sight or not.
  std::map<std::pair<int32_t, int32_t>, Interval> near_;
};

}  // namespace

absl::StatusOr<std::vector<FoundEncounter>> FindEncounters(const Snapshot& snapshot,
                                                           const EncounterQuestion& question,
                                                           const StopCheck& stop) {
  return Search(snapshot, question, stop).Run();
}

}  // namespace dsg::query
