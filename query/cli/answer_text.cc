// SPDX-License-Identifier: Apache-2.0
#include "query/cli/time_text.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

bool IsOpen(TimeNs time_ns) { return time_ns == kTimeMin || time_ns == kTimeMax; }

}  // namespace

std::string TimeText::Relative(TimeNs time_ns) const {
  return IsOpen(time_ns) ? "open" : FormatRelative(time_ns, epoch_ns_);
}

std::string TimeText::Date(TimeNs time_ns) const {
  return has_dates() && !IsOpen(time_ns) ? FormatRfc3339(time_ns) : "";
}

std::string TimeText::Full(TimeNs time_ns) const {
  const std::string date = Date(time_ns);
  return date.empty() ? Relative(time_ns) : absl::StrCat(Relative(time_ns), " (", date, ")");
}

std::string TimeText::Tenth(TimeNs time_ns) const {
  constexpr TimeNs kTenth = kNsPerSecond / 10;
  if (time_ns <= kTimeMin + kTenth || time_ns >= kTimeMax - kTenth) return Relative(time_ns);
  // Of the time since the epoch, which need not be a whole tenth itself.
  const TimeNs since = time_ns - epoch_ns_;
  TimeNs rest = since % kTenth;
  if (rest < 0) rest += kTenth;
  return Relative(rest < kTenth / 2 ? time_ns - rest : time_ns - rest + kTenth);
}

std::string TimeText::Span(TimeNs from_ns, TimeNs to_ns) const {
  if (IsOpen(from_ns) && IsOpen(to_ns)) return "";
  return absl::StrCat(Full(from_ns), " to ", Full(to_ns));
}

absl::Status TimeText::Explain(const absl::Status& status) const {
  if (ReasonOf(status) != Reason::kTimeOutsideTrack) return status;
  const ErrorMetadata metadata = MetadataOf(status);
  const auto first = metadata.find("first_ns");
  const auto last = metadata.find("last_ns");
  TimeNs first_ns = 0;
  TimeNs last_ns = 0;
  if (first == metadata.end() || last == metadata.end() ||
      !absl::SimpleAtoi(first->second, &first_ns) || !absl::SimpleAtoi(last->second, &last_ns)) {
    return status;
  }
  return MakeError(Reason::kTimeOutsideTrack,
                   absl::StrCat(status.message(), " (the track: ", Span(first_ns, last_ns), ")"),
                   metadata);
}

std::string DurationText(TimeNs from_ns, TimeNs to_ns) {
  // Without the sign that a relative time begins with.
  const std::string text = FormatRelative(to_ns, from_ns);
  return text[0] == '+' ? text.substr(1) : text;
}

}  // namespace dsg::cli
