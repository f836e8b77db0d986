// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/geo_origin.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "schema/base/status.h"

namespace dsg::cli {

absl::StatusOr<GeoOrigin> ParseOrigin(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ',');
  std::vector<double> numbers;
  for (const std::string& part : parts) {
    double number = 0.0;
    if (absl::SimpleAtod(part, &number) && std::isfinite(number)) numbers.push_back(number);
  }
  if (parts.size() == 3 && numbers.size() == 3 && std::abs(numbers[0]) <= 90.0 &&
      std::abs(numbers[1]) <= 180.0 && std::abs(numbers[2]) <= 360.0) {
    return GeoOrigin{numbers[0], numbers[1], numbers[2]};
  }
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--origin \"", text,
                                "\": write LAT,LON,HEADING in degrees: latitude from -90 to 90 and "
                                "longitude from -180 to 180 of the map's origin, WGS84, and the "
                                "compass direction of its x axis from -360 to 360 (0 north, 90 "
                                "east)"),
                   {{"field", "--origin"}, {"value", text}});
}

Eigen::Vector3d ToWgs84(const GeoOrigin& origin, const Eigen::Vector3d& point_map) {
  const double heading = origin.heading_deg * std::numbers::pi / 180.0;
  // The y axis is a quarter turn to the left of the x axis.
  const double east = point_map.x() * std::sin(heading) - point_map.y() * std::cos(heading);
  const double north = point_map.x() * std::cos(heading) + point_map.y() * std::sin(heading);
  const GeographicLib::LocalCartesian plane(origin.latitude_deg, origin.longitude_deg);
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double height_m = 0.0;
  plane.Reverse(east, north, point_map.z(), latitude_deg, longitude_deg, height_m);
  return {longitude_deg, latitude_deg, height_m};
}

}  // namespace dsg::cli
