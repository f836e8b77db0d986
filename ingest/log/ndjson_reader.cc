// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "ingest/log/readers.h"
#include "ingest/log/text_table.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Json = nlohmann::json;

// The field as text, so that the checks of text tables serve here too.
absl::StatusOr<std::string> NumberField(const LinePosition& at, const Json& track,
                                        const char* key) {
  const auto found = track.find(key);
  if (found == track.end()) {
    return at.Error(absl::StrCat("track has no field \"", key,
                                 "\"; a track has f, p, x, y; correct or remove the line"));
  }
  if (!found->is_number()) {
    // Printing a nested value would recurse as deep as the log asks for.
    const std::string shown = found->is_structured()
                                  ? found->type_name()
                                  : found->dump(-1, ' ', true, Json::error_handler_t::replace);
    return at.FieldError(key, shown, "a number is due; correct or remove the line");
  }
  return found->dump();
}

absl::Status AddTrack(const LogOptions& options, const LinePosition& at, const Json& track,
                      TrackTable* table) {
  if (!track.is_object()) return at.Error("\"track\" is no object; correct or remove the line");
  if (track.contains("prediction_number")) {
    return at.Error("is a predicted track, no observation; remove lines with prediction_number");
  }
  DSG_ASSIGN_OR_RETURN(const std::string f, NumberField(at, track, "f"));
  DSG_ASSIGN_OR_RETURN(const std::string p, NumberField(at, track, "p"));
  DSG_ASSIGN_OR_RETURN(const std::string x, NumberField(at, track, "x"));
  DSG_ASSIGN_OR_RETURN(const std::string y, NumberField(at, track, "y"));
  DSG_ASSIGN_OR_RETURN(const int64_t frame, ParseFrame(at, f));
  DSG_ASSIGN_OR_RETURN(const std::string person, ParsePersonName(at, p));
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  DSG_ASSIGN_OR_RETURN(position.x(), ParseCoordinate(at, "x", x));
  DSG_ASSIGN_OR_RETURN(position.y(), ParseCoordinate(at, "y", y));
  const int32_t agent = table->FindOrAdd(options.agent_prefix + person, kinds::kHuman);
  table->AddPosition(frame, at.line, agent, position);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TextRows> ReadNdjsonRows(const LogFile& file, const LogOptions& options) {
  TextRows rows{.clock = RowClock::kFrames};
  rows.table.file = file.path;
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  int64_t scene_count = 0;
  while (lines.Next(&line)) {
    const LinePosition at{file.path, line.number};
    const Json json = Json::parse(line.text, nullptr, /*allow_exceptions=*/false);
    if (json.is_discarded()) {
      if (!line.has_line_end) {
        return at.Error(
            "the file ends in the middle of this line; copy the log again, or remove "
            "the cut line");
      }
      return at.FieldError("line", line.text, "one JSON object a line is due; correct the line");
    }
    if (json.is_object() && json.contains("track")) {
      DSG_RETURN_IF_ERROR(AddTrack(options, at, json["track"], &rows.table));
    } else if (json.is_object() && json.contains("scene")) {
      ++scene_count;
    } else {
      return at.FieldError("line", line.text,
                           "an object with \"track\" or \"scene\" is due; correct the line");
    }
  }
  if (scene_count > 0) {
    rows.notes.push_back(absl::StrCat(
        scene_count, " scene windows (\"scene\" lines) are annotations and were not kept"));
  }
  return rows;
}

}  // namespace dsg::ingest
