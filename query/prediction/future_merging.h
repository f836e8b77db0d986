// SPDX-License-Identifier: Apache-2.0
// Many futures as few: those that are much the same become one.
// Refuses to average: what is given is one of them, as it was.
#pragma once

#include <vector>

#include "query/prediction/prediction.h"

namespace dsg::query {

/// Futures within `merge_m` of the best one go into it, then the same with the rest. The best one
/// has most probability around it, so that of many goals that lead much the same way the middle one
/// stays. In the order in which they were found.
/// Requires: all at the same times. Cost: square of the number of futures.
std::vector<PredictedPath> Merged(const std::vector<PredictedPath>& paths, double merge_m);

}  // namespace dsg::query
