// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/log_run.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/commit/graph_boxes.h"
#include "ingest/correction/correction.h"
#include "ingest/pipeline/contact_edges.h"
#include "ingest/pipeline/held_edges.h"
#include "schema/base/status.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

// Of a measurement that no stage takes yet.
std::string ChannelOf(const Measurement& measurement) {
  if (const auto* image = std::get_if<ImageMeasurement>(&measurement)) return image->channel;
  if (std::holds_alternative<LoopMeasurement>(measurement)) return "loops0";
  return std::holds_alternative<ImuMeasurement>(measurement) ? "imu0" : "detections0";
}

TimeNs TimeIn(const GraphMeasurement&) { return kTimeMin; }
TimeNs TimeIn(const PoseMeasurement& pose) { return pose.pose.time_ns; }
template <typename Sensor>
TimeNs TimeIn(const Sensor& measurement) {
  return measurement.time_ns;
}

// kTimeMin for what has none.
TimeNs TimeOf(const Measurement& measurement) {
  return std::visit([](const auto& any) { return TimeIn(any); }, measurement);
}

void MoveInto(GraphDelta from, GraphDelta* to) {
  const auto move = [](auto& source, auto* target) {
    std::move(source.begin(), source.end(), std::back_inserter(*target));
  };
  move(from.nodes, &to->nodes);
  move(from.edges, &to->edges);
  move(from.appends, &to->appends);
  move(from.corrections, &to->corrections);
  move(from.factors, &to->factors);
  move(from.shapes, &to->shapes);
}

std::vector<ThingBox> ThingsOf(const LayerGraph& graph) {
  std::vector<ThingBox> things;
  for (const Node& node : graph.nodes) {
    if (node.kind != kinds::kObject || node.box_node.isEmpty()) continue;
    things.push_back({node.id, node.BoxMap(), node.valid.from_ns, node.valid.to_ns});
  }
  return things;
}

}  // namespace

LogRun::LogRun(Parts parts, const MapView& map, DeltaSink sink)
    : options_(std::move(parts.options)),
      map_(map),
      namer_(parts.agents),
      regions_(std::move(parts.regions)),
      builder_(parts.feet_below_m, options_.robot_model),
      sink_(std::move(sink)),
      mapper_(std::move(parts.mapper)),
      people_(std::move(parts.people)),
      detector_(std::move(parts.detector)),
      people_told_(parts.session_id, parts.agent_prefix,
                   SessionPart(parts.agents, parts.agent_prefix, parts.session_id), &namer_),
      robot_(std::move(parts.robot)),
      has_loops_(parts.has_loops),
      first_revision_(parts.first_revision) {
  if (mapper_ == nullptr || people_ == nullptr) return;
  mapper_->SetFrameObserver([this](const DepthFrame& frame) { people_->AddFrame(frame); });
}

absl::Status LogRun::Take(Measurement& measurement) {
  if (IsTimed()) DSG_RETURN_IF_ERROR(CommitIfDue(TimeOf(measurement)));
  if (auto* graph = std::get_if<GraphMeasurement>(&measurement)) {
    return TakeGraph(std::move(graph->delta));
  }
  if (auto* pose = std::get_if<PoseMeasurement>(&measurement)) return TakePose(*pose);
  const std::string channel = ChannelOf(measurement);
  DSG_ASSIGN_OR_RETURN(const bool is_used, TakeSensor(&measurement));
  if (!is_used) ++unused_[channel];
  return mapper_ == nullptr ? absl::OkStatus() : mapper_->Advance();
}

absl::Status LogRun::Finish() {
  if (mapper_ != nullptr) {
    mapper_->Close();
    DSG_RETURN_IF_ERROR(mapper_->Advance());
  }
  if (people_ != nullptr) people_->Close();
  if (IsTimed()) {
    DSG_RETURN_IF_ERROR(Commit(last_ns_, /*is_update=*/mapper_ != nullptr, /*is_last=*/true));
  }
  ReplayWaiting();
  Tracker().Finish();
  std::vector<Stay> stays = Tracker().TakeChanges();
  if (IsTimed()) {
    DSG_RETURN_IF_ERROR(PutStays(std::move(stays)));
    DSG_RETURN_IF_ERROR(PutStays(mender_.Mend(MakeIndex())));
  } else {
    DSG_RETURN_IF_ERROR(sink_.Put(builder_.Take(std::move(stays))));
  }
  DSG_RETURN_IF_ERROR(sink_.Put(builder_.TakeNodes()));
  DSG_RETURN_IF_ERROR(PutRobotGraph());
  return PutContacts();
}

IngestSummary LogRun::Summary() const {
  IngestSummary summary{graph_agent_count_ + builder_.agent_count() + people_told_.agent_count(),
                        sink_.counts(),
                        unused_,
                        {},
                        {},
                        {}};
  if (mapper_ != nullptr) summary.mapping = mapper_->Summary();
  if (has_loops_) summary.loops = loops_;
  if (people_ != nullptr)
    summary.people = PeopleSummary{people_->counts(), people_->clock().times()};
  return summary;
}

absl::Status LogRun::TakeGraph(GraphDelta graph) {
  DSG_RETURN_IF_ERROR(RenameAgents(&namer_, &graph));
  DSG_RETURN_IF_ERROR(LayOverStoredGraph(map_, &graph));
  for (const Node& node : graph.nodes) graph_agent_count_ += IsAgentKind(node.kind) ? 1 : 0;
  regions_.Add(graph);
  Coalesce(&graph);
  return sink_.Put(std::move(graph));
}

absl::Status LogRun::TakePose(const PoseMeasurement& pose) {
  const NodeId agent = namer_.Assign(pose.agent_name, pose.agent_kind);
  builder_.AddPose(agent, pose);
  if (robot_.has_value() && pose.agent_kind == kinds::kRobot) {
    robot_->AddPose(agent, pose.pose);
  }
  if (IsTimed()) return TakeTimedPose(agent, pose);
  Tracker().Observe(agent, pose.pose.time_ns, pose.pose.map_T_agent.position);
  if (builder_.pose_count() < options_.poses_per_delta) return absl::OkStatus();
  return sink_.Put(builder_.Take(Tracker().TakeChanges()));
}

absl::Status LogRun::TakeTimedPose(NodeId agent, const PoseMeasurement& pose) {
  const Eigen::Vector3d& position_map = pose.pose.map_T_agent.position;
  DSG_ASSIGN_OR_RETURN(const bool is_told, IsToldBefore(agent, pose.pose.time_ns));
  if (!is_told) {
    // Rooms and places that this log is about to show are not known yet.
    mender_.Observe(agent, pose.pose.time_ns, position_map);
    waiting_.push_back({agent, pose.pose.time_ns, position_map});
  }
  if (tracker_.has_value()) ReplayWaiting();
  if (people_ != nullptr && pose.agent_kind == kinds::kRobot) {
    people_->AddPose(pose.pose.time_ns, pose.pose.map_T_agent);
  }
  if (mapper_ == nullptr) return absl::OkStatus();
  mapper_->AddPose(pose);
  return mapper_->Advance();
}

// In which room an agent was at a time that another log has told of already is that log's business.
// What counts is what the map held before this session, also when it goes on after a break.
absl::StatusOr<bool> LogRun::IsToldBefore(NodeId agent, TimeNs time_ns) {
  const auto [told_until, is_new] = told_until_ns_.try_emplace(agent, kTimeMin);
  if (is_new) {
    absl::StatusOr<std::optional<TrackInfo>> track =
        first_revision_ == 0 ? map_.FindTrack(agent) : map_.FindTrackAt(agent, first_revision_ - 1);
    // Nobody knows any more; most agents are new to the map.
    if (ReasonOf(track.status()) == Reason::kRevisionCompacted) track = std::nullopt;
    if (!track.ok()) return track.status();
    if (track->has_value()) told_until->second = (*track)->last_ns;
  }
  return time_ns <= told_until->second;
}

// False when nobody has a use for it.
absl::StatusOr<bool> LogRun::TakeSensor(Measurement* measurement) {
  if (auto* image = std::get_if<ImageMeasurement>(measurement)) return TakeImage(image);
  if (const auto* loop = std::get_if<LoopMeasurement>(measurement)) {
    if (robot_.has_value()) robot_->AddLoop(ToLoopClosure(*loop));
    return robot_.has_value();
  }
  auto* human = std::get_if<HumanDetection>(measurement);
  // Where a network looks, the log's own detections would be the same people twice.
  return human != nullptr && detector_ == nullptr && TakeDetection(human);
}

absl::StatusOr<bool> LogRun::TakeImage(ImageMeasurement* image) {
  bool is_looked_at = false;
  if (detector_ != nullptr) {
    DSG_ASSIGN_OR_RETURN(std::vector<HumanDetection> seen, detector_->Look(*image));
    for (HumanDetection& detection : seen) is_looked_at |= TakeDetection(&detection);
  }
  if (mapper_ == nullptr || !mapper_->Uses(image->channel)) return is_looked_at;
  mapper_->AddPicture(std::move(*image));
  return true;
}

bool LogRun::TakeDetection(HumanDetection* detection) {
  if (mapper_ != nullptr) mapper_->AddDetection(*detection);
  if (people_ == nullptr) return false;
  people_->AddDetection(std::move(*detection));
  return true;
}

absl::Status LogRun::CommitIfDue(TimeNs now_ns) {
  if (now_ns == kTimeMin) return absl::OkStatus();
  last_ns_ = std::max(last_ns_, now_ns);
  if (begin_ns_ == kTimeMin) begin_ns_ = now_ns;
  if (now_ns - begin_ns_ < options_.mapping.commit_period_ns) return absl::OkStatus();
  begin_ns_ = now_ns;
  return Commit(now_ns, mapper_ != nullptr && mapper_->IsUpdateDue(now_ns), /*is_last=*/false);
}

// Stays end before what they are in is retired, and begin after what they are in is there.
absl::Status LogRun::Commit(TimeNs now_ns, bool is_update, bool is_last) {
  GraphDelta delta;
  if (mapper_ != nullptr) delta = mapper_->TakeMesh(now_ns, is_last);
  if (is_update) {
    GraphDelta layers = TakeLayers(now_ns);
    layers.mesh_blocks = std::move(delta.mesh_blocks);
    layers.mesh_removals = std::move(delta.mesh_removals);
    delta = std::move(layers);
  }
  if (people_ != nullptr) {
    MoveInto(people_told_.Tell(&people_->tracker(), is_last), &delta);
    Coalesce(&delta);
  }
  DSG_RETURN_IF_ERROR(sink_.Put(builder_.Take({})));
  if (tracker_.has_value()) DSG_RETURN_IF_ERROR(PutStays(Tracker().TakeChanges()));
  DSG_RETURN_IF_ERROR(sink_.PutAsIs(std::move(delta)));
  AwaitSightings();
  if (is_update) DSG_RETURN_IF_ERROR(PutStays(mender_.Mend(MakeIndex())));
  // Rooms and places of logs without depth are those of the map.
  if (mapper_ == nullptr) Tracker();
  if (tracker_.has_value()) ReplayWaiting();
  return absl::OkStatus();
}

GraphDelta LogRun::TakeLayers(TimeNs now_ns) {
  LogMapper::LayerChange change = mapper_->TakeLayers(now_ns);
  regions_.SetFound(std::move(change.regions));
  Tracker().SetRegions(MakeIndex());
  if (people_ != nullptr) people_->SetFloors(mapper_->floors_m());
  return std::move(change.delta);
}

// The factors behind the robot's trajectory; with loop closures, all that they move, at once.
absl::Status LogRun::PutRobotGraph() {
  if (!robot_.has_value() || robot_->poses().empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const RobotGraph::Solution solution, robot_->graph().Solve());
  loops_ = robot_->Count(solution);
  GraphDelta delta;
  if (!solution.change.IsIdentity()) {
    delta = Correct(solution);
    delta.message = "moved by loop closures";
  }
  FactorAppend factors{robot_->agent(), robot_->graph().Factors(solution)};
  if (!factors.factors.empty()) delta.factors.push_back(std::move(factors));
  return sink_.PutCorrection(std::move(delta));
}

GraphDelta LogRun::Correct(const RobotGraph::Solution& solution) {
  ToldMap told;
  if (mapper_ != nullptr) {
    told.layers = mapper_->graph();
    told.mesh = mapper_->Mesh();
  }
  told.robot = {builder_.NodeOf(robot_->agent()), robot_->poses()};
  for (const auto& [number, person] : people_told_.people()) {
    told.people.push_back({person.node, person.poses});
  }
  told.mesh_block_size_m = map_.spec().mesh_block_size_m;
  Correction correction = MakeCorrection(std::move(told), solution);
  people_told_.Replace(correction.delta.corrections);
  corrected_ = std::move(correction.layers);
  return std::move(correction.delta);
}

absl::Status LogRun::PutContacts() {
  if (people_ == nullptr) return absl::OkStatus();
  std::vector<ThingBox> things;
  if (mapper_ != nullptr) {
    things = ThingsOf(corrected_.has_value() ? *corrected_ : mapper_->graph());
  }
  GraphDelta delta;
  delta.edges =
      FindContactEdges(people_->tracker(), people_told_, things, options_.people.contacts);
  const std::vector<Edge> held = HeldEdges();
  delta.edges.insert(delta.edges.end(), held.begin(), held.end());
  Coalesce(&delta);
  return sink_.PutAsIs(std::move(delta));
}

// Nobody is asked for their hands: what they carried was seen.
std::vector<Edge> LogRun::HeldEdges() const {
  if (mapper_ == nullptr) return {};
  std::vector<Node> objects = corrected_.has_value() ? corrected_->nodes : mapper_->graph().nodes;
  std::erase_if(objects, [](const Node& node) { return node.kind != kinds::kObject; });
  std::vector<AgentPath> paths;
  for (const auto& [number, person] : people_told_.people()) {
    AgentPath& path = paths.emplace_back();
    path.agent = person.id;
    for (const TimedPose& pose : person.poses) {
      path.torso.push_back({pose.time_ns, pose.map_T_agent.position});
    }
  }
  return FindHeldEdges(paths, mapper_->Carries(), objects);
}

// As they are: these stays come later than their poses, so what the map holds of the poses tells
// nothing about the stays.
absl::Status LogRun::PutStays(std::vector<Stay> stays) {
  mender_.Remember(stays);
  GraphDelta delta;
  delta.stays = std::move(stays);
  return sink_.PutAsIs(std::move(delta));
}

void LogRun::AwaitSightings() {
  if (people_ == nullptr) return;
  for (const PeopleTold::Sighting& seen : people_told_.TakeSightings()) {
    mender_.Observe(seen.agent, seen.time_ns, seen.position_map);
    waiting_.push_back({seen.agent, seen.time_ns, seen.position_map});
  }
}

void LogRun::ReplayWaiting() {
  for (const Waiting& pose : waiting_) {
    Tracker().Observe(pose.agent, pose.time_ns, pose.position_map);
  }
  waiting_.clear();
}

RegionIndex LogRun::MakeIndex() const {
  RegionIndex index = regions_.MakeIndex();
  if (mapper_ != nullptr) index.SetSight(mapper_->Sight());
  return index;
}

// Made when the first pose comes: by then the log's own rooms and places are known.
StayTracker& LogRun::Tracker() {
  if (!tracker_.has_value()) tracker_.emplace(MakeIndex(), map_.spec().gap_ns_max);
  return *tracker_;
}

}  // namespace dsg::ingest
