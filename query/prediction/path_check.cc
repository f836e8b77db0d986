// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/path_check.h"

#include "schema/base/check.h"

namespace dsg::query {

void CheckPath(const std::vector<PathPoint>& path) {
  for (size_t i = 0; i < path.size(); ++i) {
    DSG_CHECK(path[i].position_map.allFinite());
    DSG_CHECK(i == 0 || path[i - 1].time_ns <= path[i].time_ns);
  }
}

void CheckPathAndTimes(const std::vector<PathPoint>& path, const std::vector<TimeNs>& at_ns) {
  CheckPath(path);
  DSG_CHECK(!path.empty());
  TimeNs before_ns = path.back().time_ns;
  for (const TimeNs time_ns : at_ns) {
    DSG_CHECK(before_ns <= time_ns);
    before_ns = time_ns;
  }
}

double SecondsAhead(const std::vector<PathPoint>& path, TimeNs at_ns) {
  return static_cast<double>(at_ns - path.back().time_ns) * 1e-9;
}

}  // namespace dsg::query
