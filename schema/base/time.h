// SPDX-License-Identifier: Apache-2.0
// World time: signed 64-bit nanoseconds on a map's clock, and how people write it.
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

/// A span of world time, half-open: `from_ns` belongs to it, `to_ns` does not.
struct Interval {
  TimeNs from_ns = kTimeMin;
  TimeNs to_ns = kTimeMax;

  bool Contains(TimeNs t_ns) const { return from_ns <= t_ns && t_ns < to_ns; }
  bool Overlaps(const Interval& other) const {
    return from_ns < other.to_ns && other.from_ns < to_ns;
  }
  bool operator==(const Interval&) const = default;
};

/// Reads a time as people write it: nanoseconds ("1403715524907143168"), relative to the map's
/// epoch ("+12.5s", "-200ms", "+3m", "+1.5h"), or RFC 3339 ("2014-06-25T16:58:44.9Z").
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID, also when the result does not fit in 64 bits.
absl::StatusOr<TimeNs> ParseTime(std::string_view text, TimeNs epoch_ns);

/// RFC 3339 in UTC with as many decimals as are needed: "2014-06-25T16:58:44.907143168Z".
std::string FormatRfc3339(TimeNs time_ns);

/// Relative to `epoch_ns`, as ParseTime reads it back: "+12.5s".
std::string FormatRelative(TimeNs time_ns, TimeNs epoch_ns);

/// The wall clock, nanoseconds since 1970 UTC. For records of commits, never for world time.
int64_t WallClockNs();

}  // namespace dsg
