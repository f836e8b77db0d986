// SPDX-License-Identifier: Apache-2.0
#include "schema/store/time_range.h"

#include <cstdint>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {

__extension__ using Int128 = __int128;

absl::Status CheckTimeInMap(TimeNs time_ns, const MapSpec& spec) {
  constexpr Int128 kTenthNs = kNsPerSecond / 10;
  const Int128 from_epoch_ns = static_cast<Int128>(time_ns) - spec.epoch_ns;
  if (from_epoch_ns >= INT32_MIN * kTenthNs && from_epoch_ns <= INT32_MAX * kTenthNs) {
    return absl::OkStatus();
  }
  return MakeError(Reason::kTimeOutsideMap,
                   absl::StrCat("time ", time_ns, " ns is more than 6.8 years from the epoch ",
                                spec.epoch_ns, " ns of map \"", spec.name,
                                "\"; check the clock, or use a map with another epoch"),
                   {{"map", spec.name}, {"time_ns", absl::StrCat(time_ns)}});
}

}  // namespace dsg
