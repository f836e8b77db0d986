// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/options.h"

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::simulator {

absl::Status CheckRange(const char* option, double value, double low, double high,
                        const char* unit) {
  // Written so that NaN fails.
  if (value >= low && value <= high) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat(option, " is ", value, "; it must be from ", low, " to ", high, unit),
      {{"field", option}});
}

absl::StatusOr<WorldKind> ParseWorldKind(std::string_view text) {
  for (const WorldKind kind : {WorldKind::kOffice, WorldKind::kWing, WorldKind::kApartment}) {
    if (text == Name(kind)) return kind;
  }
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("--world is \"", std::string(text), "\"; it must be office, wing or apartment"),
      {{"field", "--world"}});
}

std::string_view Name(WorldKind kind) {
  switch (kind) {
    case WorldKind::kOffice:
      return "office";
    case WorldKind::kWing:
      return "wing";
    case WorldKind::kApartment:
      return "apartment";
  }
  return "";
}

absl::Status CrowdOptions::Validate() const {
  DSG_RETURN_IF_ERROR(CheckRange("--people", people_count, 0, 10'000, ""));
  return CheckRange("--seconds", duration_s, 1, 86'400, " s");
}

absl::Status TrackSensorOptions::Validate() const {
  DSG_RETURN_IF_ERROR(CheckRange("--rate", rate_hz, 0.1, 200, " Hz"));
  DSG_RETURN_IF_ERROR(CheckRange("--noise-m", position_noise_m, 0, 10, " m"));
  DSG_RETURN_IF_ERROR(CheckRange("--noise-yaw", yaw_noise_rad, 0, 3, " rad"));
  DSG_RETURN_IF_ERROR(CheckRange("--jitter-s", clock_jitter_s, 0, 1, " s"));
  DSG_RETURN_IF_ERROR(CheckRange("--gap-rate", gap_rate_per_min, 0, 60, " per minute"));
  DSG_RETURN_IF_ERROR(CheckRange("gap_s_min", gap_s_min, 0.001, 3600, " s"));
  return CheckRange("gap_s_max", gap_s_max, gap_s_min, 3600, " s");
}

absl::Status TracksOptions::Validate() const {
  if (out.empty()) {
    return MakeError(Reason::kFieldInvalid, "--out is empty; name the folder to write",
                     {{"field", "--out"}});
  }
  DSG_RETURN_IF_ERROR(crowd.Validate());
  DSG_RETURN_IF_ERROR(CheckRange("--picks", pick_count, 0.0, 1000.0, ""));
  return sensor.Validate();
}

}  // namespace dsg::simulator
