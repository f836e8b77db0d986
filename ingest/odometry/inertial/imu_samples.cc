// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/imu_samples.h"

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Unsigned, since stamps may lie further apart than int64 reaches.
uint64_t NsBetween(TimeNs from_ns, TimeNs to_ns) {
  return static_cast<uint64_t>(to_ns) - static_cast<uint64_t>(from_ns);
}

absl::Status BadSample(const std::string& unit, const std::string& what, TimeNs time_ns) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat(unit, ": ", what),
                   {{"field", unit}, {"value", absl::StrCat(time_ns)}});
}

absl::Status CheckAscends(std::span<const ImuMeasurement> samples, const std::string& unit) {
  for (size_t i = 1; i < samples.size(); ++i) {
    const TimeNs last_ns = samples[i - 1].time_ns;
    const TimeNs time_ns = samples[i].time_ns;
    if (last_ns < time_ns) continue;
    return BadSample(unit,
                     absl::StrCat("the sample at ", time_ns, " ns follows the one at ", last_ns,
                                  " ns; times must ascend: sort them and leave out repeats"),
                     time_ns);
  }
  return absl::OkStatus();
}

absl::Status CheckFinite(const ImuMeasurement& sample, const std::string& unit) {
  const Eigen::Vector3d& w = sample.angular_velocity_rad_s;
  const Eigen::Vector3d& a = sample.acceleration_m_s2;
  if (w.allFinite() && a.allFinite()) return absl::OkStatus();
  return BadSample(unit,
                   absl::StrCat("the sample at ", sample.time_ns, " ns is (", w.x(), ", ", w.y(),
                                ", ", w.z(), ") rad/s, (", a.x(), ", ", a.y(), ", ", a.z(),
                                ") m/s^2; leave out what is not finite"),
                   sample.time_ns);
}

absl::Status DoNotCover(std::span<const ImuMeasurement> samples, TimeNs from_ns, TimeNs to_ns,
                        const std::string& unit) {
  const TimeNs first_ns = samples.empty() ? 0 : samples.front().time_ns;
  const TimeNs last_ns = samples.empty() ? 0 : samples.back().time_ns;
  return MakeError(
      Reason::kTimeOutsideTrack,
      absl::StrCat(unit, ": ", samples.size(), " samples from ", first_ns, " to ", last_ns,
                   " ns do not cover ", from_ns, " to ", to_ns, " ns; wait for the rest"),
      {{"first_ns", absl::StrCat(first_ns)}, {"last_ns", absl::StrCat(last_ns)}});
}

}  // namespace

double SecondsBetween(TimeNs from_ns, TimeNs to_ns) {
  return 1e-9 * static_cast<double>(NsBetween(from_ns, to_ns));
}

ImuMeasurement SampleAt(const ImuMeasurement& before, const ImuMeasurement& after, TimeNs time_ns) {
  const double span_s = SecondsBetween(before.time_ns, after.time_ns);
  const double share = span_s > 0.0 ? SecondsBetween(before.time_ns, time_ns) / span_s : 0.0;
  return {time_ns,
          (1.0 - share) * before.angular_velocity_rad_s + share * after.angular_velocity_rad_s,
          (1.0 - share) * before.acceleration_m_s2 + share * after.acceleration_m_s2};
}

absl::Status CheckSamples(std::span<const ImuMeasurement> samples, const std::string& unit,
                          TimeNs gap_ns_max) {
  DSG_RETURN_IF_ERROR(CheckAscends(samples, unit));
  for (size_t i = 0; i < samples.size(); ++i) {
    DSG_RETURN_IF_ERROR(CheckFinite(samples[i], unit));
    if (i == 0) continue;
    const TimeNs last_ns = samples[i - 1].time_ns;
    if (NsBetween(last_ns, samples[i].time_ns) <= static_cast<uint64_t>(gap_ns_max)) continue;
    return BadSample(unit,
                     absl::StrCat("no sample between ", last_ns, " and ", samples[i].time_ns,
                                  " ns; gaps of up to ", gap_ns_max, " ns can be bridged"),
                     samples[i].time_ns);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<ImuMeasurement>> CutSamples(std::span<const ImuMeasurement> samples,
                                                       TimeNs from_ns, TimeNs to_ns,
                                                       const std::string& unit, TimeNs gap_ns_max) {
  if (from_ns >= to_ns) {
    return MakeError(Reason::kTimeRangeInverted,
                     absl::StrCat(unit, ": ", from_ns, " to ", to_ns,
                                  " ns is no interval; the second time must be the later one"));
  }
  DSG_RETURN_IF_ERROR(CheckAscends(samples, unit));
  if (samples.empty() || samples.front().time_ns > from_ns || samples.back().time_ns < to_ns) {
    return DoNotCover(samples, from_ns, to_ns, unit);
  }
  // The last sample at or before from_ns, and the first one at or after to_ns.
  const auto begin = std::upper_bound(samples.begin(), samples.end(), from_ns,
                                      [](TimeNs time_ns, const ImuMeasurement& sample) {
                                        return time_ns < sample.time_ns;
                                      }) -
                     1;
  const auto last = std::lower_bound(
      samples.begin(), samples.end(), to_ns,
      [](const ImuMeasurement& sample, TimeNs time_ns) { return sample.time_ns < time_ns; });
  DSG_RETURN_IF_ERROR(CheckSamples(std::span(begin, last + 1), unit, gap_ns_max));
  std::vector<ImuMeasurement> cut = {SampleAt(*begin, *(begin + 1), from_ns)};
  cut.insert(cut.end(), begin + 1, last);
  cut.push_back(SampleAt(*(last - 1), *last, to_ns));
  return cut;
}

}  // namespace dsg::ingest
