// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/track_log.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

class TrackLog : public LogSource {
 public:
  TrackLog(TrackTable table, std::optional<GraphMeasurement> graph, LogInfo info)
      : info_(std::move(info)), table_(std::move(table)), graph_(std::move(graph)) {}

  const LogInfo& info() const override { return info_; }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (graph_.has_value()) {
      Measurement graph = *std::move(graph_);
      graph_.reset();
      return graph;
    }
    if (next_ == table_.rows.size()) return std::nullopt;
    const TrackRow& row = table_.rows[next_++];
    const TrackTable::Agent& agent = table_.agents[row.agent];
    PoseMeasurement measurement{.agent_name = agent.name,
                                .agent_kind = agent.kind,
                                .pose = {.time_ns = row.time_ns,
                                         .flags = row.flags,
                                         .map_T_agent = row.map_T_agent,
                                         .covariance = nullptr},
                                .line = row.line};
    return Measurement(std::move(measurement));
  }

 private:
  LogInfo info_;
  TrackTable table_;
  std::optional<GraphMeasurement> graph_;
  size_t next_ = 0;
};

absl::Status OrderError(const TrackTable& table, std::string_view unit, const TrackRow& before,
                        const TrackRow& row) {
  const LinePosition at{table.file, row.line};
  const std::string& name = table.agents[row.agent].name;
  const std::string word(unit);
  if (row.time_ns < before.time_ns) {
    return at.Error(absl::StrCat("agent \"", name, "\" steps back from ", word, " ", before.time_ns,
                                 " (line ", before.line, ") to ", word, " ", row.time_ns,
                                 "; sort the log by ", word,
                                 ", or remove the line if the clock jumped"));
  }
  if (row.map_T_agent.position == before.map_T_agent.position &&
      row.map_T_agent.orientation.coeffs() == before.map_T_agent.orientation.coeffs()) {
    return at.Error(absl::StrCat("repeats line ", before.line, ": agent \"", name, "\" at ", word,
                                 " ", before.time_ns, " and again at ", word, " ", row.time_ns,
                                 "; remove the duplicate row"));
  }
  return at.Error(absl::StrCat("agent \"", name, "\" is in two positions at ", word, " ",
                               before.time_ns, " (line ", before.line, ") and ", word, " ",
                               row.time_ns, "; keep one of the rows, or give one another id"));
}

}  // namespace

int32_t TrackTable::FindOrAdd(std::string_view name, std::string_view kind) {
  // Kinds hold no line feed, so the joined key is unambiguous.
  std::string key = absl::StrCat(std::string(kind), "\n", std::string(name));
  const auto [entry, is_new] =
      index_.try_emplace(std::move(key), static_cast<int32_t>(agents.size()));
  if (is_new) agents.push_back({std::string(name), std::string(kind)});
  return entry->second;
}

void TrackTable::AddPosition(TimeNs time_ns, int64_t line, int32_t agent,
                             const Eigen::Vector3d& position) {
  rows.push_back(
      {.time_ns = time_ns,
       .line = line,
       .agent = agent,
       .flags = pose_flags::kNoOrientation,
       .map_T_agent = {.position = position, .orientation = Eigen::Quaterniond::Identity()}});
}

absl::Status CheckRows(const TrackTable& table) {
  if (table.rows.empty()) {
    return LinePosition{table.file, 1}.Error(
        "the log holds no row; was the recording or the copy cut short?");
  }
  if (table.agents.size() <= kAgentsOfLogMax) return absl::OkStatus();
  return LinePosition{table.file, 1}.Error(
      absl::StrCat("the log has ", table.agents.size(), " agents in ", table.rows.size(),
                   " rows; a log may have ", kAgentsOfLogMax,
                   ": split it by time, or look whether another column is the agent's id"));
}

absl::Status CheckOrder(const TrackTable& table, std::string_view unit) {
  std::vector<const TrackRow*> last(table.agents.size(), nullptr);
  for (const TrackRow& row : table.rows) {
    const TrackRow*& before = last[row.agent];
    if (before != nullptr && row.time_ns <= before->time_ns) {
      return OrderError(table, unit, *before, row);
    }
    before = &row;
  }
  return absl::OkStatus();
}

void DropRepeats(bool is_strict, TrackTable* table, std::vector<std::string>* notes) {
  if (is_strict) return;
  std::vector<TrackRow> kept;
  kept.reserve(table->rows.size());
  std::vector<std::optional<TimeNs>> last(table->agents.size());
  int64_t first_line = 0;
  for (const TrackRow& row : table->rows) {
    std::optional<TimeNs>& last_ns = last[static_cast<size_t>(row.agent)];
    if (last_ns == row.time_ns) {
      if (first_line == 0) first_line = row.line;
      continue;
    }
    last_ns = row.time_ns;
    kept.push_back(row);
  }
  const size_t count = table->rows.size() - kept.size();
  if (count == 0 || count * 100 > table->rows.size()) return;
  table->rows = std::move(kept);
  notes->push_back(absl::StrCat(count, " of ", table->rows.size() + count, " rows of ", table->file,
                                " repeat the stamp of the row before (first in line ", first_line,
                                "): the first row of a stamp counts; --strict refuses them"));
}

absl::Status SetClock(const LogOptions& options, TrackTable* table, LogInfo* info) {
  if (table->rows.empty()) return absl::OkStatus();
  info->clock = ClockOf(table->rows.front().time_ns);
  info->has_clock = info->clock == Clock::kUnix;
  const TimeNs epoch_ns = info->has_clock ? 0 : options.epoch_ns;
  for (TrackRow& row : table->rows) {
    DSG_ASSIGN_OR_RETURN(row.time_ns,
                         AddToEpoch(LinePosition{table->file, row.line}, epoch_ns, row.time_ns));
  }
  if (!info->has_clock) {
    info->notes.push_back(
        "the stamps are before 2001-09-09, so they count from the epoch of the map (--epoch)");
  }
  return absl::OkStatus();
}

std::unique_ptr<LogSource> MakeTrackLog(TrackTable table, std::optional<GraphMeasurement> graph,
                                        LogInfo info) {
  std::sort(table.rows.begin(), table.rows.end(), [&table](const TrackRow& a, const TrackRow& b) {
    if (a.time_ns != b.time_ns) return a.time_ns < b.time_ns;
    if (a.agent == b.agent) return a.line < b.line;
    const TrackTable::Agent& first = table.agents[a.agent];
    const TrackTable::Agent& second = table.agents[b.agent];
    return std::tie(first.name, first.kind) < std::tie(second.name, second.kind);
  });
  info.measurement_count =
      static_cast<int64_t>(table.rows.size()) + static_cast<int64_t>(graph.has_value());
  if (!table.rows.empty()) info.first_ns = table.rows.front().time_ns;
  return std::make_unique<TrackLog>(std::move(table), std::move(graph), std::move(info));
}

absl::StatusOr<std::unique_ptr<LogSource>> MakeClockLog(TrackTable table,
                                                        std::optional<GraphMeasurement> graph,
                                                        LogInfo info) {
  DSG_RETURN_IF_ERROR(CheckRows(table));
  DSG_RETURN_IF_ERROR(CheckOrder(table, "time"));
  return MakeTrackLog(std::move(table), std::move(graph), std::move(info));
}

}  // namespace dsg::ingest
