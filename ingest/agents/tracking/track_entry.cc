// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/track_entry.h"

#include <algorithm>
#include <utility>

#include "ingest/agents/estimation/torso_terms.h"
#include "ingest/agents/tracking/track_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

std::vector<float> ToFloats(const ShapeVector& shape) {
  std::vector<float> out;
  for (int i = 0; i < kShapeCount; ++i) out.push_back(static_cast<float>(shape[i]));
  return out;
}

// Half a person tells less of where the torso is.
PersonObservation Weighed(PersonObservation observation, const TrackerOptions& options) {
  if (observation.is_weak) {
    observation.position_covariance_map *= options.weak_sigma_factor * options.weak_sigma_factor;
  }
  return observation;
}

}  // namespace

bool IsTrackable(const PersonObservation& observation, const TrackerOptions& options) {
  if (!IsUsable(Weighed(observation, options))) return false;
  if (!observation.has_joints) return true;
  return std::all_of(observation.joints_torso.begin(), observation.joints_torso.end(),
                     [](const Eigen::Vector3d& joint) { return joint.allFinite(); });
}

SeenPerson MakeSeen(PersonObservation observation) {
  SeenPerson seen;
  seen.skeleton = PlaceSkeleton(observation, observation.map_T_torso);
  const std::optional<ShapeVector> shape = ReadShape(observation.shape_coefficients);
  if (shape.has_value()) seen.shape.Add(*shape);
  seen.observation = std::move(observation);
  return seen;
}

TrackEntry::TrackEntry(int64_t id, const TrackerOptions& options)
    : options_(&options), track_{id, TrackState::kTentative, TorsoGraph(options.torso), {}, {},
                                 {}} {}

void TrackEntry::Append(PersonObservation observation) {
  // Observations and estimates go in pairs.
  if (!track_.graph.Add(Weighed(observation, *options_))) return;
  track_.observations.push_back(std::move(observation));
}

void TrackEntry::Solved(size_t first_moved) {
  first_estimate_ = std::min(first_estimate_, first_moved);
  is_changed_ = true;
  skeleton_ =
      PlaceSkeleton(track_.observations.back(), track_.graph.estimates().back().map_T_torso);
  if (shape_.count > 0) track_.shape_coefficients = ToFloats(shape_.mean());
}

void TrackEntry::Add(const SeenPerson& seen) {
  Append(seen.observation);
  shape_.Add(seen.shape);
  Solved(track_.graph.SolveRecent());
}

void TrackEntry::Absorb(TrackEntry* other) {
  size_t first_moved = track_.observations.size();
  for (PersonObservation& observation : other->track_.observations) {
    Append(std::move(observation));
    // One by one, as if they had been of this track from the beginning.
    first_moved = std::min(first_moved, track_.graph.SolveRecent());
  }
  other->track_.observations.clear();
  shape_.Add(other->shape_);
  Solved(first_moved);
}

void TrackEntry::Smooth() {
  if (track_.observations.empty()) return;
  track_.graph.SolveAll();
  Solved(0);
}

void TrackEntry::SetState(TrackState state) {
  if (state == track_.state) return;
  track_.state = state;
  is_changed_ = true;
  was_confirmed_ |= state == TrackState::kConfirmed;
}

bool TrackEntry::IsConfirmable(TimeNs now_ns) const {
  const int hit_count = options_->is_first_consistent ? options_->paper_confirm_hit_count
                                                      : options_->confirm_hit_count;
  const auto needed = static_cast<size_t>(std::max(1, hit_count));
  const size_t count = track_.observations.size();
  return count >= needed &&
         now_ns - track_.observations[count - needed].time_ns <= options_->confirm_ns;
}

std::optional<TrackChange> TrackEntry::TakeChange() {
  if (!is_changed_ || (!was_confirmed_ && track_.state != TrackState::kDropped)) {
    return std::nullopt;
  }
  const size_t estimate_count = is_away() ? away_count_ : track_.graph.estimates().size();
  const TrackChange change{track_.id, track_.state, std::min(first_estimate_, estimate_count),
                           first_observation_};
  is_changed_ = false;
  first_estimate_ = estimate_count;
  first_observation_ = estimate_count;
  return change;
}

void TrackEntry::Move(const TrajectoryChange& change) {
  std::vector<PersonObservation> observations = std::exchange(track_.observations, {});
  track_.graph = TorsoGraph(options_->torso);
  for (PersonObservation& observation : observations) {
    const Pose3d move = change.At(observation.time_ns);
    const Eigen::Matrix3d turn = move.orientation.toRotationMatrix();
    observation.map_T_torso = KeepUpright(observation.map_T_torso, move * observation.map_T_torso);
    observation.position_covariance_map =
        turn * observation.position_covariance_map * turn.transpose();
    observation.camera_map = move * observation.camera_map;
    for (PositionCue& cue : observation.cues) {
      cue.torso_map = move * cue.torso_map;
      cue.information_map = turn * cue.information_map * turn.transpose();
    }
    Append(std::move(observation));
  }
  Smooth();
}

absl::Status TrackEntry::PutAway(SpillFile* file) {
  if (track_.observations.empty()) return absl::OkStatus();
  track_.graph.Freeze();
  const std::string bytes = EncodeTrack(track_.observations, track_.graph.estimates());
  DSG_RETURN_IF_ERROR(file->Write(bytes, &piece_));
  away_count_ = track_.observations.size();
  LetGo();
  return absl::OkStatus();
}

absl::Status TrackEntry::Fetch(const SpillFile& file) {
  std::string bytes;
  absl::Status status = file.Read(piece_, &bytes);
  std::vector<TorsoEstimate> estimates;
  if (status.ok() && !DecodeTrack(bytes, away_count_, &track_.observations, &estimates)) {
    status = absl::InternalError("a track was written to disk in a form that is none");
  }
  if (!status.ok()) {
    track_.observations.assign(away_count_, PersonObservation());
    estimates.assign(away_count_, TorsoEstimate());
  }
  track_.graph.ExchangeEstimates(std::move(estimates));
  return status;
}

void TrackEntry::LetGo() {
  std::vector<PersonObservation>().swap(track_.observations);
  track_.graph.ExchangeEstimates({});
}

}  // namespace dsg::ingest
