// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/evaluate.h"

#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace dsg::evaluation {
namespace {

constexpr double kRpeLengthsM[] = {1.0, 5.0, 10.0, 20.0};

std::vector<StampedPose> TrueTrajectory(const truth::Truth& truth) {
  std::vector<StampedPose> out;
  out.reserve(truth.robot.size());
  for (const truth::RobotState& state : truth.robot) {
    out.push_back({state.time_ns, state.map_T_body});
  }
  return out;
}

TrajectoryResult ScoreTrajectory(const Estimate& estimate, const truth::Truth& truth) {
  TrajectoryResult result;
  if (estimate.robot_causal.empty()) return result;
  const std::vector<StampedPose> real = TrueTrajectory(truth);
  const std::vector<PosePair> causal = AssociatePoses(estimate.robot_causal, real);
  result.causal = AbsoluteError(causal, Alignment::kSe3);
  result.causal_4dof = AbsoluteError(causal, Alignment::kYaw);
  result.causal_unaligned = AbsoluteError(causal, Alignment::kNone);
  const std::vector<PosePair> smoothed = AssociatePoses(estimate.robot, real);
  result.smoothed = AbsoluteError(smoothed, Alignment::kSe3);
  result.smoothed_4dof = AbsoluteError(smoothed, Alignment::kYaw);
  result.coverage = Coverage(estimate.robot_causal, truth.begin_ns, truth.end_ns);
  for (const double length_m : kRpeLengthsM) {
    if (const auto rpe = RelativeError(causal, length_m)) result.rpe.push_back(*rpe);
  }
  return result;
}

// Label ids of the map in those of the truth, by name: each may count its own way.
MeshBlock WithTrueLabels(const Estimate& estimate, const truth::Truth& truth) {
  MeshBlock mesh = estimate.mesh;
  if (estimate.labels.empty()) return mesh;
  std::map<std::string, uint32_t> true_ids;
  for (const SemanticLabel& label : truth.labels) {
    true_ids.emplace(label.name, static_cast<uint32_t>(label.id));
  }
  std::map<uint32_t, uint32_t> ids;
  for (const SemanticLabel& label : estimate.labels) {
    const auto found = true_ids.find(label.name);
    if (found != true_ids.end()) ids.emplace(static_cast<uint32_t>(label.id), found->second);
  }
  for (uint32_t& label : mesh.labels) {
    const auto found = ids.find(label);
    label = found == ids.end() ? 0 : found->second;
  }
  return mesh;
}

std::vector<Polygon2d> Footprints(const truth::Truth& truth) {
  std::vector<Polygon2d> out;
  for (const truth::Room& room : truth.rooms) out.push_back(room.footprint_map);
  return out;
}

MeshResult ScoreMesh(const Estimate& estimate, const truth::Truth& truth,
                     const MeshOptions& options) {
  if (estimate.mesh.positions_map.empty()) return {};
  return EvaluateMesh(WithTrueLabels(estimate, truth), truth.mesh, truth.face_observed,
                      Footprints(truth), options);
}

// What the robot saw there, put into the map by where it really was.
class DriftRemover {
 public:
  DriftRemover(const Estimate& estimate, const truth::Truth& truth) {
    for (const PosePair& pair : AssociatePoses(estimate.robot_causal, TrueTrajectory(truth))) {
      pairs_.emplace(pair.time_ns, pair);
    }
  }

  Eigen::Vector3d operator()(TimeNs time_ns, const Eigen::Vector3d& point_map) const {
    // Images are taken at the robot's stamps, so the nearest one is the right one.
    auto after = pairs_.lower_bound(time_ns);
    if (after != pairs_.begin() &&
        (after == pairs_.end() || after->first - time_ns > time_ns - std::prev(after)->first)) {
      --after;
    }
    if (after == pairs_.end()) return point_map;
    const PosePair& pair = after->second;
    return pair.truth * (pair.estimate.Inverse() * point_map);
  }

 private:
  std::map<TimeNs, PosePair> pairs_;
};

HumanResult ScoreHumans(const Estimate& estimate, const truth::Truth& truth,
                        const HumanOptions& options) {
  std::vector<TrueDetection> detections;
  for (const truth::DetectionTruth& row : truth.detections) {
    detections.push_back(
        {row.time_ns, row.human, row.visibility, row.torso_map, row.detected_torso_map, row.id});
  }
  const DriftRemover without_drift(estimate, truth);
  std::vector<EstimatedPrior> priors;
  for (const TrackedTorso& prior : estimate.detection_priors) {
    priors.push_back({prior.time_ns, prior.track, prior.torso_map,
                      without_drift(prior.time_ns, prior.torso_map)});
  }
  std::vector<EstimatedTorso> poses;
  for (const TrackedTorso& torso : estimate.torsos) {
    poses.push_back({torso.time_ns, torso.track, torso.torso_map});
  }
  return EvaluateHumans(detections, priors, poses, options);
}

std::vector<TrueObject> TrueObjects(const truth::Truth& truth) {
  std::vector<TrueObject> out;
  for (const truth::Object& object : truth.objects) {
    out.push_back({object.class_name,
                   object.map_T_object,
                   object.size,
                   {},
                   !object.cad_file.empty(),
                   object.symmetry_order,
                   object.observed});
  }
  for (const truth::Pick& pick : truth.picks) {
    // Where somebody still carries it, no node is asked for.
    if (pick.place_ns == kTimeMax) continue;
    out[static_cast<size_t>(pick.object)].later_map_T_object.push_back(pick.map_T_object_after);
  }
  return out;
}

RoomResult ScoreRooms(const Estimate& estimate, const truth::Truth& truth, const GridMap& map,
                      const RoomOptions& options) {
  PredictedRooms predicted;
  predicted.count = estimate.room_count;
  predicted.adjacent = estimate.adjacent_rooms;
  for (size_t i = 0; i < estimate.places.size(); ++i) {
    const EstimatedPlace& place = estimate.places[i];
    predicted.places.push_back({place.position_map, place.clearance_m, estimate.room_of_place[i]});
  }
  TrueRooms rooms{Footprints(truth), {}};
  for (const truth::Door& door : truth.doors) rooms.doors.emplace_back(door.room_a, door.room_b);
  return EvaluateRooms(predicted, rooms, map, options);
}

/// Where an object stood until it was picked up, or until the end.
struct Standing {
  int object = 0;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  /// Index of the pick that ended it; -1 = none.
  int pick = -1;
};

std::vector<Standing> Standings(const truth::Truth& truth) {
  std::vector<Standing> all;
  // Of each object the place in `all` where it stood last.
  std::vector<size_t> last;
  for (size_t i = 0; i < truth.objects.size(); ++i) {
    last.push_back(all.size());
    all.push_back({static_cast<int>(i), truth.objects[i].map_T_object.position});
  }
  for (size_t i = 0; i < truth.picks.size(); ++i) {
    const truth::Pick& pick = truth.picks[i];
    size_t& standing = last[static_cast<size_t>(pick.object)];
    all[standing].pick = static_cast<int>(i);
    // Else it is carried until the end.
    if (pick.place_ns == kTimeMax) continue;
    standing = all.size();
    all.push_back({pick.object, pick.map_T_object_after.position});
  }
  return all;
}

// What stood where a node is: nearest of its class, nullptr = nothing within the gate. Nodes are
// not shared out: one may be of before a pick, another of after it.
const Standing* StandingOf(const EstimatedObject& node, const std::vector<Standing>& standings,
                           const truth::Truth& truth, double gate_m) {
  const Standing* nearest = nullptr;
  double least_m = gate_m;
  for (const Standing& standing : standings) {
    if (truth.objects[static_cast<size_t>(standing.object)].class_name != node.class_name) continue;
    const double distance_m = (standing.position_map - node.position_map).norm();
    if (distance_m >= least_m) continue;
    least_m = distance_m;
    nearest = &standing;
  }
  return nearest;
}

std::vector<TruePick> TruePicks(const Estimate& estimate, const truth::Truth& truth,
                                const std::vector<Standing>& standings, double gate_m) {
  std::vector<TruePick> picks;
  for (const truth::Pick& pick : truth.picks) {
    picks.push_back({pick.object, pick.human, pick.pick_ns, pick.observed});
  }
  for (const EstimatedObject& node : estimate.objects) {
    const Standing* standing = StandingOf(node, standings, truth, gate_m);
    if (standing == nullptr || standing->pick < 0) continue;
    TruePick& pick = picks[static_cast<size_t>(standing->pick)];
    if (node.valid.from_ns > pick.pick_ns) continue;
    pick.is_mapped = true;
    pick.is_noticed |= node.valid.to_ns != kTimeMax;
  }
  return picks;
}

PickResult ScorePicks(const Estimate& estimate, const truth::Truth& truth,
                      const HumanResult& humans, const EvaluateOptions& options) {
  const std::vector<Standing> standings = Standings(truth);
  const double gate_m = options.objects.gate_m;
  std::vector<PredictedPick> predicted;
  for (const Holding& holding : estimate.holdings) {
    PredictedPick pick{-1, -1, holding.from_ns, std::clamp(holding.probability, 0.0, 1.0)};
    if (holding.object >= 0) {
      const EstimatedObject& node = estimate.objects[static_cast<size_t>(holding.object)];
      const Standing* standing = StandingOf(node, standings, truth, gate_m);
      if (standing != nullptr) pick.object = standing->object;
    }
    const auto human = humans.human_of_track.find(holding.track);
    if (human != humans.human_of_track.end()) pick.human = human->second;
    predicted.push_back(pick);
  }
  return EvaluatePicks(predicted, TruePicks(estimate, truth, standings, gate_m), options.picks);
}

void AppendNotes(const Report& report, const Estimate& estimate, std::vector<std::string>* notes) {
  *notes = estimate.notes;
  const TrajectoryResult& trajectory = report.trajectory;
  if (trajectory.coverage.has_value() && *trajectory.coverage < kCoverageMin) {
    notes->push_back("the trajectory covers less than 95 % of the log, which counts as failure");
  }
  if (!estimate.robot.empty() && !trajectory.smoothed.has_value()) {
    notes->push_back(
        "no three poses of the robot fall into the time of the truth: it is that of another log");
  }
  if (!estimate.torsos.empty() && estimate.detection_priors.empty()) {
    notes->push_back(
        "people's tracks have no detection_prior factors, so nothing tells whose a pose is; they "
        "are not scored");
  }
  if (!estimate.mesh.positions_map.empty() && estimate.labels.empty() &&
      !estimate.mesh.labels.empty()) {
    notes->push_back("the map names no labels; its label ids are taken for the truth's");
  }
}

}  // namespace

Report Evaluate(const Estimate& estimate, const truth::Truth& truth, const EvaluateOptions& options,
                const ProgressFunction& progress) {
  const auto tell = [&progress](const char* what, double fraction) {
    if (progress) progress(what, fraction);
  };
  Report report;
  report.map = estimate.map;
  report.revision = estimate.revision;
  report.world = truth.world;
  report.seed = truth.seed;
  for (const SemanticLabel& label : truth.labels) {
    report.class_names[static_cast<uint32_t>(label.id)] = label.name;
  }
  tell("scoring the trajectory", 0.0);
  report.trajectory = ScoreTrajectory(estimate, truth);
  tell("scoring people", 0.05);
  report.humans = ScoreHumans(estimate, truth, options.humans);
  tell("scoring objects", 0.1);
  const std::vector<TrueObject> objects = TrueObjects(truth);
  report.objects = EvaluateObjects(estimate.objects, objects, options.objects);
  report.relations =
      EvaluateRelations(estimate.relations, estimate.objects, report.objects.truth_of, objects,
                        options.objects, options.relations);
  report.picks = ScorePicks(estimate, truth, report.humans, options);
  tell("scoring places and rooms", 0.15);
  const GridMap map(&truth.free_grid);
  report.places = EvaluatePlaces(estimate.places, estimate.place_edges, map, options.places);
  report.rooms = ScoreRooms(estimate, truth, map, options.rooms);
  tell("scoring the mesh", 0.3);
  report.mesh = ScoreMesh(estimate, truth, options.mesh);
  AppendNotes(report, estimate, &report.notes);
  return report;
}

absl::Status AlignMap(const truth::Truth& truth, Estimate* estimate) {
  const std::vector<PosePair> pairs = AssociatePoses(estimate->robot_causal, TrueTrajectory(truth));
  if (pairs.size() < 3) {
    return absl::FailedPreconditionError(
        absl::StrCat("--align-map: ", pairs.size(), " poses of the robot in map \"", estimate->map,
                     "\" fall into the time of the truth, at least 3 do if the log is that of the "
                     "truth; leave it out, or give the truth of this log"));
  }
  const Pose3d truth_T_map = TruthFromEstimate(pairs, Alignment::kYaw).target_T_source;
  MoveEstimate(truth_T_map, estimate);
  estimate->notes.push_back(
      absl::StrFormat("the map was moved by %.2f m and turned to lie on the true path",
                      truth_T_map.position.norm()));
  return absl::OkStatus();
}

}  // namespace dsg::evaluation
