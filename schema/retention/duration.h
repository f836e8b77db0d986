// SPDX-License-Identifier: Apache-2.0
// Ages and periods as people write them in policies: "90s", "15m", "24h", "30d".
// Refuses numbers without a unit: a day taken for a second would forget a map.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/base/time.h"

namespace dsg {

inline constexpr TimeNs kNsPerDay = 24 * 3600 * kNsPerSecond;

/// A positive number and one of ms, s, m, h, d.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID, also beyond 100 years.
absl::StatusOr<TimeNs> ParseAge(std::string_view text);

/// As ParseAge reads it back, in the largest unit that is exact.
std::string FormatAge(TimeNs age_ns);

}  // namespace dsg
