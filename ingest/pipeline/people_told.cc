// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/people_told.h"

#include <algorithm>
#include <memory>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/body_topology.h"
#include "ingest/pipeline/layer_graph.h"
#include "ingest/trajectory/pose_bytes.h"
#include "schema/base/check.h"
#include "schema/codec/checksum.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

constexpr char kDetectionPrior[] = "detection_prior";
constexpr char kPerson[] = "person-";
constexpr char kUnconfirmed[] = "unconfirmed-";

constexpr OptionField<TellOptions> kTellFields[] = {
    {"told-move", &TellOptions::live_move_m, 0.0, 10.0,
     "A person's pose that moved by more is told anew while the log runs, metres: each costs a row "
     "of the history"},
    {"told-turn", &TellOptions::live_turn_rad, 0.0, 3.2, "... that turned by more, radians"},
    {"told-last-move", &TellOptions::last_move_m, 0.0, 10.0,
     "The same at the end of the log, metres: what remains is rounding"},
    {"told-last-turn", &TellOptions::last_turn_rad, 0.0, 3.2, "... radians"},
    {"told-half-width", &TellOptions::half_width_m, 0.01, 5.0,
     "Half the width of a body whose joints are not known, metres: of adults, with elbows"},
    {"told-below", &TellOptions::below_m, 0.01, 5.0,
     "How far it reaches below its torso, metres: of adults"},
    {"told-above", &TellOptions::above_m, 0.01, 5.0, "... and above, metres: of adults"},
    {"told-flesh", &TellOptions::flesh_m, 0.0, 1.0,
     "How far a body reaches beyond its joints, metres: joints are inside"},
};

bool HasMoved(const Pose3d& told, const Pose3d& now, bool is_last, const TellOptions& options) {
  const double move_m = is_last ? options.last_move_m : options.live_move_m;
  const double turn_rad = is_last ? options.last_turn_rad : options.live_turn_rad;
  return (told.position - now.position).norm() > move_m ||
         AngleBetween(told.orientation, now.orientation) > turn_rad;
}

TimedPose MakePose(const TorsoEstimate& estimate, bool has_heading) {
  TimedPose pose;
  pose.time_ns = estimate.time_ns;
  pose.flags = has_heading ? 0 : pose_flags::kNoOrientation;
  pose.map_T_agent = estimate.map_T_torso;
  pose.covariance = std::make_shared<const Covariance6>(estimate.covariance);
  return pose;
}

Box3d BodyBox(const PersonTracker::Track& track, const TellOptions& options) {
  Box3d box;
  for (auto seen = track.observations.rbegin(); seen != track.observations.rend(); ++seen) {
    if (!seen->has_joints) continue;
    for (const Eigen::Vector3d& joint : seen->joints_torso) box.extend(joint);
    box.min().array() -= options.flesh_m;
    box.max().array() += options.flesh_m;
    return box;
  }
  const double half_m = options.half_width_m;
  return {Eigen::Vector3d(-half_m, -half_m, -options.below_m),
          Eigen::Vector3d(half_m, half_m, options.above_m)};
}

BodyShape MakeShape(const PersonObservation& observation) {
  BodyShape shape;
  shape.time_ns = observation.time_ns;
  shape.pose_coefficients = observation.pose_coefficients;
  shape.shape_coefficients = observation.shape_coefficients;
  shape.vertices = observation.vertices_torso;
  if (observation.has_joints) {
    for (const Eigen::Vector3d& joint : observation.joints_torso) {
      for (int axis = 0; axis < 3; ++axis) shape.joints.push_back(static_cast<float>(joint[axis]));
    }
  }
  return shape;
}

bool HasShape(const PersonObservation& observation) {
  return observation.has_joints || !observation.pose_coefficients.empty() ||
         !observation.shape_coefficients.empty() || !observation.vertices_torso.empty();
}

}  // namespace

std::vector<BoundOption> TellOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<TellOptions>(kTellFields, this, &bound);
  return bound;
}

GraphDelta PeopleTold::Tell(PersonTracker* tracker, bool is_last) {
  GraphDelta delta;
  for (const TrackChange& change : tracker->TakeChanges()) {
    const PersonTracker::Track& track = tracker->track(change.track);
    Person& person = PersonOf(track);
    const bool is_dropped = change.state == TrackState::kDropped;
    const bool is_away = person.poses.empty() && !person.away.empty();
    if (is_away) person.poses = PosesOf(person);
    if (!is_dropped) TellPoses(track, change.first_estimate, is_last, &person, &delta);
    TellObservations(track, &person, &delta);
    tracker->ForgetShapes(change.track, change.first_observation);
    TellSameAs(track, &person, &delta);
    if (!person.is_told || person.state != change.state || is_last) {
      person.state = change.state;
      person.is_told = true;
      TellNode(track, &person, &delta);
    }
    if (is_away) PutAway(&person);
    // Nothing more will be told of it.
    if (is_dropped) people_.erase(change.track);
  }
  for (const int64_t track : tracker->TakeClosed()) {
    const auto person = people_.find(track);
    if (person != people_.end()) PutAway(&person->second);
  }
  Coalesce(&delta);
  return delta;
}

void PeopleTold::PutAway(Person* person) {
  if (person->poses.empty() || !status_.ok()) return;
  status_ = file_->Write(EncodePoses(person->poses), &person->away);
  if (status_.ok()) std::vector<TimedPose>().swap(person->poses);
}

std::vector<TimedPose> PeopleTold::PosesOf(const Person& person) const {
  if (!person.poses.empty() || person.away.empty()) return person.poses;
  std::string bytes;
  std::vector<TimedPose> poses;
  absl::Status status = file_->Read(person.away, &bytes);
  if (status.ok() && !DecodePoses(bytes, person.pose_count, &poses)) {
    status = absl::InternalError("poses of a person were written to disk in a form that is none");
  }
  if (!status.ok()) poses.assign(person.pose_count, TimedPose());
  status_.Update(status);
  return poses;
}

std::vector<PeopleTold::Sighting> PeopleTold::TakeSightings() {
  std::vector<Sighting> sightings = std::exchange(sightings_, {});
  std::stable_sort(sightings.begin(), sightings.end(), [](const Sighting& a, const Sighting& b) {
    return a.agent != b.agent ? a.agent < b.agent : a.time_ns < b.time_ns;
  });
  return sightings;
}

int64_t PeopleTold::agent_count() const {
  return std::count_if(people_.begin(), people_.end(),
                       [](const auto& person) { return person.second.pose_count > 0; });
}

PeopleTold::Person& PeopleTold::PersonOf(const PersonTracker::Track& track) {
  auto [found, is_new] = people_.try_emplace(track.id);
  Person& person = found->second;
  if (is_new) {
    const bool is_dropped = track.state == TrackState::kDropped;
    person.name =
        absl::StrCat(agent_prefix_, is_dropped ? kUnconfirmed : kPerson, session_part_, track.id);
    person.id = namer_->Assign(person.name, kinds::kHuman);
  }
  return person;
}

void PeopleTold::TellNode(const PersonTracker::Track& track, Person* person,
                          GraphDelta* delta) const {
  DSG_CHECK(!track.observations.empty());
  const bool is_dropped = track.state == TrackState::kDropped;
  Node node;
  node.id = person->id;
  node.layer = layers::kAgents;
  node.kind = kinds::kHuman;
  node.name = person->name;
  node.provenance = Provenance::kPerceived;
  const TimeNs first_ns = track.observations.front().time_ns;
  const TimeNs last_ns = track.observations.back().time_ns;
  node.first_observed_ns = first_ns;
  node.last_observed_ns = last_ns;
  // Nobody was there for sure; the row stays as evidence of what was seen.
  node.valid = {first_ns, is_dropped ? last_ns + 1 : kTimeMax};
  node.observation_count = static_cast<int64_t>(track.observations.size());
  node.confidence = is_dropped ? 0.0 : 1.0;
  node.map_T_node = is_dropped ? track.observations.back().map_T_torso
                               : track.graph.estimates().back().map_T_torso;
  node.box_node = BodyBox(track, options_);
  node.agent.emplace();
  node.agent->shape_coefficients = track.shape_coefficients;
  node.agent->track_state = std::string(ToString(track.state));
  node.attributes[kSessionAttribute] = session_id_;
  delta->nodes.push_back(std::move(node));
}

void PeopleTold::TellPoses(const PersonTracker::Track& track, size_t first_moved, bool is_last,
                           Person* person, GraphDelta* delta) {
  const std::vector<TorsoEstimate>& estimates = track.graph.estimates();
  std::vector<TimedPose>& told = person->poses;
  const size_t told_count = told.size();
  size_t first = told_count;
  size_t end = told_count;
  for (size_t i = is_last ? 0 : std::min(first_moved, told_count); i < told_count; ++i) {
    if (!HasMoved(told[i].map_T_agent, estimates[i].map_T_torso, is_last, options_)) continue;
    if (first == told_count) first = i;
    end = i + 1;
  }
  if (first < told_count) {
    TrajectoryCorrection correction{person->id, told[first].time_ns, told[end - 1].time_ns + 1, {}};
    for (size_t i = first; i < end; ++i) {
      told[i] = MakePose(estimates[i], track.observations[i].has_heading);
      told[i].flags |= pose_flags::kCorrected;
      correction.poses.push_back(told[i]);
    }
    delta->corrections.push_back(std::move(correction));
  }
  TrajectoryAppend append{person->id, {}};
  for (size_t i = told_count; i < estimates.size(); ++i) {
    told.push_back(MakePose(estimates[i], track.observations[i].has_heading));
    append.poses.push_back(told.back());
    sightings_.push_back({person->id, told.back().time_ns, told.back().map_T_agent.position});
  }
  person->pose_count = told.size();
  if (!append.poses.empty()) delta->appends.push_back(std::move(append));
}

void PeopleTold::TellObservations(const PersonTracker::Track& track, Person* person,
                                  GraphDelta* delta) {
  const size_t first = person->observation_count;
  if (first == track.observations.size()) return;
  person->observation_count = track.observations.size();
  FactorAppend factors{person->id, track.graph.Factors(first)};
  if (track.state == TrackState::kDropped) {
    std::erase_if(factors.factors,
                  [](const PoseFactor& factor) { return factor.type != kDetectionPrior; });
  }
  if (!factors.factors.empty()) delta->factors.push_back(std::move(factors));
  TellShapes(track, first, person->id, delta);
}

void PeopleTold::TellShapes(const PersonTracker::Track& track, size_t first, NodeId agent,
                            GraphDelta* delta) {
  ShapeAppend bare{agent, std::nullopt, {}};
  ShapeAppend faced{agent, std::nullopt, {}};
  for (size_t i = first; i < track.observations.size(); ++i) {
    const PersonObservation& observation = track.observations[i];
    if (!HasShape(observation)) continue;
    const bool has_faces = FitsTopology(body_topology_.get(), observation.vertices_torso);
    (has_faces ? faced : bare).shapes.push_back(MakeShape(observation));
  }
  if (!bare.shapes.empty()) delta->shapes.push_back(std::move(bare));
  if (faced.shapes.empty()) return;
  if (!topology_asset_.has_value()) {
    Asset asset{
        .sha256 = {}, .media_type = kTopologyMediaType, .content = EncodeTopology(*body_topology_)};
    asset.sha256 = ComputeSha256(asset.content);
    topology_asset_ = asset.sha256;
    delta->assets.push_back(std::move(asset));
  }
  faced.topology = topology_asset_;
  delta->shapes.push_back(std::move(faced));
}

void PeopleTold::TellSameAs(const PersonTracker::Track& track, Person* person, GraphDelta* delta) {
  for (; person->same_as_count < track.same_as.size(); ++person->same_as_count) {
    const SameAs& same = track.same_as[person->same_as_count];
    // It was told before: only confirmed tracks count as earlier ones.
    const auto earlier = people_.find(same.earlier_track);
    if (earlier == people_.end()) continue;
    Edge edge{person->id, relations::kSameAs, earlier->second.id, same.probability};
    edge.valid = {track.observations.front().time_ns, kTimeMax};
    delta->edges.push_back(std::move(edge));
  }
}

std::string SessionPart(const std::vector<Node>& known_agents, const std::string& agent_prefix,
                        const std::string& session_id) {
  std::set<std::string> others;
  for (const Node& node : known_agents) {
    const auto session = node.attributes.find(kSessionAttribute);
    if (session == node.attributes.end()) continue;
    const auto* text = std::get_if<std::string>(&session->second);
    if (text == nullptr) continue;
    if (*text != session_id) {
      others.insert(*text);
      continue;
    }
    // "person-1-7": between the kind and the number.
    const size_t begin = node.name.find('-', agent_prefix.size()) + 1;
    return node.name.substr(begin, node.name.rfind('-') + 1 - begin);
  }
  return others.empty() ? "" : absl::StrCat(others.size(), "-");
}

}  // namespace dsg::ingest
