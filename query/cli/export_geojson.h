// SPDX-License-Identifier: Apache-2.0
// A map as GeoJSON (RFC 7946), for programs that show places on the Earth: rooms, objects and
// places as features, tracks as lines.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "query/cli/export/geo_origin.h"
#include "query/cli/json.h"
#include "query/cli/map_rows.h"

namespace dsg::cli {

/// Writes what is there at the instant of `map`, or without one all that has not ended. Positions
/// are longitude, latitude and height; those of tracks have the seconds on the map's clock as their
/// fourth number, in which viewers play them. A track has one line per stretch without a gap.
/// Errors: of AtomicFile; of the calls.
absl::StatusOr<Written> WriteGeoJson(const MapRows& map, const GeoOrigin& origin,
                                     const std::string& path, bool force);

}  // namespace dsg::cli
