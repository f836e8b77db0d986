// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/ingest_log.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/agent_namer.h"
#include "ingest/pipeline/delta_builder.h"
#include "ingest/pipeline/graph_agents.h"
#include "ingest/pipeline/graph_boxes.h"
#include "ingest/pipeline/log_regions.h"
#include "ingest/pipeline/region_index.h"
#include "ingest/pipeline/session.h"
#include "ingest/pipeline/stay_mender.h"
#include "ingest/pipeline/stay_tracker.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

constexpr int64_t kPosesPerDeltaMax = 1'000'000;

// Of a measurement that no stage takes yet.
std::string ChannelOf(const Measurement& measurement) {
  if (const auto* image = std::get_if<ImageMeasurement>(&measurement)) return image->channel;
  return std::holds_alternative<ImuMeasurement>(measurement) ? "imu0" : "detections0";
}

std::string_view NameOf(PoseSource source) {
  switch (source) {
    case PoseSource::kGroundTruth:
      return "gt";
    case PoseSource::kExternal:
      return "external";
    case PoseSource::kAuto:
      break;
  }
  return "auto";
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

// The stages of one log, wired.
class LogRun {
 public:
  // `mapper`: null for logs without depth. `is_resumed`: an earlier run of the session was cut off.
  LogRun(const LogInfo& info, const IngestOptions& options, const MapView& map,
         const std::vector<Node>& agents, LogRegions regions, DeltaSink sink,
         std::unique_ptr<LogMapper> mapper, bool is_resumed)
      : options_(options),
        map_(map),
        namer_(agents),
        regions_(std::move(regions)),
        builder_(info.feet_below_m),
        sink_(std::move(sink)),
        mapper_(std::move(mapper)),
        is_resumed_(is_resumed) {}

  // Takes what it needs out of `measurement`.
  absl::Status Take(Measurement& measurement) {
    if (mapper_ != nullptr) DSG_RETURN_IF_ERROR(CommitIfDue(TimeOf(measurement)));
    if (auto* graph = std::get_if<GraphMeasurement>(&measurement)) {
      return TakeGraph(std::move(graph->delta));
    }
    if (auto* pose = std::get_if<PoseMeasurement>(&measurement)) return TakePose(*pose);
    if (mapper_ != nullptr && TakeSensor(&measurement)) return mapper_->Advance();
    ++unused_[ChannelOf(measurement)];
    return absl::OkStatus();
  }

  absl::Status Finish() {
    if (mapper_ != nullptr) {
      mapper_->Close();
      DSG_RETURN_IF_ERROR(mapper_->Advance());
      DSG_RETURN_IF_ERROR(Commit(last_ns_, /*is_update=*/true));
    }
    ReplayWaiting();
    Tracker().Finish();
    std::vector<Stay> stays = Tracker().TakeChanges();
    if (mapper_ == nullptr) {
      DSG_RETURN_IF_ERROR(sink_.Put(builder_.Take(std::move(stays))));
    } else {
      DSG_RETURN_IF_ERROR(PutStays(std::move(stays)));
      DSG_RETURN_IF_ERROR(PutStays(mender_.Mend(regions_.MakeIndex())));
    }
    return sink_.Put(builder_.TakeNodes());
  }

  IngestSummary Summary() const {
    IngestSummary summary{graph_agent_count_ + builder_.agent_count(), sink_.counts(), unused_, {}};
    if (mapper_ != nullptr) summary.mapping = mapper_->Summary();
    return summary;
  }

 private:
  struct Waiting {
    NodeId agent;
    TimeNs time_ns;
    Eigen::Vector3d position_map;
  };

  absl::Status TakePose(const PoseMeasurement& pose) {
    const NodeId agent = namer_.Assign(pose.agent_name, pose.agent_kind);
    builder_.AddPose(agent, pose);
    if (mapper_ == nullptr) {
      Tracker().Observe(agent, pose.pose.time_ns, pose.pose.map_T_agent.position);
      if (builder_.pose_count() < options_.poses_per_delta) return absl::OkStatus();
      return sink_.Put(builder_.Take(Tracker().TakeChanges()));
    }
    DSG_ASSIGN_OR_RETURN(const bool is_told, IsToldBefore(agent, pose.pose.time_ns));
    if (!is_told) {
      // Rooms and places that this log is about to show are not known yet.
      mender_.Observe(agent, pose.pose.time_ns, pose.pose.map_T_agent.position);
      waiting_.push_back({agent, pose.pose.time_ns, pose.pose.map_T_agent.position});
    }
    if (tracker_.has_value()) ReplayWaiting();
    mapper_->AddPose(pose);
    return mapper_->Advance();
  }

  // Where an agent was at a time that another log has told of already is that log's business.
  absl::StatusOr<bool> IsToldBefore(NodeId agent, TimeNs time_ns) {
    if (is_resumed_) return false;
    const auto [told_until, is_new] = told_until_ns_.try_emplace(agent, kTimeMin);
    if (is_new) {
      DSG_ASSIGN_OR_RETURN(const std::optional<TrackInfo> track, map_.FindTrack(agent));
      if (track.has_value()) told_until->second = track->last_ns;
    }
    return time_ns <= told_until->second;
  }

  // False when the mapper has no use for it.
  bool TakeSensor(Measurement* measurement) {
    if (auto* image = std::get_if<ImageMeasurement>(measurement)) {
      if (!mapper_->Uses(image->channel)) return false;
      mapper_->AddPicture(std::move(*image));
      return true;
    }
    // Detections mask people, but make no tracks yet: they count as not used.
    if (auto* human = std::get_if<HumanDetection>(measurement)) mapper_->AddDetection(*human);
    return false;
  }

  absl::Status CommitIfDue(TimeNs now_ns) {
    if (now_ns == kTimeMin) return absl::OkStatus();
    last_ns_ = std::max(last_ns_, now_ns);
    if (begin_ns_ == kTimeMin) begin_ns_ = now_ns;
    if (now_ns - begin_ns_ < options_.mapping.commit_period_ns) return absl::OkStatus();
    begin_ns_ = now_ns;
    return Commit(now_ns, mapper_->IsUpdateDue(now_ns));
  }

  // Stays end before what they are in is retired, and begin after what they are in is there.
  absl::Status Commit(TimeNs now_ns, bool is_update) {
    GraphDelta delta = mapper_->TakeMesh();
    if (is_update) {
      LogMapper::LayerChange change = mapper_->TakeLayers(now_ns);
      regions_.SetFound(std::move(change.regions));
      Tracker().SetRegions(regions_.MakeIndex());
      change.delta.mesh_blocks = std::move(delta.mesh_blocks);
      change.delta.mesh_removals = std::move(delta.mesh_removals);
      delta = std::move(change.delta);
    }
    DSG_RETURN_IF_ERROR(sink_.Put(builder_.Take({})));
    if (tracker_.has_value()) DSG_RETURN_IF_ERROR(PutStays(Tracker().TakeChanges()));
    DSG_RETURN_IF_ERROR(sink_.PutAsIs(std::move(delta)));
    if (is_update) DSG_RETURN_IF_ERROR(PutStays(mender_.Mend(regions_.MakeIndex())));
    if (tracker_.has_value()) ReplayWaiting();
    return absl::OkStatus();
  }

  // As they are: these stays come later than their poses, so what the map holds of the poses tells
  // nothing about the stays.
  absl::Status PutStays(std::vector<Stay> stays) {
    mender_.Remember(stays);
    GraphDelta delta;
    delta.stays = std::move(stays);
    return sink_.PutAsIs(std::move(delta));
  }

  void ReplayWaiting() {
    for (const Waiting& pose : waiting_) {
      Tracker().Observe(pose.agent, pose.time_ns, pose.position_map);
    }
    waiting_.clear();
  }

  absl::Status TakeGraph(GraphDelta graph) {
    DSG_RETURN_IF_ERROR(RenameAgents(&namer_, &graph));
    DSG_RETURN_IF_ERROR(LayOverStoredGraph(map_, &graph));
    for (const Node& node : graph.nodes) graph_agent_count_ += IsAgentKind(node.kind) ? 1 : 0;
    regions_.Add(graph);
    Coalesce(&graph);
    return sink_.Put(std::move(graph));
  }

  // Made when the first pose comes: by then the log's own rooms and places are known.
  StayTracker& Tracker() {
    if (!tracker_.has_value()) tracker_.emplace(regions_.MakeIndex(), map_.spec().gap_ns_max);
    return *tracker_;
  }

  IngestOptions options_;
  const MapView& map_;
  AgentNamer namer_;
  LogRegions regions_;
  std::optional<StayTracker> tracker_;
  DeltaBuilder builder_;
  DeltaSink sink_;
  std::unique_ptr<LogMapper> mapper_;
  bool is_resumed_;
  /// By agent, the end of its track when the log began.
  std::map<NodeId, TimeNs> told_until_ns_;
  StayMender mender_;
  /// When the piece of the log began that is not committed yet.
  TimeNs begin_ns_ = kTimeMin;
  TimeNs last_ns_ = kTimeMin;
  std::vector<Waiting> waiting_;
  int64_t graph_agent_count_ = 0;
  std::map<std::string, int64_t> unused_;
};

bool HasMapping(const LogInfo& info, const IngestOptions& options) {
  return options.mapping.is_on && !info.rig.cameras.empty();
}

SessionHeader MakeHeader(const LogInfo& info, const LogOptions& log_options,
                         const IngestOptions& options, const MapSpec& spec) {
  const SessionConfig config{.format = info.format,
                             .epoch_ns = log_options.epoch_ns,
                             .frame_period_ns = info.format == "rgbd" ? log_options.image_period_ns
                                                                      : log_options.frame_period_ns,
                             .agent_prefix = log_options.agent_prefix,
                             .mesh_block_size_m = log_options.mesh_block_size_m,
                             .poses_per_delta = options.poses_per_delta,
                             .poses = std::string(NameOf(log_options.poses)),
                             .up = options.up,
                             .mapping = HasMapping(info, options) ? options.mapping.Digest() : ""};
  // The file's name alone: where it lies on this machine is no property of the log.
  std::string name = std::filesystem::path(info.path).filename().string();
  // File names may be any bytes; a map holds text only.
  if (!IsUtf8(name)) name = "a file whose name is not UTF-8";
  return {.map = spec.name,
          .session_id = SessionId(info.content_sha256, config),
          .author = options.author,
          .message = absl::StrCat(name, " (", info.format, ")"),
          .config_digest = config.Digest()};
}

}  // namespace

absl::Status IngestOptions::Validate() const {
  if (poses_per_delta >= 1 && poses_per_delta <= kPosesPerDeltaMax) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("poses per delta is ", poses_per_delta, "; give 1 to ", kPosesPerDeltaMax),
      {{"field", "poses_per_delta"}, {"value", absl::StrCat(poses_per_delta)}});
}

absl::StatusOr<IngestSummary> IngestLog(LogSource& log, const LogOptions& log_options,
                                        const IngestOptions& options, const MapView& map,
                                        GraphWriter& writer,
                                        const std::function<void(int64_t)>& on_progress) {
  DSG_RETURN_IF_ERROR(options.Validate());
  SessionHeader header = MakeHeader(log.info(), log_options, options, map.spec());
  DSG_ASSIGN_OR_RETURN(const SessionState session, writer.GetSession(header.session_id));
  DSG_ASSIGN_OR_RETURN(const std::vector<Node> agents, map.NodesOfLayer(layers::kAgents));
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<LogMapper> mapper,
                       LogMapper::Make(log.info(), options.mapping, map, header.session_id));
  std::optional<NodeNumbering> own;
  if (mapper != nullptr) own = mapper->numbering();
  DSG_ASSIGN_OR_RETURN(LogRegions regions, LogRegions::Read(map, own));
  LogRun run(log.info(), options, map, agents, std::move(regions),
             DeltaSink(std::move(header), session.last_sequence, map, writer), std::move(mapper),
             session.last_sequence > 0);
  for (int64_t count = 1;; ++count) {
    DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log.Next());
    if (!measurement.has_value()) break;
    DSG_RETURN_IF_ERROR(run.Take(*measurement));
    if (on_progress) on_progress(count);
  }
  DSG_RETURN_IF_ERROR(run.Finish());
  return run.Summary();
}

}  // namespace dsg::ingest
