// SPDX-License-Identifier: Apache-2.0
// A simulated log's truth as a predictor sees the world: where one can walk, where people go, and
// how they went.
// Refuses to be a map: everything is taken from the truth, so errors are the predictor's own.
#pragma once

#include <vector>

#include "ingest/grid/distance_field.h"
#include "ingest/truth/truth.h"
#include "query/prediction/goal_prediction.h"

namespace dsg::query {

/// One layer of cells at the height of torsos.
ingest::DistanceField FreeField(const truth::Truth& truth);

/// In every square of 0.6 m the cell furthest from obstacles, linked to the eight squares around
/// where a straight line keeps 0.2 m.
WalkGraph GraphOf(const ingest::DistanceField& field);

/// Doors, middles of rooms, what people sit at or use, and places anywhere else.
std::vector<Goal> GoalsOf(const truth::Truth& truth, const WalkGraph& graph);

/// By person, ascending in time.
std::vector<std::vector<PathPoint>> PathsOf(const truth::Truth& truth);

}  // namespace dsg::query
