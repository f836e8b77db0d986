// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/frame_clock.h"

#include <algorithm>
#include <map>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

int64_t CommonestStep(const std::vector<int64_t>& frames) {
  std::map<int64_t, int64_t> count_of_step;
  for (size_t i = 1; i < frames.size(); ++i) ++count_of_step[frames[i] - frames[i - 1]];
  int64_t step = 1;
  int64_t count = 0;
  for (const auto& [candidate, candidate_count] : count_of_step) {
    if (candidate_count > count) {
      step = candidate;
      count = candidate_count;
    }
  }
  return step;
}

}  // namespace

absl::StatusOr<TimeNs> FrameTime(const LinePosition& at, const LogOptions& options, int64_t frame,
                                 int64_t first, int64_t step) {
  const __int128 scaled = static_cast<__int128>(frame - first) * options.frame_period_ns;
  const __int128 offset = (scaled + step / 2) / step;
  if (offset > kTimeMax) {
    return at.FieldError("frame", absl::StrCat(frame),
                         "lies more than 292 years after the first frame; correct the line");
  }
  return AddToEpoch(at, options.epoch_ns, static_cast<TimeNs>(offset));
}

absl::Status ApplyFrameClock(const LogOptions& options, TrackTable* table) {
  // Readers keep frames within +-2^53, so differences fit.
  std::vector<int64_t> frames;
  frames.reserve(table->rows.size());
  for (const TrackRow& row : table->rows) frames.push_back(row.time_ns);
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  const int64_t step = CommonestStep(frames);
  for (TrackRow& row : table->rows) {
    const LinePosition at{table->file, row.line};
    DSG_ASSIGN_OR_RETURN(row.time_ns, FrameTime(at, options, row.time_ns, frames.front(), step));
  }
  return CheckOrder(*table, "time");
}

absl::StatusOr<std::unique_ptr<LogSource>> MakeFrameLog(TrackTable table, const LogOptions& options,
                                                        LogInfo info) {
  DSG_RETURN_IF_ERROR(CheckRows(table));
  DSG_RETURN_IF_ERROR(CheckOrder(table, "frame"));
  DSG_RETURN_IF_ERROR(ApplyFrameClock(options, &table));
  return MakeTrackLog(std::move(table), std::nullopt, std::move(info));
}

}  // namespace dsg::ingest
