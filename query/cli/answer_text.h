// SPDX-License-Identifier: Apache-2.0
// How instants of one map are shown to people: relative to its epoch and, on a UNIX clock, as
// dates. Refuses to show a date on a clock that is not UTC.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "schema/base/time.h"
#include "schema/model/layer.h"

namespace dsg::cli {

class TimeText {
 public:
  explicit TimeText(const MapSpec& map) : epoch_ns_(map.epoch_ns), clock_(map.clock) {}

  bool has_dates() const { return clock_ == Clock::kUnix; }

  /// "+12.5s"; "open" for the ends of an open interval.
  std::string Relative(TimeNs time_ns) const;
  /// RFC 3339; empty where there are no dates, and for open ends.
  std::string Date(TimeNs time_ns) const;
  /// "+12.5s (2014-06-25T16:58:44.9Z)", or as Relative where there are no dates.
  std::string Full(TimeNs time_ns) const;
  /// As Relative, to the nearest tenth of a second: "+12.5s".
  std::string Tenth(TimeNs time_ns) const;
  /// "+1s to +2.5s"; empty if both ends are open.
  std::string Span(TimeNs from_ns, TimeNs to_ns) const;

  /// The same error; TIME_OUTSIDE_TRACK also says, in times as people write them, where the track
  /// begins and ends.
  absl::Status Explain(const absl::Status& status) const;

 private:
  TimeNs epoch_ns_;
  Clock clock_;
};

/// "2.5s" for the length of an interval.
std::string DurationText(TimeNs from_ns, TimeNs to_ns);

}  // namespace dsg::cli
