// SPDX-License-Identifier: Apache-2.0
#include "schema/store/time_range.h"

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {

__extension__ using Int128 = __int128;

absl::Status CheckTimeInMap(TimeNs time_ns, const MapSpec& spec) {
  constexpr Int128 kMaxNs = kFromEpochYearsMax * 365 * 24 * 3600 * Int128{kNsPerSecond};
  const Int128 from_epoch_ns = static_cast<Int128>(time_ns) - spec.epoch_ns;
  if (from_epoch_ns >= -kMaxNs && from_epoch_ns <= kMaxNs) return absl::OkStatus();
  return MakeError(Reason::kTimeOutsideMap,
                   absl::StrCat("time ", time_ns, " ns is more than ", kFromEpochYearsMax,
                                " years from the epoch ", spec.epoch_ns, " ns of map \"", spec.name,
                                "\"; check the clock, or use a map with another epoch"),
                   {{"map", spec.name}, {"time_ns", absl::StrCat(time_ns)}});
}

absl::Status CheckPosesInMap(const GraphDelta& delta, const MapSpec& spec) {
  const auto check = [&](const auto& items) -> absl::Status {
    for (const auto& item : items) {
      if (item.poses.empty()) continue;
      DSG_RETURN_IF_ERROR(CheckTimeInMap(item.poses.front().time_ns, spec));
      DSG_RETURN_IF_ERROR(CheckTimeInMap(item.poses.back().time_ns, spec));
    }
    return absl::OkStatus();
  };
  DSG_RETURN_IF_ERROR(check(delta.corrections));
  return check(delta.appends);
}

}  // namespace dsg
