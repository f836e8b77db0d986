// SPDX-License-Identifier: Apache-2.0
// Inertial samples between two instants, checked.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/sensor/imu_measurement.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Requires: from_ns <= to_ns. Any two stamps of 64 bits.
double SecondsBetween(TimeNs from_ns, TimeNs to_ns);

/// A sample between two others, by straight lines. Requires: its time is not outside of theirs.
ImuMeasurement SampleAt(const ImuMeasurement& before, const ImuMeasurement& after, TimeNs time_ns);

/// Errors: FIELD_INVALID, naming the unit, the times and the value, for times that do not ascend,
/// numbers that are not finite, and two samples more than `gap_ns_max` apart.
absl::Status CheckSamples(std::span<const ImuMeasurement> samples, const std::string& unit,
                          TimeNs gap_ns_max);

/// The samples between two instants, the first and the last one interpolated. Samples outside,
/// beyond the next one on each side, may have any flaw but their order.
///
/// Errors: TIME_RANGE_INVERTED; OUT_OF_RANGE/TIME_OUTSIDE_TRACK when samples do not cover the
/// interval (yet); of CheckSamples.
absl::StatusOr<std::vector<ImuMeasurement>> CutSamples(std::span<const ImuMeasurement> samples,
                                                       TimeNs from_ns, TimeNs to_ns,
                                                       const std::string& unit, TimeNs gap_ns_max);

}  // namespace dsg::ingest
