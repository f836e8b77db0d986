// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/sensor_log.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/files/spilled_rows.h"
#include "ingest/log/log_input.h"
#include "ingest/log/pose_table.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"
#include "schema/base/time.h"

namespace dsg::ingest {
namespace {

class SensorLog : public LogSource {
 public:
  SensorLog(std::vector<SensorChannel> channels, LogInfo info)
      : info_(std::move(info)), channels_(std::move(channels)), next_(channels_.size(), 0) {}

  const LogInfo& info() const override { return info_; }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    // A rig has a dozen channels: looking at each costs less than a heap.
    size_t first = channels_.size();
    for (size_t i = 0; i < channels_.size(); ++i) {
      if (next_[i] == channels_[i].times.size()) continue;
      if (first == channels_.size() ||
          channels_[i].times[next_[i]] < channels_[first].times[next_[first]]) {
        first = i;
      }
    }
    if (first == channels_.size()) return std::nullopt;
    absl::StatusOr<Measurement> measurement = channels_[first].make(next_[first]++);
    if (!measurement.ok()) return measurement.status();
    return std::optional<Measurement>(*std::move(measurement));
  }

 private:
  LogInfo info_;
  std::vector<SensorChannel> channels_;
  std::vector<size_t> next_;
};

absl::Status NoPoses(const std::string& value, const std::string& message) {
  return MakeError(Reason::kFieldInvalid, message, {{"field", "poses"}, {"value", value}});
}

std::string SpanText(const StampSpan& span) {
  return absl::StrCat(FormatRfc3339(span.first_ns), " to ", FormatRfc3339(span.last_ns), " (",
                      span.first_ns, " to ", span.last_ns, " ns)");
}

StampSpan SpanOf(const std::vector<SensorChannel>& channels,
                 std::initializer_list<ChannelRank> ranks) {
  StampSpan span;
  for (const SensorChannel& channel : channels) {
    if (channel.times.empty() || std::count(ranks.begin(), ranks.end(), channel.rank) == 0) {
      continue;
    }
    span.Add(channel.times.front());
    span.Add(channel.times.back());
  }
  return span;
}

// What stays of a pose until its turn.
struct PoseRow {
  TimeNs time_ns = 0;
  int64_t line = 0;
  int32_t agent = 0;
  uint32_t flags = 0;
  std::array<double, 3> position{};
  /// x, y, z, w.
  std::array<double, 4> orientation{};
};

PoseRow PoseRowOf(const TrackRow& given) {
  PoseRow row{given.time_ns, given.line, given.agent, given.flags, {}, {}};
  Eigen::Map<Eigen::Vector3d>(row.position.data()) = given.map_T_agent.position;
  Eigen::Map<Eigen::Vector4d>(row.orientation.data()) = given.map_T_agent.orientation.coeffs();
  return row;
}

}  // namespace

void StampSpan::Add(TimeNs time_ns) {
  first_ns = std::min(first_ns, time_ns);
  last_ns = std::max(last_ns, time_ns);
}

absl::Status CheckSharesTime(const LogOptions& options, const StampSpan& poses,
                             const std::string& path, const StampSpan& sensors) {
  if (options.pose_file.empty() || poses.is_empty() || sensors.is_empty()) return absl::OkStatus();
  if (poses.first_ns <= sensors.last_ns && sensors.first_ns <= poses.last_ns) {
    return absl::OkStatus();
  }
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("--pose-file ", options.pose_file, " holds poses from ", SpanText(poses),
                   ", but the sensors of ", path, " measured from ", SpanText(sensors),
                   "; give the poses of this log, by its clock (EuRoC stamps are nanoseconds, TUM "
                   "stamps seconds)"),
      {{"field", "pose_file"}, {"value", options.pose_file}});
}

absl::StatusOr<std::unique_ptr<LogSource>> MakeSensorLog(std::vector<SensorChannel> channels,
                                                         const LogOptions& options, LogInfo info) {
  StampSpan sensors = SpanOf(channels, {ChannelRank::kImu, ChannelRank::kImages});
  if (sensors.is_empty()) sensors = SpanOf(channels, {ChannelRank::kDetections});
  DSG_RETURN_IF_ERROR(
      CheckSharesTime(options, SpanOf(channels, {ChannelRank::kPoses}), info.path, sensors));
  std::sort(channels.begin(), channels.end(), [](const SensorChannel& a, const SensorChannel& b) {
    return std::tie(a.rank, a.name) < std::tie(b.rank, b.name);
  });
  // What others derived from the sensors begins with them; a stray stamp of theirs must not give a
  // map its epoch.
  std::optional<TimeNs> first_ns;
  std::optional<TimeNs> first_derived_ns;
  for (const SensorChannel& channel : channels) {
    info.channel_counts[channel.name] = static_cast<int64_t>(channel.times.size());
    info.measurement_count += static_cast<int64_t>(channel.times.size());
    if (channel.times.empty()) continue;
    std::optional<TimeNs>& first =
        channel.rank < ChannelRank::kDetections ? first_ns : first_derived_ns;
    first = std::min(first.value_or(kTimeMax), channel.times.front());
  }
  if (!first_ns.has_value()) first_ns = first_derived_ns;
  if (!first_ns.has_value()) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(info.path,
                                  ": no sensor of the log has a measurement; was the "
                                  "recording or the copy cut short?"),
                     {{"file", info.path}});
  }
  info.first_ns = *first_ns;
  return std::make_unique<SensorLog>(std::move(channels), std::move(info));
}

absl::Status CheckGrows(const std::string& file, int64_t line, const std::string& channel,
                        const std::vector<TimeNs>& times, TimeNs time_ns) {
  if (times.empty() || time_ns > times.back()) return absl::OkStatus();
  const char* const what = time_ns == times.back() ? " repeats the stamp " : " steps back from ";
  return LinePosition{file, line}.Error(
      absl::StrCat("channel ", channel, what, times.back(), " to ", time_ns,
                   "; stamps must grow: sort the table, or remove the line if the clock jumped"));
}

std::string RobotName(const LogOptions& options) {
  return options.agent_prefix.empty() ? "body" : options.agent_prefix;
}

absl::StatusOr<PoseChoice> ChoosePoseKind(const LogOptions& options, bool has_ground_truth,
                                          bool has_external, const std::string& path) {
  switch (options.poses) {
    case PoseSource::kGroundTruth:
      if (has_ground_truth) return PoseChoice::kGroundTruth;
      return NoPoses("gt", absl::StrCat(path,
                                        ": the log holds no ground truth of the robot's "
                                        "poses; give --poses external with --pose-file FILE"));
    case PoseSource::kExternal:
      if (has_external) return PoseChoice::kExternal;
      return NoPoses("external",
                     absl::StrCat(path,
                                  ": the log holds no poses by other software "
                                  "(state_external0/data.csv); give --pose-file FILE with "
                                  "EuRoC or TUM columns, or --poses gt"));
    case PoseSource::kOdometry:
      return PoseChoice::kNone;
    case PoseSource::kAuto:
      break;
  }
  if (has_external) return PoseChoice::kExternal;
  return has_ground_truth ? PoseChoice::kGroundTruth : PoseChoice::kNone;
}

absl::StatusOr<std::optional<TrackTable>> ChoosePoses(const LogOptions& options, PoseTables tables,
                                                      LogDigest* digest, LogInfo* info) {
  if (!options.pose_file.empty()) {
    if (options.poses == PoseSource::kGroundTruth) {
      return NoPoses("gt", absl::StrCat("--pose-file ", options.pose_file,
                                        " is not the log's ground truth; give --poses external"));
    }
    if (options.poses == PoseSource::kOdometry) {
      return NoPoses("vio", absl::StrCat("--pose-file ", options.pose_file,
                                         ": with --poses vio the poses are estimated; leave one "
                                         "of both out"));
    }
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadInput(options.pose_file));
    digest->Add("--pose-file", file.bytes);
    DSG_ASSIGN_OR_RETURN(tables.external, ReadPoseTable(file, RobotName(options)));
  }
  DSG_ASSIGN_OR_RETURN(const PoseChoice choice,
                       ChoosePoseKind(options, tables.ground_truth.has_value(),
                                      tables.external.has_value(), info->path));
  if (options.poses == PoseSource::kOdometry) return std::nullopt;
  if (choice == PoseChoice::kNone) {
    info->notes.push_back(
        "the log holds no poses of the robot, so nothing can be mapped; let them be estimated "
        "(--poses vio) or give --pose-file");
    return std::nullopt;
  }
  TrackTable table = choice == PoseChoice::kExternal ? *std::move(tables.external)
                                                     : *std::move(tables.ground_truth);
  info->notes.push_back(absl::StrCat(
      "the robot's poses are ",
      choice == PoseChoice::kExternal ? "external: " : "the log's ground truth: ", table.file));
  DSG_RETURN_IF_ERROR(CheckRows(table));
  DropRepeats(options.is_strict, &table, &info->notes);
  DSG_RETURN_IF_ERROR(CheckOrder(table, "time"));
  return table;
}

SensorChannel MakePoseChannel(TrackTable table) {
  SensorChannel channel{.name = "poses", .rank = ChannelRank::kPoses, .times = {}, .make = {}};
  channel.times.reserve(table.rows.size());
  for (const TrackRow& row : table.rows) channel.times.push_back(row.time_ns);
  // Shared, since a std::function must be copyable.
  const auto rows = std::make_shared<SpilledRows<PoseRow>>();
  absl::Status status;
  for (const TrackRow& row : table.rows) status.Update(rows->Add(PoseRowOf(row)));
  table.rows = {};
  const auto shared = std::make_shared<const TrackTable>(std::move(table));
  channel.make = [shared, rows, status](size_t index) -> absl::StatusOr<Measurement> {
    if (!status.ok()) return status;
    DSG_ASSIGN_OR_RETURN(const PoseRow row, rows->At(index));
    const TrackTable::Agent& agent = shared->agents[row.agent];
    PoseMeasurement pose{.agent_name = agent.name, .agent_kind = agent.kind, .line = row.line};
    pose.pose.time_ns = row.time_ns;
    pose.pose.flags = row.flags;
    pose.pose.map_T_agent.position = Eigen::Map<const Eigen::Vector3d>(row.position.data());
    pose.pose.map_T_agent.orientation.coeffs() =
        Eigen::Map<const Eigen::Vector4d>(row.orientation.data());
    return Measurement(std::move(pose));
  };
  return channel;
}

}  // namespace dsg::ingest
