// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/ingest_log.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/commit/undone_session.h"
#include "ingest/log/format.h"
#include "ingest/pipeline/log_run.h"
#include "ingest/pipeline/session.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"
#include "schema/codec/checksum.h"

namespace dsg::ingest {
namespace {

constexpr int64_t kPosesPerDeltaMax = 1'000'000;

std::string_view NameOf(PoseSource source) {
  switch (source) {
    case PoseSource::kGroundTruth:
      return "gt";
    case PoseSource::kExternal:
      return "external";
    case PoseSource::kOdometry:
      return "vio";
    case PoseSource::kAuto:
      break;
  }
  return "auto";
}

bool HasMapping(const LogInfo& info, const IngestOptions& options) {
  return options.mapping.is_on && info.rig.HasEyes();
}

bool HasPeople(const LogInfo& info, const IngestOptions& options) {
  return options.people.is_on &&
         (options.people.detector.has_value() || info.channel_counts.contains("detections0"));
}

// Of its own, without any other measurement.
bool HasContent(const Measurement& measurement) {
  if (const auto* graph = std::get_if<GraphMeasurement>(&measurement)) {
    return !graph->delta.empty();
  }
  return std::holds_alternative<PoseMeasurement>(measurement);
}

// Whether its static layers are built: there are poses, and eyes that frames can be made of.
absl::StatusOr<bool> HasLayers(const LogInfo& info, const MappingOptions& options) {
  if (!options.is_on) return false;
  DSG_RETURN_IF_ERROR(options.Validate());
  const RobotPath no_path;
  return info.channel_counts.contains("poses") &&
         FrameMaker(info.rig, options.depth, no_path).CanMakeFrames();
}

std::string OdometryText(const LogInfo& info, const IngestOptions& ingest) {
  const RobotGraphOptions& options = ingest.robot_graph;
  const std::string tuning = DigestOptions(options);
  const bool fuses_again =
      HasMapping(info, ingest) && ingest.mapping.fuses_again && ingest.open_again;
  return absl::StrCat(options.odometry_m_per_m, " ", options.odometry_rad_per_m, " corrected ",
                      options.correct_period_ns, " ", options.correct_share, " ",
                      options.correct_min_m, fuses_again ? " fused again" : "",
                      tuning.empty() ? "" : " ", tuning);
}

// What differs from the defaults of stays, agents and path; loop closures count for logs that have
// some only.
std::string TuningText(IngestOptions options) {
  IngestOptions defaults;
  options.robot_graph = defaults.robot_graph;
  return DigestGroups(options.Groups(), defaults.Groups());
}

bool HasLoops(const LogInfo& info) { return info.channel_counts.contains("loops0"); }

bool HasLabels(const LogInfo& info) {
  return info.channel_counts.contains("label0") && !info.labels.empty();
}

SessionHeader MakeHeader(const LogInfo& info, const LogOptions& log_options,
                         const IngestOptions& options, const MapSpec& spec) {
  // A recording is the same log in any kind of file.
  const bool is_bag = IsBagFormat(info.format);
  const SessionConfig config{
      .format = is_bag ? "bag" : info.format,
      .epoch_ns = log_options.epoch_ns,
      .frame_period_ns =
          info.format == "rgbd" ? log_options.image_period_ns : log_options.frame_period_ns,
      .agent_prefix = log_options.agent_prefix,
      .mesh_block_size_m = log_options.mesh_block_size_m,
      .poses_per_delta = options.poses_per_delta,
      .poses = std::string(NameOf(log_options.poses)),
      .up = options.up,
      .transform = options.transform,
      .mapping = HasMapping(info, options) ? options.mapping.Digest(HasLabels(info)) : "",
      .people = HasPeople(info, options) ? options.people.Digest() : "",
      .odometry = HasLoops(info) ? OdometryText(info, options) : "",
      .robot_model =
          options.robot_model.has_value() ? ToHex(options.robot_model->asset.sha256) : "",
      .tuning = TuningText(options),
      .is_size_bounded = options.is_size_bounded && HasLoops(info)};
  // The file's name alone: where it lies on this machine is no property of the log.
  const std::filesystem::path path(info.path);
  std::string name = (is_bag ? path.stem() : path.filename()).string();
  // File names may be any bytes; a map holds text only.
  if (!IsUtf8(name)) name = "a file whose name is not UTF-8";
  return {.map = spec.name,
          .session_id = SessionId(info.content_sha256, config),
          .author = options.author,
          .message = absl::StrCat(name, " (", config.format, ")"),
          .config_digest = config.Digest()};
}

// Something of the map that has a place in it; nullopt in an empty one.
absl::StatusOr<std::optional<Node>> PlacedNode(const MapView& map,
                                               const std::vector<Node>& agents) {
  for (const Node& agent : agents) {
    DSG_ASSIGN_OR_RETURN(const std::optional<TrackInfo> track, map.FindTrack(agent.id));
    if (track.has_value()) return agent;
  }
  for (const LayerId layer : {layers::kRooms, layers::kObjects}) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Node> nodes, map.NodesOfLayer(layer));
    if (!nodes.empty()) return nodes.front();
  }
  return std::nullopt;
}

// Odometry begins where the log begins: in the frame of another log its poses would be anywhere.
absl::Status CheckFrame(const LogOptions& log_options, const IngestOptions& options,
                        const MapView& map, const std::vector<Node>& agents) {
  if (log_options.poses != PoseSource::kOdometry || !options.transform.empty()) {
    return absl::OkStatus();
  }
  DSG_ASSIGN_OR_RETURN(const std::optional<Node> other, PlacedNode(map, agents));
  if (!other.has_value()) return absl::OkStatus();
  return MakeError(
      Reason::kNoRegistration,
      absl::StrCat(
          "map \"", map.spec().name, "\" holds ", ToString(other->id), " \"", other->name,
          "\" in a frame of its own, and poses of --poses vio begin where the log begins: "
          "take the log into a map of its own with --recognize, and lay that over this one "
          "(dsg-align, dsg merge), or say where the log begins with --transform "
          "X,Y,Z,YAW"),
      {{"map", map.spec().name}, {"field", "transform"}});
}

}  // namespace

std::vector<OptionGroup> IngestOptions::Groups() {
  std::vector<BoundOption> agents = regions.Bind();
  std::vector<BoundOption> frame = path.Bind();
  const std::vector<BoundOption> bodies_bound = bodies.Bind();
  const std::vector<BoundOption> upright_bound = upright.Bind();
  agents.insert(agents.end(), bodies_bound.begin(), bodies_bound.end());
  frame.insert(frame.end(), upright_bound.begin(), upright_bound.end());
  frame.push_back({"follow-pose-period", &follow_pose_period_ns, 0.01, 3600.0,
                   "With --follow: least log time between commits of the robot's poses, seconds; "
                   "ten revisions a second"});
  return {{"agents and their stays", std::move(agents)},
          {"the robot's path", std::move(frame)},
          {"loop closures", robot_graph.Bind()}};
}

absl::Status IngestOptions::Validate() const {
  IngestOptions options = *this;
  DSG_RETURN_IF_ERROR(ValidateGroups(options.Groups()));
  if (poses_per_delta >= 1 && poses_per_delta <= kPosesPerDeltaMax) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("poses per delta is ", poses_per_delta, "; give 1 to ", kPosesPerDeltaMax),
      {{"field", "poses_per_delta"}, {"value", absl::StrCat(poses_per_delta)}});
}

absl::StatusOr<RunPlan> MakePlan(const LogInfo& info, const IngestOptions& options,
                                 const MapView& map, const std::string& session_id) {
  RunPlan plan;
  plan.options = options;
  plan.info = info;
  plan.session_id = session_id;
  plan.has_people = HasPeople(info, options);
  plan.has_loops = HasLoops(info);
  DSG_ASSIGN_OR_RETURN(plan.has_layers, HasLayers(info, options.mapping));
  std::optional<NodeNumbering> own;
  if (plan.has_layers) {
    plan.options.mapping = WithClasses(options.mapping, info);
    DSG_ASSIGN_OR_RETURN(plan.numbering, NumberLayers(map, session_id));
    own = plan.numbering;
  } else {
    plan.options.mapping = {};
    plan.options.mapping.commit_period_ns = options.mapping.commit_period_ns;
  }
  plan.options.mapping.volume.spill.folder = options.spill_folder;
  DSG_ASSIGN_OR_RETURN(plan.agents, map.NodesOfLayer(layers::kAgents));
  DSG_ASSIGN_OR_RETURN(plan.regions, LogRegions::Read(map, own));
  if (plan.has_people && options.people.detector.has_value()) {
    DSG_ASSIGN_OR_RETURN(plan.detector, DetectorFeed::Make(info, *options.people.detector,
                                                           options.people.look.period_ns));
  }
  return plan;
}

absl::StatusOr<IngestSummary> IngestLog(LogSource& log, const LogOptions& log_options,
                                        const IngestOptions& options, const MapView& map,
                                        GraphWriter& writer,
                                        const std::function<void(int64_t)>& on_progress) {
  DSG_RETURN_IF_ERROR(options.Validate());
  SessionHeader header = MakeHeader(log.info(), log_options, options, map.spec());
  const UndoneOptions undone{
      .is_told_again = options.tells_undone_again,
      .has_own_ids = HasMapping(log.info(), options) || HasPeople(log.info(), options)};
  DSG_ASSIGN_OR_RETURN(OpenedSession opened,
                       OpenSession(header.session_id, header.message, map, writer, undone));
  header.session_id = std::move(opened.session_id);
  const SessionState& session = opened.state;
  DSG_ASSIGN_OR_RETURN(RunPlan plan, MakePlan(log.info(), options, map, header.session_id));
  if (session.last_sequence == 0) {
    DSG_RETURN_IF_ERROR(CheckFrame(log_options, options, map, plan.agents));
  }
  plan.agent_prefix = log_options.agent_prefix;
  plan.first_revision = session.first_revision;
  const std::optional<FollowOptions>& follow = log_options.follow;
  if (follow.has_value()) {
    DSG_ASSIGN_OR_RETURN(const SessionState end,
                         writer.GetSession(EndSessionId(header.session_id)));
    plan.end_sequence = end.last_sequence;
  }
  LogRun run(
      std::move(plan), map,
      DeltaSink(std::move(header), session.last_sequence, options.is_size_bounded, map, writer));
  if (follow.has_value()) log.SetIdle([&run] { return run.CommitStale(); });
  int64_t given_count = 0;
  for (int64_t count = 1;; ++count) {
    DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log.Next());
    if (!measurement.has_value()) break;
    if (HasContent(*measurement)) ++given_count;
    DSG_RETURN_IF_ERROR(run.Take(*measurement));
    if (follow.has_value()) DSG_RETURN_IF_ERROR(run.CommitStale());
    if (on_progress) on_progress(count);
  }
  log.SetIdle({});
  const bool is_stopped = follow.has_value() && follow->stop != nullptr && *follow->stop;
  const bool is_paused = is_stopped && run.is_timed();
  if (!is_paused) DSG_RETURN_IF_ERROR(run.Finish(log.info().place_memory));
  IngestSummary summary = run.Summary();
  summary.is_paused = is_paused;
  summary.given_count = given_count;
  summary.was_known = session.last_sequence > 0;
  return summary;
}

}  // namespace dsg::ingest
