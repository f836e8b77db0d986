// SPDX-License-Identifier: Apache-2.0
// World time: signed 64-bit nanoseconds on a map's clock, and its text forms.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg {

using TimeNs = int64_t;

/// The open begin and the open end of an interval.
inline constexpr TimeNs kTimeMin = std::numeric_limits<TimeNs>::min();
inline constexpr TimeNs kTimeMax = std::numeric_limits<TimeNs>::max();

inline constexpr TimeNs kNsPerSecond = 1'000'000'000;

/// An interval of world time, half-open: `from_ns` belongs to it, `to_ns` does not.
struct Interval {
  TimeNs from_ns = kTimeMin;
  TimeNs to_ns = kTimeMax;

  bool Contains(TimeNs t_ns) const { return from_ns <= t_ns && t_ns < to_ns; }
  bool Overlaps(const Interval& other) const {
    return from_ns < other.to_ns && other.from_ns < to_ns;
  }
  bool operator==(const Interval&) const = default;
};

/// Parses nanoseconds ("1403715524907143168"), a time relative to the map's epoch ("+12.5s",
/// "-200ms", "+3m", "+1.5h"), or RFC 3339 ("2014-06-25T16:58:44.9Z").
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID, also if the result does not fit in 64 bits.
absl::StatusOr<TimeNs> ParseTime(std::string_view text, TimeNs epoch_ns);

/// RFC 3339 in UTC with as many decimals as needed: "2014-06-25T16:58:44.907143168Z".
std::string FormatRfc3339(TimeNs time_ns);

/// Relative to `epoch_ns`, in the form that ParseTime accepts: "+12.5s".
std::string FormatRelative(TimeNs time_ns, TimeNs epoch_ns);

/// The wall clock, nanoseconds since 1970 UTC. For commit records, never for world time.
int64_t WallClockNs();

}  // namespace dsg
