// SPDX-License-Identifier: Apache-2.0
// Values of options: points, boxes, poses, durations, instants, folders. Errors name the option.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "schema/base/status.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/layer.h"

namespace dsg::cli {

/// "X,Y,Z" in metres. Errors: INVALID_ARGUMENT/FIELD_INVALID or NUMBER_NOT_FINITE.
absl::StatusOr<Eigen::Vector3d> ParsePoint(const std::string& option, const std::string& text);

/// "X0,Y0,Z0,X1,Y1,Z1" in metres: two opposite corners, lower one first.
/// Errors: as ParsePoint; INVALID_ARGUMENT/BOX_INVERTED.
absl::StatusOr<Box3d> ParseBox(const std::string& option, const std::string& text);

/// "RADIUS,LENGTH" and the like. Errors: as ParsePoint.
absl::StatusOr<std::array<double, 2>> ParsePair(const std::string& option, const std::string& text,
                                                const std::string& form);

/// "X,Y,Z" or "X,Y,Z,QX,QY,QZ,QW"; the quaternion is normalised.
/// Errors: as ParsePoint; FIELD_INVALID for a quaternion of length zero.
absl::StatusOr<Pose3d> ParsePose(const std::string& option, const std::string& text);

/// "0.5s", "200ms", "1m10s"; seconds without a unit. Errors: INVALID_ARGUMENT/FIELD_INVALID unless
/// positive.
absl::StatusOr<TimeNs> ParseDuration(const std::string& option, const std::string& text);

/// An instant of the map's time: "+12.5s" from its epoch, nanoseconds on its clock, or a date if
/// the clock is UTC. "30ns" marks a small number as nanoseconds. Errors:
/// INVALID_ARGUMENT/FIELD_INVALID naming the option; also for a number without a unit that may mean
/// seconds, for a time without a sign, and for a date on another clock.
absl::StatusOr<TimeNs> ParseInstant(const std::string& option, const std::string& text,
                                    const MapSpec& map);

/// Sets a field of a request to the instant, if `text` is not empty. Errors: as ParseInstant.
template <class Request>
absl::Status SetInstant(const std::string& option, const std::string& text, const MapSpec& map,
                        Request* request, void (Request::*set)(int64_t)) {
  if (text.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const TimeNs time_ns, ParseInstant(option, text, map));
  (request->*set)(time_ns);
  return absl::OkStatus();
}

/// The same for a duration. Errors: as ParseDuration.
template <class Request>
absl::Status SetDuration(const std::string& option, const std::string& text, Request* request,
                         void (Request::*set)(int64_t)) {
  if (text.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const TimeNs duration_ns, ParseDuration(option, text));
  (request->*set)(duration_ns);
  return absl::OkStatus();
}

/// Makes the folder that an option names, if it is not there.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID with what the system says.
absl::Status MakeFolder(const std::string& option, const std::string& folder);

}  // namespace dsg::cli
