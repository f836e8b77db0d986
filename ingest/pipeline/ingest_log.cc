// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/ingest_log.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/session.h"
#include "ingest/log/format.h"
#include "ingest/pipeline/log_run.h"
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

bool HasLabels(const LogInfo& info) {
  return info.channel_counts.contains("label0") && !info.labels.empty();
}

bool HasLoops(const LogInfo& info) { return info.channel_counts.contains("loops0"); }

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
      .mapping = HasMapping(info, options) ? options.mapping.Digest(HasLabels(info)) : "",
      .people = HasPeople(info, options) ? options.people.Digest() : "",
      .odometry = HasLoops(info) ? absl::StrCat(options.robot_graph.odometry_m_per_m, " ",
                                                options.robot_graph.odometry_rad_per_m)
                                 : "",
      .robot_model =
          options.robot_model.has_value() ? ToHex(options.robot_model->asset.sha256) : "",
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
  LogRun::Parts parts{.options = options,
                      .agents = agents,
                      .regions = std::move(regions),
                      .mapper = std::move(mapper),
                      .session_id = header.session_id,
                      .agent_prefix = log_options.agent_prefix,
                      .feet_below_m = log.info().feet_below_m,
                      .has_loops = HasLoops(log.info()),
                      .first_revision = session.first_revision};
  if (HasPeople(log.info(), options)) {
    parts.people = std::make_unique<PersonMapper>(log.info().rig, options.people,
                                                  /*has_depth=*/parts.mapper != nullptr);
    if (options.people.detector.has_value()) {
      DSG_ASSIGN_OR_RETURN(parts.detector,
                           DetectorFeed::Make(log.info(), *options.people.detector));
    }
  }
  if (log.info().rig.HasEyes() || parts.has_loops) parts.robot.emplace(options.robot_graph);
  LogRun run(
      std::move(parts), map,
      DeltaSink(std::move(header), session.last_sequence, options.is_size_bounded, map, writer));
  int64_t given_count = 0;
  for (int64_t count = 1;; ++count) {
    DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log.Next());
    if (!measurement.has_value()) break;
    if (HasContent(*measurement)) ++given_count;
    DSG_RETURN_IF_ERROR(run.Take(*measurement));
    if (on_progress) on_progress(count);
  }
  DSG_RETURN_IF_ERROR(run.Finish());
  IngestSummary summary = run.Summary();
  summary.given_count = given_count;
  summary.was_known = session.last_sequence > 0;
  return summary;
}

}  // namespace dsg::ingest
