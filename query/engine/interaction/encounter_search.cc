// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/encounter_search.h"

#include <algorithm>
#include <map>
#include <utility>

#include "schema/base/status.h"

namespace dsg::query {
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
