// SPDX-License-Identifier: Apache-2.0
// A large delta in parts of bounded size, made as they are asked for: of an import of a hundred
// thousand nodes only one part stands in memory beside what is still to come.
#pragma once

#include <cstdint>
#include <functional>

#include "absl/status/status.h"
#include "schema/model/graph_delta.h"

namespace dsg {

/// Takes a part; `done` is the share of the rows that are in this part and those before, 0 to 1.
using TakePart = std::function<absl::Status(GraphDelta part, double done)>;

/// The parts of SplitDelta, in their order; ends with the first error of `take`, which it returns.
absl::Status ForEachPart(GraphDelta delta, size_t item_count_max, const TakePart& take);

}  // namespace dsg
