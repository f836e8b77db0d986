// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/person_tracker.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "ingest/agents/tracking/association.h"
#include "ingest/agents/tracking/find_again.h"
#include "ingest/agents/tracking/track_entry.h"
#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

bool IsOpen(TrackState state) {
  return state == TrackState::kTentative || state == TrackState::kConfirmed ||
         state == TrackState::kLost;
}

// The order in which a log happens to list an image's detections must not matter.
bool ComesBefore(const PersonObservation& a, const PersonObservation& b) {
  if (a.detection_id != b.detection_id) return a.detection_id < b.detection_id;
  const Eigen::Vector3d& at = a.map_T_torso.position;
  const Eigen::Vector3d& other = b.map_T_torso.position;
  return std::lexicographical_compare(at.data(), at.data() + 3, other.data(), other.data() + 3);
}

}  // namespace

std::string_view ToString(TrackState state) {
  switch (state) {
    case TrackState::kTentative:
      return "tentative";
    case TrackState::kConfirmed:
      return "confirmed";
    case TrackState::kLost:
      return "lost";
    case TrackState::kClosed:
      return "closed";
    case TrackState::kDropped:
      return "dropped";
  }
  return "unknown";
}

class PersonTracker::Impl {
 public:
  Impl(const TrackerOptions& options, const std::string& spill_folder)
      : options_(options),
        shapes_(options.shape_noise_sigma, options.shape_spread_sigma, options.shape_prior),
        file_(spill_folder) {}

  bool Observe(TimeNs time_ns, std::vector<PersonObservation> observations);
  void Finish();
  void Move(const TrajectoryChange& change);
  std::vector<TrackChange> TakeChanges();
  const Track& track(int64_t id) const;
  std::vector<int64_t> TakeClosed() { return std::exchange(closed_, {}); }
  const absl::Status& status() const { return status_; }
  void ForgetShapes(int64_t id, size_t first);
  TrackerCounts counts() const { return counts_; }

 private:
  std::vector<SeenPerson> Prepare(std::vector<PersonObservation> observations);
  /// Free tracks in one of the two states, ascending.
  std::vector<TrackEntry*> FreeTracks(TrackState state, TrackState or_state) const;
  /// Gives observations to `tracks` and takes them out of `seen`.
  void Associate(const std::vector<TrackEntry*>& tracks, std::vector<SeenPerson>* seen);
  /// The free track that somebody surely is.
  TrackEntry* FindSure(const SeenPerson& seen) const;
  bool IsDuplicate(const SeenPerson& seen) const;
  void Open(SeenPerson seen);
  void PlaceRest(std::vector<SeenPerson> seen);
  void AddTo(TrackEntry* track, const SeenPerson& seen);
  void Revive(TrackEntry* track);
  void ConfirmTracks();
  /// As a new person, or as the going-on of another track: then the track is gone.
  void Confirm(TrackEntry* track);
  void Age();
  void Close(TrackEntry* track);
  void Drop(TrackEntry* track);
  void SetState(TrackEntry* track, TrackState state);
  void PutAwayOld();
  /// Of the track that was fetched last, unless it is `wanted`.
  void LetGo(const TrackEntry* wanted) const;

  const TrackerOptions options_;
  ShapeStatistics shapes_;
  std::map<int64_t, std::unique_ptr<TrackEntry>> entries_;
  /// Those that may still get observations: open, or closed and young enough to be found again.
  std::set<int64_t> living_;
  std::set<int64_t> touched_;
  /// Closed for good, and not told of since.
  std::set<int64_t> old_;
  /// Those of them that went to disk since TakeClosed.
  std::vector<int64_t> closed_;
  SpillFile file_;
  mutable TrackEntry* fetched_ = nullptr;
  mutable absl::Status status_;
  std::optional<TimeNs> now_ns_;
  int64_t next_id_ = 1;
  TrackerCounts counts_;
};

bool PersonTracker::Impl::Observe(TimeNs time_ns, std::vector<PersonObservation> observations) {
  if (now_ns_.has_value() && time_ns < *now_ns_) {
    ++counts_.refused_image_count;
    return false;
  }
  now_ns_ = time_ns;
  // Before the observations: a track that was closed in the meantime is asked by shape only.
  Age();
  std::vector<SeenPerson> seen = Prepare(std::move(observations));
  Associate(FreeTracks(TrackState::kConfirmed, TrackState::kLost), &seen);
  Associate(FreeTracks(TrackState::kTentative, TrackState::kTentative), &seen);
  PlaceRest(std::move(seen));
  ConfirmTracks();
  return true;
}

std::vector<SeenPerson> PersonTracker::Impl::Prepare(std::vector<PersonObservation> observations) {
  std::vector<SeenPerson> seen;
  std::sort(observations.begin(), observations.end(), ComesBefore);
  for (PersonObservation& observation : observations) {
    ++counts_.observation_count;
    if (!IsTrackable(observation, options_)) {
      ++counts_.unusable_count;
      continue;
    }
    observation.time_ns = *now_ns_;
    seen.push_back(MakeSeen(std::move(observation)));
  }
  return seen;
}

std::vector<TrackEntry*> PersonTracker::Impl::FreeTracks(TrackState state,
                                                         TrackState or_state) const {
  std::vector<TrackEntry*> out;
  for (const int64_t id : living_) {
    TrackEntry* const track = entries_.at(id).get();
    if (track->state() != state && track->state() != or_state) continue;
    // Another camera saw it at the same stamp.
    if (track->last_ns() >= *now_ns_) continue;
    out.push_back(track);
  }
  return out;
}

void PersonTracker::Impl::Associate(const std::vector<TrackEntry*>& tracks,
                                    std::vector<SeenPerson>* seen) {
  const std::vector<int> track_of = options_.is_first_consistent
                                        ? AssignFirst(tracks, *seen, *now_ns_, options_)
                                        : AssignAll(tracks, *seen, *now_ns_, shapes_, options_);
  std::vector<SeenPerson> rest;
  for (size_t i = 0; i < seen->size(); ++i) {
    SeenPerson& person = (*seen)[i];
    if (track_of[i] < 0) {
      rest.push_back(std::move(person));
      continue;
    }
    TrackEntry* const track = tracks[static_cast<size_t>(track_of[i])];
    if (person.shape.count > 0) shapes_.LearnNoise(track->shape(), person.shape.sum);
    AddTo(track, person);
  }
  *seen = std::move(rest);
}

void PersonTracker::Impl::PlaceRest(std::vector<SeenPerson> seen) {
  for (SeenPerson& person : seen) {
    if (TrackEntry* const track = FindSure(person); track != nullptr) {
      if (track->was_confirmed()) ++counts_.found_again_count;
      AddTo(track, person);
    } else if (IsDuplicate(person)) {
      ++counts_.duplicate_count;
    } else if (person.observation.is_weak) {
      ++counts_.weak_unused_count;
    } else {
      Open(std::move(person));
    }
  }
}

TrackEntry* PersonTracker::Impl::FindSure(const SeenPerson& seen) const {
  if (options_.is_first_consistent) return nullptr;
  std::vector<const TrackEntry*> earlier;
  for (const int64_t id : living_) earlier.push_back(entries_.at(id).get());
  const std::vector<SameAs> found =
      FindAgain({*now_ns_, &seen.skeleton, &seen.shape}, earlier, shapes_, options_);
  if (found.empty() || found.front().probability < options_.again_at_once_probability_min)
    return nullptr;
  return entries_.at(found.front().earlier_track).get();
}

bool PersonTracker::Impl::IsDuplicate(const SeenPerson& seen) const {
  // People do stand so near to each other; without a shape nothing tells them from a second box.
  if (options_.is_first_consistent || seen.shape.count == 0) return false;
  return std::any_of(living_.begin(), living_.end(), [&](int64_t id) {
    const TrackEntry& track = *entries_.at(id);
    return track.last_ns() == *now_ns_ && track.shape().count > 0 &&
           (track.track().observations.back().map_T_torso.position - seen.skeleton.torso).norm() <=
               options_.duplicate_m &&
           shapes_.SquaredDistance(track.shape(), seen.shape) <= options_.shape_gate;
  });
}

void PersonTracker::Impl::Open(SeenPerson seen) {
  const int64_t id = next_id_++;
  TrackEntry* const track =
      entries_.emplace(id, std::make_unique<TrackEntry>(id, options_)).first->second.get();
  living_.insert(id);
  track->Add(seen);
}

void PersonTracker::Impl::AddTo(TrackEntry* track, const SeenPerson& seen) {
  track->Add(seen);
  Revive(track);
}

void PersonTracker::Impl::Revive(TrackEntry* track) {
  if (track->was_confirmed()) SetState(track, TrackState::kConfirmed);
  touched_.insert(track->track().id);
}

void PersonTracker::Impl::ConfirmTracks() {
  // Confirming erases tracks that turn out to be others.
  const std::vector<int64_t> ids(living_.begin(), living_.end());
  for (const int64_t id : ids) {
    TrackEntry* const track = entries_.at(id).get();
    if (track->state() == TrackState::kTentative && track->IsConfirmable(*now_ns_)) Confirm(track);
  }
}

void PersonTracker::Impl::Confirm(TrackEntry* track) {
  std::vector<SameAs> found;
  if (!options_.is_first_consistent) {
    std::vector<const TrackEntry*> earlier;
    for (const int64_t id : living_) {
      if (entries_.at(id)->was_confirmed()) earlier.push_back(entries_.at(id).get());
    }
    found = FindAgain({track->first_ns(), &track->skeleton(), &track->shape()}, earlier, shapes_,
                      options_);
  }
  if (!found.empty() && found.front().probability >= options_.again_probability_min) {
    TrackEntry* const same = entries_.at(found.front().earlier_track).get();
    same->Absorb(track);
    Revive(same);
    ++counts_.found_again_count;
    living_.erase(track->track().id);
    entries_.erase(track->track().id);
    return;
  }
  counts_.same_as_count += std::ssize(found);
  ++counts_.track_count;
  track->mutable_track()->same_as = std::move(found);
  shapes_.LearnSpread(track->shape());
  SetState(track, TrackState::kConfirmed);
}

void PersonTracker::Impl::Age() {
  const std::vector<int64_t> ids(living_.begin(), living_.end());
  for (const int64_t id : ids) {
    TrackEntry* const track = entries_.at(id).get();
    const TimeNs unseen_ns = *now_ns_ - track->last_ns();
    if (track->state() == TrackState::kTentative) {
      if (unseen_ns > options_.confirm_ns) Drop(track);
      continue;
    }
    if (track->state() == TrackState::kConfirmed && unseen_ns > options_.confirm_ns) {
      SetState(track, TrackState::kLost);
    }
    if (track->state() == TrackState::kLost && unseen_ns > options_.close_ns) Close(track);
    if (unseen_ns > options_.again_ns && !IsOpen(track->state())) {
      living_.erase(id);
      old_.insert(id);
    }
  }
}

void PersonTracker::Impl::Close(TrackEntry* track) {
  track->Smooth();
  SetState(track, TrackState::kClosed);
}

void PersonTracker::Impl::Drop(TrackEntry* track) {
  SetState(track, TrackState::kDropped);
  living_.erase(track->track().id);
  old_.insert(track->track().id);
  ++counts_.dropped_track_count;
}

void PersonTracker::Impl::SetState(TrackEntry* track, TrackState state) {
  track->SetState(state);
  touched_.insert(track->track().id);
}

void PersonTracker::Impl::Finish() {
  const std::vector<int64_t> ids(living_.begin(), living_.end());
  for (const int64_t id : ids) {
    TrackEntry* const track = entries_.at(id).get();
    if (track->state() == TrackState::kTentative) {
      Drop(track);
    } else if (IsOpen(track->state())) {
      Close(track);
    }
  }
  living_.clear();
}

void PersonTracker::Impl::Move(const TrajectoryChange& change) {
  for (auto& [id, entry] : entries_) {
    if (entry->state() == TrackState::kDropped) continue;
    LetGo(nullptr);
    const bool is_away = entry->is_away();
    if (is_away) status_.Update(entry->Fetch(file_));
    entry->Move(change);
    if (is_away) status_.Update(entry->PutAway(&file_));
    touched_.insert(id);
  }
}

// What is asked of a track when it is told was asked after the last call of TakeChanges.
void PersonTracker::Impl::PutAwayOld() {
  for (const int64_t id : std::exchange(old_, {})) {
    if (touched_.contains(id)) {
      old_.insert(id);
      continue;
    }
    const auto entry = entries_.find(id);
    if (entry == entries_.end()) continue;
    if (entry->second->state() == TrackState::kDropped) {
      // Nobody was there, and it was told.
      entries_.erase(entry);
    } else if (status_.ok()) {
      status_ = entry->second->PutAway(&file_);
      closed_.push_back(id);
    }
  }
}

void PersonTracker::Impl::LetGo(const TrackEntry* wanted) const {
  if (fetched_ == nullptr || fetched_ == wanted) return;
  fetched_->LetGo();
  fetched_ = nullptr;
}

std::vector<TrackChange> PersonTracker::Impl::TakeChanges() {
  LetGo(nullptr);
  PutAwayOld();
  std::vector<TrackChange> changes;
  for (const int64_t id : touched_) {
    const auto found = entries_.find(id);
    if (found == entries_.end()) continue;
    if (std::optional<TrackChange> change = found->second->TakeChange(); change.has_value()) {
      changes.push_back(*change);
    }
  }
  touched_.clear();
  return changes;
}

void PersonTracker::Impl::ForgetShapes(int64_t id, size_t first) {
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return;
  std::vector<PersonObservation>& seen = entry->second->mutable_track()->observations;
  for (size_t i = first; i < seen.size(); ++i) {
    for (std::vector<float>* part :
         {&seen[i].vertices_torso, &seen[i].pose_coefficients, &seen[i].shape_coefficients}) {
      std::vector<float>().swap(*part);
    }
  }
}

const PersonTracker::Track& PersonTracker::Impl::track(int64_t id) const {
  const auto found = entries_.find(id);
  DSG_CHECK(found != entries_.end());
  TrackEntry* const entry = found->second.get();
  LetGo(entry);
  if (entry->is_away()) {
    status_.Update(entry->Fetch(file_));
    fetched_ = entry;
  }
  return entry->track();
}

PersonTracker::PersonTracker(const TrackerOptions& options, const std::string& spill_folder)
    : impl_(std::make_unique<Impl>(options, spill_folder)) {}
PersonTracker::~PersonTracker() = default;

bool PersonTracker::Observe(TimeNs time_ns, std::vector<PersonObservation> observations) {
  return impl_->Observe(time_ns, std::move(observations));
}

void PersonTracker::Finish() { impl_->Finish(); }

void PersonTracker::Move(const TrajectoryChange& change) { impl_->Move(change); }

std::vector<TrackChange> PersonTracker::TakeChanges() { return impl_->TakeChanges(); }

const PersonTracker::Track& PersonTracker::track(int64_t id) const { return impl_->track(id); }

std::vector<int64_t> PersonTracker::TakeClosed() { return impl_->TakeClosed(); }

const absl::Status& PersonTracker::status() const { return impl_->status(); }

void PersonTracker::ForgetShapes(int64_t id, size_t first) { impl_->ForgetShapes(id, first); }

TrackerCounts PersonTracker::counts() const { return impl_->counts(); }

}  // namespace dsg::ingest
