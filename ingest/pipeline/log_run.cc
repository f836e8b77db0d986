// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/log_run.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/commit/graph_boxes.h"
#include "ingest/pipeline/contact_edges.h"
#include "ingest/pipeline/held_edges.h"
#include "ingest/recognition/place_memory.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

std::string ChannelOf(const Measurement& measurement) {
  if (const auto* image = std::get_if<ImageMeasurement>(&measurement)) return image->channel;
  if (std::holds_alternative<LoopMeasurement>(measurement)) return "loops0";
  return std::holds_alternative<ImuMeasurement>(measurement) ? "imu0" : "detections0";
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

LogRun::LogRun(RunPlan plan, const MapView& map, DeltaSink sink)
    : options_(plan.options),
      info_(plan.info),
      map_(map),
      has_loops_(plan.has_loops),
      is_followed_(plan.end_sequence.has_value()),
      is_timed_(plan.has_layers || plan.has_people || plan.has_loops ||
                (is_followed_ && plan.info.rig.HasEyes())),
      namer_(plan.agents),
      detector_(std::move(plan.detector)),
      path_(options_.path, options_.spill_folder),
      loops_(options_.robot_graph, &path_, plan.info.rig.HasEyes() || plan.has_loops),
      frames_(plan.info, options_.mapping.depth, path_, plan.has_layers),
      layers_(plan.info, options_.mapping, plan.numbering, map.spec().mesh_block_size_m,
              plan.has_layers),
      people_(plan.info.rig, options_.people, plan.has_layers, path_,
              PeopleTold(plan.session_id, plan.agent_prefix,
                         SessionPart(plan.agents, plan.agent_prefix, plan.session_id), &namer_,
                         options_.people.told, plan.info.body_topology, options_.spill_folder),
              plan.has_people, options_.spill_folder),
      more_stages_(std::move(plan.more_stages)),
      stages_{&layers_, &people_},
      presence_(std::move(plan.regions), map, plan.first_revision, plan.has_layers,
                options_.regions),
      builder_(plan.info.feet_below_m, options_.robot_model, options_.bodies),
      sink_(std::move(sink)) {
  for (const std::unique_ptr<Stage>& stage : more_stages_) stages_.push_back(stage.get());
  if (is_followed_ && is_timed_) sink_.SplitEnd(*plan.end_sequence);
  if (is_followed_ && !is_timed_) sink_.NumberByNews();
}

absl::Status LogRun::Take(Measurement& measurement) {
  if (!IsStrayLoop(measurement)) DSG_RETURN_IF_ERROR(CommitIfDue(StampOf(measurement)));
  if (auto* graph = std::get_if<GraphMeasurement>(&measurement)) {
    return TakeGraph(std::move(graph->delta));
  }
  if (auto* pose = std::get_if<PoseMeasurement>(&measurement)) return TakePose(*pose);
  return TakeSensor(measurement);
}

// A loop closure may have any stamp; one far from all that was measured is no time of the log.
bool LogRun::IsStrayLoop(const Measurement& measurement) const {
  const auto* loop = std::get_if<LoopMeasurement>(&measurement);
  return loop != nullptr &&
         (last_ns_ == kTimeMin || loop->time_ns - last_ns_ > options_.mapping.commit_period_ns);
}

absl::Status LogRun::TakeGraph(GraphDelta graph) {
  DSG_RETURN_IF_ERROR(RenameAgents(&namer_, &graph));
  DSG_RETURN_IF_ERROR(LayOverStoredGraph(map_, &graph));
  for (const Node& node : graph.nodes) graph_agent_count_ += IsAgentKind(node.kind) ? 1 : 0;
  presence_.AddGraph(graph);
  Coalesce(&graph);
  return sink_.Put(std::move(graph));
}

absl::Status LogRun::TakePose(const PoseMeasurement& pose) {
  const NodeId agent = namer_.Assign(pose.agent_name, pose.agent_kind);
  const TimeNs time_ns = pose.pose.time_ns;
  const bool is_of_path = (is_timed_ || loops_.is_on()) && AddToPath(agent, pose);
  PoseMeasurement in_map = pose;
  if (is_of_path) in_map.pose = path_.InMap(pose.pose);
  const Eigen::Vector3d& position_map = in_map.pose.map_T_agent.position;
  builder_.AddPose(agent, in_map);
  if (!is_timed_) {
    presence_.Observe(agent, time_ns, position_map);
    if (builder_.pose_count() < options_.poses_per_delta) return absl::OkStatus();
    return sink_.Put(builder_.Take(presence_.TakeChanges()));
  }
  DSG_RETURN_IF_ERROR(presence_.Await(agent, time_ns, position_map));
  if (!is_of_path) return absl::OkStatus();
  if (is_followed_) DSG_RETURN_IF_ERROR(CommitPoses(time_ns));
  frames_.NotePose();
  for (Stage* stage : stages_) stage->NotePose(time_ns);
  return SeeFrames();
}

// Somebody may ask where the robot is now: that does not wait for what pictures show. By the log's
// time, so that a run that was cut off finds the same deltas.
absl::Status LogRun::CommitPoses(TimeNs now_ns) {
  const bool is_due =
      last_pose_ns_ == kTimeMin || now_ns - last_pose_ns_ >= options_.follow_pose_period_ns;
  if (!is_due) return absl::OkStatus();
  last_pose_ns_ = now_ns;
  return sink_.Put(builder_.Take({}));
}

// A log has one body that its sensors are on: poses of another robot are no path of its own.
bool LogRun::AddToPath(NodeId agent, const PoseMeasurement& pose) {
  if (pose.agent_kind != kinds::kRobot) return false;
  if (robot_.empty()) robot_ = agent;
  return agent == robot_ && path_.Add(pose.pose);
}

absl::Status LogRun::TakeSensor(Measurement& measurement) {
  const std::string channel = ChannelOf(measurement);
  const bool is_detection = std::holds_alternative<HumanDetection>(measurement);
  bool is_used = false;
  DSG_ASSIGN_OR_RETURN(std::vector<HumanDetection> seen, detector_.Look(measurement));
  for (HumanDetection& detection : seen) {
    Measurement one = std::move(detection);
    is_used |= Spread(one);
  }
  // Where a network looks, the log's own detections would be the same people twice.
  if (!is_detection || !detector_.is_on()) is_used |= Spread(measurement);
  if (!is_used && !info_.used_channels.contains(channel)) ++unused_[channel];
  return SeeFrames();
}

// False when nobody has a use for it.
bool LogRun::Spread(Measurement& measurement) {
  bool is_used = loops_.Take(measurement);
  for (Stage* stage : stages_) is_used |= stage->Take(measurement);
  return frames_.Take(measurement) || is_used;
}

absl::Status LogRun::SeeFrames() {
  while (true) {
    std::optional<DepthFrame> frame;
    {
      const StageClock::Span span(&clock_, "images");
      frame = frames_.Next();
    }
    if (!frame.has_value()) return absl::OkStatus();
    for (Stage* stage : stages_) DSG_RETURN_IF_ERROR(stage->See(*frame));
  }
}

absl::Status LogRun::CommitIfDue(TimeNs now_ns) {
  if (!is_timed_ || now_ns == kTimeMin) return absl::OkStatus();
  last_ns_ = std::max(last_ns_, now_ns);
  if (begin_ns_ == kTimeMin) begin_ns_ = now_ns;
  if (now_ns - begin_ns_ < options_.mapping.commit_period_ns) return absl::OkStatus();
  begin_ns_ = now_ns;
  return Commit(now_ns, /*is_last=*/false);
}

// Stays end before what they are in is retired, and begin after what they are in is there.
absl::Status LogRun::Commit(TimeNs now_ns, bool is_last) {
  findings_.now_ns = now_ns;
  findings_.is_last = is_last;
  DSG_RETURN_IF_ERROR(sink_.Put(builder_.Take({})));
  DSG_RETURN_IF_ERROR(CorrectPath(is_last));
  if (is_last) DSG_RETURN_IF_ERROR(FuseAgain());
  GraphDelta delta;
  for (Stage* stage : stages_) stage->Tell(&findings_, &delta);
  if (findings_.is_moved) TellRobot(&delta);
  DSG_RETURN_IF_ERROR(findings_.status);
  DSG_RETURN_IF_ERROR(path_.status());
  presence_.TakeRegions(findings_);
  DSG_RETURN_IF_ERROR(PutStays(presence_.TakeRemembered()));
  DSG_RETURN_IF_ERROR(findings_.is_moved ? sink_.PutCorrection(std::move(delta))
                                         : sink_.PutAsIs(std::move(delta)));
  for (const PeopleTold::Sighting& seen : people_.told().TakeSightings()) {
    presence_.AwaitSighting(seen.agent, seen.time_ns, seen.position_map);
  }
  if (findings_.has_new_layers) DSG_RETURN_IF_ERROR(PutStays(presence_.Mend()));
  presence_.GoOn();
  return absl::OkStatus();
}

absl::Status LogRun::CommitStale() {
  if (is_timed_ || builder_.pose_count() == 0) {
    waits_since_.reset();
    return absl::OkStatus();
  }
  const auto now = std::chrono::steady_clock::now();
  if (!waits_since_.has_value()) waits_since_ = now;
  if (now - *waits_since_ < kStaleAfter) return absl::OkStatus();
  waits_since_.reset();
  return sink_.Put(builder_.Take(presence_.TakeChanges()));
}

absl::Status LogRun::Finish(std::vector<std::string> place_memory) {
  if (is_followed_ && is_timed_) DSG_RETURN_IF_ERROR(sink_.BeginEnd());
  frames_.Finish();
  DSG_RETURN_IF_ERROR(SeeFrames());
  for (Stage* stage : stages_) stage->Close();
  if (is_timed_) DSG_RETURN_IF_ERROR(Commit(last_ns_, /*is_last=*/true));
  presence_.Finish();
  if (is_timed_) {
    DSG_RETURN_IF_ERROR(PutStays(presence_.TakeRemembered()));
    DSG_RETURN_IF_ERROR(PutStays(presence_.Mend()));
  } else {
    DSG_RETURN_IF_ERROR(sink_.Put(builder_.Take(presence_.TakeChanges())));
  }
  DSG_RETURN_IF_ERROR(PutPlaceMemory(std::move(place_memory)));
  DSG_RETURN_IF_ERROR(sink_.Put(builder_.TakeNodes()));
  DSG_RETURN_IF_ERROR(PutRobotGraph());
  return PutContacts();
}

// Each part for itself, so that a message to a server holds it.
absl::Status LogRun::PutPlaceMemory(std::vector<std::string> parts) {
  std::vector<Sha256> remembered;
  for (std::string& part : parts) {
    GraphDelta delta;
    remembered.push_back(ComputeSha256(part));
    delta.assets.push_back({remembered.back(), std::string(kPlaceMemoryType), std::move(part)});
    DSG_RETURN_IF_ERROR(sink_.Put(std::move(delta)));
  }
  if (!remembered.empty()) builder_.Remember(robot_, std::move(remembered));
  return absl::OkStatus();
}

IngestSummary LogRun::Summary() const {
  IngestSummary summary;
  summary.agent_count = graph_agent_count_ + builder_.agent_count() + people_.told().agent_count();
  summary.committed = sink_.counts();
  summary.unused = unused_;
  summary.misleading_names = namer_.misleading();
  // A followed log may have had some.
  if (has_loops_ && (!is_followed_ || loops_.counts().loop_count > 0)) {
    summary.loops = loops_.counts();
  }
  for (const Stage* stage : stages_) stage->Summarize(&summary);
  if (!summary.mapping.has_value()) return summary;
  summary.mapping->skipped = frames_.skips();
  if (path_.refused_count() > 0) summary.mapping->skipped["broken pose"] = path_.refused_count();
  std::map<std::string, StageClock::Time> times = clock_.times();
  summary.mapping->stages.merge(times);
  return summary;
}

// As they are: these stays come later than their poses, so what the map holds of the poses tells
// nothing about the stays.
absl::Status LogRun::PutStays(std::vector<Stay> stays) {
  GraphDelta delta;
  delta.stays = std::move(stays);
  return sink_.PutAsIs(std::move(delta));
}

// All that hangs on the path moves with it, and is told in one delta.
absl::Status LogRun::CorrectPath(bool is_last) {
  const absl::StatusOr<TrajectoryChange> change = loops_.Correct(last_ns_, is_last);
  DSG_RETURN_IF_ERROR(path_.status());
  if (!change.ok()) return change.status();
  findings_.is_moved = !change->IsIdentity();
  if (!findings_.is_moved) return absl::OkStatus();
  for (Stage* stage : stages_) stage->Correct(*change);
  presence_.Correct(*change);
  return absl::OkStatus();
}

// What was mapped twice, before a loop closure and after it, is one again.
absl::Status LogRun::FuseAgain() {
  if (!layers_.is_on() || !path_.is_corrected() || !options_.mapping.fuses_again ||
      !options_.open_again) {
    return absl::OkStatus();
  }
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<LogSource> log, options_.open_again());
  DetectorFeed detector;
  if (detector_.is_on()) {
    DSG_ASSIGN_OR_RETURN(detector, DetectorFeed::Make(info_, *options_.people.detector,
                                                      options_.people.look.period_ns));
  }
  LogFrames frames(info_, options_.mapping.depth, path_, /*is_on=*/true);
  const int64_t frame_count = layers_.frame_count();
  layers_.BeginAgain();
  const auto fuse = [&]() -> absl::Status {
    const StageClock::Span span(&clock_, "fused again");
    while (const std::optional<DepthFrame> frame = frames.Next()) {
      DSG_RETURN_IF_ERROR(layers_.SeeAgain(*frame));
    }
    return absl::OkStatus();
  };
  for (int64_t count = 1;; ++count) {
    DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log->Next());
    if (!measurement.has_value()) break;
    DSG_ASSIGN_OR_RETURN(std::vector<HumanDetection> seen, detector.Look(*measurement));
    for (HumanDetection& detection : seen) {
      Measurement one = std::move(detection);
      frames.Take(one);
    }
    const bool is_doubled =
        detector.is_on() && std::holds_alternative<HumanDetection>(*measurement);
    if (!is_doubled) frames.Take(*measurement);
    DSG_RETURN_IF_ERROR(fuse());
    if (options_.on_work) options_.on_work("fusing again", count, log->info().measurement_count);
  }
  frames.Finish();
  DSG_RETURN_IF_ERROR(fuse());
  return CheckSame(frames.skips(), frame_count);
}

// A log that went away while it was read again would leave an empty map behind a good one.
absl::Status LogRun::CheckSame(const SkipCounts& skips, int64_t frame_count) const {
  std::string change;
  if (layers_.frame_count() < frame_count) {
    change = absl::StrCat(layers_.frame_count(), " depth frames of ", frame_count);
  }
  for (const auto& [reason, count] : skips) {
    const auto first = frames_.skips().find(reason);
    const int64_t before = first == frames_.skips().end() ? 0 : first->second;
    if (count > before) change = absl::StrCat(reason, ": ", count, " times, before ", before);
  }
  if (change.empty()) return absl::OkStatus();
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(info_.path,
                                " was read again, to be fused along its corrected path, and is not "
                                "what it was (",
                                change,
                                "); nothing of that is committed: restore the log and "
                                "run the same again"),
                   {{"file", info_.path}});
}

void LogRun::TellRobot(GraphDelta* delta) {
  std::vector<TimedPose> poses = loops_.CorrectedPoses();
  delta->nodes.push_back(builder_.Move(robot_, poses.back().map_T_agent));
  delta->corrections.push_back(
      {robot_, poses.front().time_ns, poses.back().time_ns + 1, std::move(poses)});
  delta->message = "moved by loop closures";
  Coalesce(delta);
}

// The factors behind the robot's trajectory.
absl::Status LogRun::PutRobotGraph() {
  DSG_ASSIGN_OR_RETURN(std::vector<PoseFactor> factors, loops_.Factors());
  DSG_RETURN_IF_ERROR(path_.status());
  GraphDelta delta;
  if (!factors.empty()) delta.factors.push_back({robot_, std::move(factors)});
  return sink_.PutCorrection(std::move(delta));
}

absl::Status LogRun::PutContacts() {
  if (!people_.is_on()) return absl::OkStatus();
  const std::vector<ThingBox> things = ThingsOf(layers_.graph());
  GraphDelta delta;
  delta.edges =
      FindContactEdges(people_.tracker(), people_.told(), things, options_.people.contacts);
  const std::vector<Edge> held = HeldEdges();
  delta.edges.insert(delta.edges.end(), held.begin(), held.end());
  DSG_RETURN_IF_ERROR(people_.status());
  Coalesce(&delta);
  return sink_.PutAsIs(std::move(delta));
}

// Nobody is asked for their hands: what they carried was seen.
std::vector<Edge> LogRun::HeldEdges() const {
  std::vector<Node> objects = layers_.graph().nodes;
  std::erase_if(objects, [](const Node& node) { return node.kind != kinds::kObject; });
  std::vector<AgentPath> paths;
  for (const auto& [number, person] : people_.told().people()) {
    AgentPath& path = paths.emplace_back();
    path.agent = person.id;
    for (const TimedPose& pose : people_.told().PosesOf(person)) {
      path.torso.push_back({pose.time_ns, pose.map_T_agent.position});
    }
  }
  return FindHeldEdges(paths, layers_.Carries(), objects, options_.people.held);
}

}  // namespace dsg::ingest
