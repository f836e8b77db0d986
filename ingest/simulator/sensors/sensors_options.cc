// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/sensors_options.h"

#include <charconv>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/random.h"
#include "schema/base/status.h"

namespace dsg::simulator {

absl::StatusOr<FrameRange> ParseFrameRange(std::string_view text) {
  FrameRange range;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, range.begin);
  if (first.ec == std::errc() && first.ptr != end && *first.ptr == ':') {
    const auto second = std::from_chars(first.ptr + 1, end, range.end);
    if (second.ec == std::errc() && second.ptr == end && range.begin >= 0 &&
        range.begin < range.end) {
      return range;
    }
  }
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--frames is \"", std::string(text),
                                "\"; write BEGIN:END with 0 <= BEGIN < END, as in 0:250"),
                   {{"field", "--frames"}, {"value", std::string(text)}});
}

int64_t SensorsOptions::FrameCount() const {
  // A hair more, so that 25 s at 20 Hz are 500 frames whatever the rounding.
  return static_cast<int64_t>(std::floor(duration_s * rate_hz + 1e-6));
}

TimeNs SensorsOptions::BeginNs() const {
  constexpr TimeNs kFirstNs = 1'700'000'000 * kNsPerSecond;
  // Longer than the longest log, so that two logs share no instant.
  constexpr TimeNs kStepNs = 4000 * kNsPerSecond;
  constexpr int kStepCount = 100'000;
  uint64_t digest = 0;
  for (const char letter : CommandLine())
    digest = digest * 1'000'003 + static_cast<uint8_t>(letter);
  return kFirstNs + Random(digest, 0).Index(kStepCount) * kStepNs;
}

absl::Status SensorsOptions::Validate() const {
  DSG_RETURN_IF_ERROR(CheckRange("--humans", people_count, 0, 250, ""));
  DSG_RETURN_IF_ERROR(CheckRange("--seconds", duration_s, 1, 3600, " s"));
  DSG_RETURN_IF_ERROR(CheckRange("--rate", rate_hz, 1, 60, " Hz"));
  DSG_RETURN_IF_ERROR(CheckRange("--keyframe-every", keyframe_every, 1, 60, " frames"));
  DSG_RETURN_IF_ERROR(CheckRange("--imu-noise", imu_noise_factor, 0, 100, ""));
  return CheckRange("--calibration-error", calibration_error_factor, 0, 100, "");
}

std::string SensorsOptions::CommandLine() const {
  return absl::StrFormat(
      "dsg-simulate sensors --world %s --seed %d --humans %d --seconds %g --rate %g "
      "--keyframe-every %d --imu-noise %g --calibration-error %g%s",
      Name(world.kind), world.seed, people_count, duration_s, rate_hz, keyframe_every,
      imu_noise_factor, calibration_error_factor, has_bodies ? " --bodies" : "");
}

}  // namespace dsg::simulator
