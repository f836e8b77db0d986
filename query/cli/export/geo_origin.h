// SPDX-License-Identifier: Apache-2.0
// Where a map lies on the Earth, and its points as WGS84 degrees.
#pragma once

#include <Eigen/Core>
#include <string>

#include "absl/status/statusor.h"

namespace dsg::cli {

/// The position of the map's origin, at height 0, and the direction of its x axis.
struct GeoOrigin {
  /// WGS84, degrees; north and east are positive.
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  /// Compass direction of the map's x axis: 0 is north, 90 is east.
  double heading_deg = 0.0;
};

/// "LAT,LON,HEADING". Errors: INVALID_ARGUMENT/FIELD_INVALID naming --origin and the range.
absl::StatusOr<GeoOrigin> ParseOrigin(const std::string& text);

/// Longitude and latitude, degrees, and height above the ellipsoid, metres: of a point in the plane
/// that touches the ellipsoid at the origin. Exact within nanometres at any distance.
Eigen::Vector3d ToWgs84(const GeoOrigin& origin, const Eigen::Vector3d& point_map);

}  // namespace dsg::cli
