// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/bag/detection_lines.h"

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::simulator {

absl::StatusOr<std::unique_ptr<DetectionLines>> DetectionLines::Open(const std::string& path) {
  std::unique_ptr<DetectionLines> lines(new DetectionLines(path));
  DSG_RETURN_IF_ERROR(lines->Advance());
  return lines;
}

absl::Status DetectionLines::Malformed(const std::string& message) const {
  const std::string at = absl::StrCat(path_, ":", line_number_);
  return MakeError(Reason::kFileMalformed, absl::StrCat(at, ": ", message), {{"file", path_}});
}

absl::Status DetectionLines::Advance() {
  do {
    if (!std::getline(in_, text_)) {
      if (in_.bad()) return Malformed("cannot be read on; check the disk");
      at_end_ = true;
      return absl::OkStatus();
    }
    ++line_number_;
    if (!text_.empty() && text_.back() == '\r') text_.pop_back();
  } while (text_.empty());

  const auto line = nlohmann::json::parse(text_, nullptr, false);
  const auto stamp = line.is_object() ? line.find("time_ns") : line.end();
  if (stamp == line.end() || !stamp->is_number_integer()) {
    return Malformed("is not a JSON object with an integer time_ns; give one detection a line");
  }
  const TimeNs time_ns = stamp->get<TimeNs>();
  if (time_ns < time_ns_) {
    return Malformed(absl::StrCat("time_ns ", time_ns, " is before ", time_ns_,
                                  " of the line above; sort the file"));
  }
  time_ns_ = time_ns;
  return absl::OkStatus();
}

}  // namespace dsg::simulator
