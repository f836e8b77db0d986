// SPDX-License-Identifier: Apache-2.0
// Ways between floors: stairs, ramps and lifts, where the robot itself went from one floor to
// another. Refuses to guess: a stairwell that was only seen is no way.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/places/place_graph.h"
#include "ingest/places/place_options.h"

namespace dsg::ingest {

/// Adds places along each part of the path that leads from one floor to another, and links that
/// join them to one another and to the places of both floors. They are as wide as the robot, which
/// fitted through. The lower half of a way belongs to the lower floor, the upper half to the upper
/// one. A way that was gone several times is added once.
///
/// How high the body is above its floor is the median over the path. A path that jumps (a log with
/// a gap) leads nowhere, but straight up: that is a lift.
/// Requires: `path_map` in the order of time; `floors_m` ascending, as of ExtractPlaces, with the
/// places of all of them in the graph.
void LinkStoreys(const std::vector<Eigen::Vector3d>& path_map, const std::vector<double>& floors_m,
                 const PlaceOptions& options, PlaceGraph* graph);

}  // namespace dsg::ingest
