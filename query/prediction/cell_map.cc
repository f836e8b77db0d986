// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/cell_map.h"

#include <algorithm>
#include <cmath>

namespace dsg::query {

int32_t CellMap::CellOf(double coordinate_m) const {
  // Nobody maps beyond; the cast would be undefined.
  return static_cast<int32_t>(std::clamp(std::floor(coordinate_m / size_m_), -2e9, 2e9));
}

}  // namespace dsg::query
