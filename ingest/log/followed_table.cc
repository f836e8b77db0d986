// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/followed_log.h"
#include "ingest/log/format.h"
#include "ingest/log/frame_clock.h"
#include "ingest/log/text_rows.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr size_t kPieceBytes = size_t{4} << 20;
// No row is longer; what is has no lines.
constexpr size_t kLineBytesMax = size_t{1} << 20;
// Eight numbers are obsmat only if so many rows say so (format.cc); fewer may turn out to be TUM's.
constexpr int kRowsToTell = 10;
// How long the rows of an instant wait for others of it.
constexpr std::chrono::milliseconds kHold(1000);
// From so many rows on a share of repeats says something.
constexpr int64_t kRowsToJudge = 1000;

bool IsRemark(std::string_view line) { return line.starts_with('#'); }

// Lines that are neither blank nor remarks.
int CountRows(std::string_view lines) {
  LineReader reader(lines);
  TextLine line;
  int count = 0;
  while (reader.Next(&line)) count += IsRemark(line.text) ? 0 : 1;
  return count;
}

// One row and who it is of.
struct Row {
  std::string agent;
  std::string kind;
  TrackRow row;
};

class FollowedTable : public LogSource {
 public:
  FollowedTable(std::unique_ptr<GrowingFile> file, const LogOptions& options)
      : file_(std::move(file)), options_(options) {
    info_.path = file_->path();
  }

  const LogInfo& info() const override { return info_; }
  void SetIdle(std::function<absl::Status()> idle) override { file_->SetIdle(std::move(idle)); }

  /// Waits for what identifies the log.
  absl::Status Begin() {
    DSG_RETURN_IF_ERROR(FindFormat());
    DSG_RETURN_IF_ERROR(Identify());
    DSG_RETURN_IF_ERROR(TakeLines(std::exchange(lines_, {})));
    while (ready_.empty() && held_.empty()) {
      DSG_ASSIGN_OR_RETURN(const bool has_more, ReadOn());
      if (!has_more && ready_.empty()) return HasNoRow();
    }
    info_.first_ns = ready_.empty() ? held_.front().row.time_ns : ready_.front().row.time_ns;
    return absl::OkStatus();
  }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    while (ready_.empty()) {
      DSG_ASSIGN_OR_RETURN(const bool has_more, ReadOn());
      if (!has_more && ready_.empty()) return std::nullopt;
    }
    Row row = std::move(ready_.front());
    ready_.pop_front();
    return Measurement(PoseMeasurement{.agent_name = std::move(row.agent),
                                       .agent_kind = std::move(row.kind),
                                       .pose = {.time_ns = row.row.time_ns,
                                                .flags = row.row.flags,
                                                .map_T_agent = row.row.map_T_agent,
                                                .covariance = nullptr},
                                       .line = row.row.line});
  }

 private:
  absl::Status HasNoRow() const {
    return MalformedFile(info_.path, "ends before its first row; is its writer running?");
  }

  // Appends whole lines to lines_. False at the end of the log.
  absl::StatusOr<bool> ReadLines(std::optional<std::chrono::milliseconds> patience = {}) {
    while (true) {
      DSG_ASSIGN_OR_RETURN(const GrowingFile::Wait wait, file_->WaitBeyond(at_, patience));
      if (wait == GrowingFile::Wait::kPatience) return true;
      if (wait == GrowingFile::Wait::kEnd) return false;
      DSG_ASSIGN_OR_RETURN(const std::string piece, file_->Read(at_, kPieceBytes));
      at_ += piece.size();
      half_line_ += piece;
      const size_t end = half_line_.rfind('\n');
      if (end != std::string::npos) {
        lines_ += half_line_.substr(0, end + 1);
        half_line_.erase(0, end + 1);
      }
      if (half_line_.size() > kLineBytesMax) {
        return MalformedFile(
            info_.path, absl::StrCat("has a line of more than ", kLineBytesMax, " bytes at byte ",
                                     at_ - half_line_.size(), "; no table of rows has"));
      }
      if (end != std::string::npos) return true;
    }
  }

  absl::Status FindFormat() {
    info_.format = options_.format;
    while (true) {
      DSG_ASSIGN_OR_RETURN(const bool has_more, ReadLines());
      const int row_count = CountRows(lines_);
      if (row_count == 0 && !has_more) return HasNoRow();
      if (row_count == 0) continue;
      if (options_.format == "auto") {
        DSG_ASSIGN_OR_RETURN(info_.format, DetectFileFormat(lines_, info_.path));
        if (info_.format == "obsmat" && row_count < kRowsToTell && has_more) continue;
      }
      if (IsRowFormat(info_.format)) return absl::OkStatus();
      return MakeError(
          Reason::kFieldInvalid,
          absl::StrCat(info_.path, ": a ", info_.format,
                       " file cannot be followed; tables of poses or tracks and MCAP files can: "
                       "take it when it is finished"),
          {{"field", "follow"}, {"value", info_.path}});
    }
  }

  // The header and the first row.
  absl::Status Identify() {
    while (true) {
      LineReader reader(lines_);
      TextLine line;
      std::string begin;
      while (reader.Next(&line)) {
        const std::string text(line.text);
        const bool is_first = begin.empty();
        if (is_first && HasHeader(text)) {
          header_ = text;
        } else if (IsRemark(text)) {
          continue;
        }
        absl::StrAppend(&begin, text, "\n");
        if (text == header_ && is_first) continue;
        info_.content_sha256 = Sha256Hex(absl::StrCat("followed\n", info_.format, "\n", begin));
        return absl::OkStatus();
      }
      DSG_ASSIGN_OR_RETURN(const bool has_more, ReadLines());
      if (!has_more) return HasNoRow();
    }
  }

  bool HasHeader(const std::string& first_line) const {
    if (info_.format == "euroc") return IsRemark(first_line);
    return info_.format == "csv" || info_.format == "dsg-tracks";
  }

  // Waits for more rows. False at the end of the log.
  absl::StatusOr<bool> ReadOn() {
    const bool holds = !held_.empty();
    DSG_ASSIGN_OR_RETURN(const bool has_more,
                         ReadLines(holds ? std::optional(kHold) : std::nullopt));
    if (!lines_.empty()) {
      DSG_RETURN_IF_ERROR(TakeLines(std::exchange(lines_, {})));
      return true;
    }
    ReleaseHeld();
    if (!has_more) DSG_RETURN_IF_ERROR(End());
    return has_more;
  }

  absl::Status TakeLines(const std::string& lines) {
    LogFile piece;
    piece.path = info_.path;
    const bool is_first = line_count_ == 0;
    if (!is_first) {
      piece.bytes = absl::StrCat(header_, "\n");
      piece.lines_left_out = line_count_ - 1;
    }
    piece.bytes += lines;
    line_count_ += std::count(lines.begin(), lines.end(), '\n');
    DSG_ASSIGN_OR_RETURN(TextRows rows, ReadTextRows(info_.format, piece, options_));
    if (is_first) {
      for (const std::string& note : rows.notes) info_.notes.push_back(note);
      info_.notes.push_back("the log is followed: it is committed while it grows");
      if (rows.is_robot) info_.channel_counts["poses"] = 0;
    }
    if (rows.is_robot) info_.channel_counts["poses"] += std::ssize(rows.table.rows);
    may_repeat_ = rows.may_repeat && !options_.is_strict;
    for (const TrackRow& row : rows.table.rows) {
      const TrackTable::Agent& agent = rows.table.agents[static_cast<size_t>(row.agent)];
      DSG_RETURN_IF_ERROR(TakeRow({agent.name, agent.kind, row}, rows.clock));
    }
    // Nobody else can come to the instant of the only agent.
    if (rows.is_of_one) ReleaseHeld();
    return absl::OkStatus();
  }

  absl::Status TakeRow(Row row, RowClock clock) {
    if (clock == RowClock::kFrames) return TakeFrame(std::move(row));
    if (clock == RowClock::kAny) {
      if (!has_row_) SetClockOf(row.row.time_ns);
      if (!info_.has_clock) {
        DSG_ASSIGN_OR_RETURN(row.row.time_ns,
                             AddToEpoch(At(row), options_.epoch_ns, row.row.time_ns));
      }
    } else if (clock == RowClock::kUnix) {
      info_.has_clock = true;
      info_.clock = Clock::kUnix;
    }
    has_row_ = true;
    return AddInOrder(std::move(row));
  }

  void SetClockOf(TimeNs first_ns) {
    info_.clock = ClockOf(first_ns);
    info_.has_clock = info_.clock == Clock::kUnix;
    if (info_.has_clock) return;
    info_.notes.push_back(
        "the stamps are before 2001-09-09, so they count from the epoch of the map (--epoch)");
  }

  // Frames become times once two of them say how far apart they are.
  absl::Status TakeFrame(Row row) {
    if (frame_step_ == 0) {
      frames_.push_back(std::move(row));
      const int64_t step = frames_.back().row.time_ns - frames_.front().row.time_ns;
      if (step < 0) return StepsBack(frames_.back(), frames_.front().row.time_ns, "frame");
      if (step == 0) return absl::OkStatus();
      first_frame_ = frames_.front().row.time_ns;
      frame_step_ = step;
      for (Row& waiting : std::exchange(frames_, {})) {
        DSG_RETURN_IF_ERROR(TakeFrame(std::move(waiting)));
      }
      return absl::OkStatus();
    }
    if (row.row.time_ns < first_frame_) return StepsBack(row, first_frame_, "frame");
    DSG_ASSIGN_OR_RETURN(row.row.time_ns,
                         FrameTime(At(row), options_, row.row.time_ns, first_frame_, frame_step_));
    return AddInOrder(std::move(row));
  }

  absl::Status AddInOrder(Row row) {
    const TimeNs time_ns = row.row.time_ns;
    if (newest_ns_.has_value() && time_ns < *newest_ns_) return StepsBack(row, *newest_ns_, "time");
    ++row_count_;
    const auto [last, is_new] = last_of_.try_emplace({row.agent, row.kind}, time_ns);
    if (!is_new && last->second == time_ns) return Repeat(row);
    last->second = time_ns;
    if (last_of_.size() > kAgentsOfLogMax) {
      return At(row).Error(absl::StrCat("the log has more than ", kAgentsOfLogMax,
                                        " agents; is another column the agent's id?"));
    }
    if (newest_ns_ != time_ns) ReleaseHeld();
    newest_ns_ = time_ns;
    held_.push_back(std::move(row));
    return absl::OkStatus();
  }

  absl::Status Repeat(const Row& row) {
    ++repeat_count_;
    const bool is_rare = row_count_ < kRowsToJudge || repeat_count_ * 100 <= row_count_;
    if (may_repeat_ && is_rare) return absl::OkStatus();
    return At(row).Error(absl::StrCat("agent \"", row.agent, "\" is told of twice at time ",
                                      row.row.time_ns, "; keep one of the rows"));
  }

  absl::Status StepsBack(const Row& row, TimeNs newest, const std::string& unit) const {
    return At(row).Error(
        absl::StrCat("agent \"", row.agent, "\" is at ", unit, " ", row.row.time_ns,
                     ", after a row of ", unit, " ", newest,
                     "; the rows of a log that is followed must come in the order of time: sort "
                     "them, and take it without --follow when it is finished"));
  }

  // As a finished log has them.
  void ReleaseHeld() {
    std::sort(held_.begin(), held_.end(), [](const Row& a, const Row& b) {
      return std::tie(a.agent, a.kind) < std::tie(b.agent, b.kind);
    });
    std::move(held_.begin(), held_.end(), std::back_inserter(ready_));
    held_.clear();
  }

  absl::Status End() {
    if (std::exchange(is_ended_, true)) return absl::OkStatus();
    for (Row& row : std::exchange(frames_, {})) {
      // One frame alone is at the epoch, whatever the step.
      row.row.time_ns = options_.epoch_ns;
      DSG_RETURN_IF_ERROR(AddInOrder(std::move(row)));
    }
    ReleaseHeld();
    if (!half_line_.empty()) {
      info_.notes.push_back("the last line has no end and was not read");
    }
    if (repeat_count_ > 0) {
      info_.notes.push_back(absl::StrCat(repeat_count_, " of ", row_count_,
                                         " rows repeat the stamp of the row before: the first row "
                                         "of a stamp counts; --strict refuses them"));
    }
    return absl::OkStatus();
  }

  LinePosition At(const Row& row) const { return {info_.path, row.row.line}; }

  std::unique_ptr<GrowingFile> file_;
  LogOptions options_;
  LogInfo info_;
  /// How far the file has been read, and what of it is no whole line yet.
  uint64_t at_ = 0;
  std::string half_line_;
  /// Whole lines that nobody has looked at.
  std::string lines_;
  std::string header_;
  int64_t line_count_ = 0;
  bool may_repeat_ = false;
  bool has_row_ = false;
  bool is_ended_ = false;
  int64_t row_count_ = 0;
  int64_t repeat_count_ = 0;
  int64_t first_frame_ = 0;
  /// 0 = not known yet.
  int64_t frame_step_ = 0;
  std::vector<Row> frames_;
  std::optional<TimeNs> newest_ns_;
  /// By name and kind.
  std::map<std::pair<std::string, std::string>, TimeNs> last_of_;
  /// Rows of the newest stamp.
  std::vector<Row> held_;
  std::deque<Row> ready_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<LogSource>> OpenFollowedTable(std::unique_ptr<GrowingFile> file,
                                                             const LogOptions& options) {
  if (!options.topics.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(file->path(), ": a table has no topics; leave --topic out"),
                     {{"field", "topic"}, {"value", options.topics.begin()->first}});
  }
  auto log = std::make_unique<FollowedTable>(std::move(file), options);
  DSG_RETURN_IF_ERROR(log->Begin());
  return std::unique_ptr<LogSource>(std::move(log));
}

}  // namespace dsg::ingest
