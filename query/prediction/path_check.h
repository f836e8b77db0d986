// SPDX-License-Identifier: Apache-2.0
// What every prediction demands of its path and its times.
// Refuses by DSG_CHECK: callers own these numbers and have looked at them.
#pragma once

#include <vector>

#include "query/prediction/prediction.h"
#include "schema/base/time.h"

namespace dsg::query {

/// Finite positions, times that never go back.
void CheckPath(const std::vector<PathPoint>& path);

/// At least one point, and `at_ns` ascending from there.
void CheckPathAndTimes(const std::vector<PathPoint>& path, const std::vector<TimeNs>& at_ns);

/// From the last point of the path.
double SecondsAhead(const std::vector<PathPoint>& path, TimeNs at_ns);

}  // namespace dsg::query
