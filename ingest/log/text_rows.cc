// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/text_rows.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "ingest/log/frame_clock.h"
#include "ingest/log/readers.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using RowReaderFunction = absl::StatusOr<TextRows> (*)(const LogFile&, const LogOptions&);

struct RowFormat {
  std::string_view name;
  RowReaderFunction read;
};

constexpr RowFormat kRowFormats[] = {
    {"obsmat", ReadObsmatRows},    {"trajnet", ReadTrajnetRows}, {"trajnet-ndjson", ReadNdjsonRows},
    {"euroc", ReadEurocRows},      {"tum", ReadTumRows},         {"csv", ReadCsvRows},
    {"dsg-tracks", ReadTracksRows}};

const RowFormat* FindRowFormat(std::string_view name) {
  const auto* const found =
      std::find_if(std::begin(kRowFormats), std::end(kRowFormats),
                   [&](const RowFormat& known) { return known.name == name; });
  return found == std::end(kRowFormats) ? nullptr : found;
}

}  // namespace

bool IsRowFormat(std::string_view format) { return FindRowFormat(format) != nullptr; }

absl::StatusOr<TextRows> ReadTextRows(std::string_view format, const LogFile& file,
                                      const LogOptions& options) {
  const RowFormat* const known = FindRowFormat(format);
  DSG_CHECK(known != nullptr);
  return known->read(file, options);
}

absl::StatusOr<std::unique_ptr<LogSource>> MakeTextLog(std::string_view format, TextRows rows,
                                                       const LogFile& file,
                                                       const LogOptions& options) {
  LogInfo info = DescribeTextLog(format, file);
  if (rows.clock == RowClock::kAny) {
    DSG_RETURN_IF_ERROR(SetClock(options, &rows.table, &info));
  } else if (rows.clock == RowClock::kUnix) {
    info.has_clock = true;
    info.clock = Clock::kUnix;
  }
  info.notes.insert(info.notes.end(), rows.notes.begin(), rows.notes.end());
  if (rows.may_repeat) DropRepeats(options.is_strict, &rows.table, &info.notes);
  if (rows.is_robot) info.channel_counts["poses"] = std::ssize(rows.table.rows);
  if (rows.clock == RowClock::kFrames) {
    return MakeFrameLog(std::move(rows.table), options, std::move(info));
  }
  return MakeClockLog(std::move(rows.table), std::nullopt, std::move(info));
}

}  // namespace dsg::ingest
