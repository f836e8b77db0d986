// SPDX-License-Identifier: Apache-2.0
// Lists of pick worlds as people type them. Refuses anything else.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "tests/eval/pick_world.h"

namespace dsg::eval {

/// "wing:8:1:5": wings with eight people, seeds 1 to 5. Order: as given.
absl::StatusOr<std::vector<PickWorldOptions>> ParsePickWorlds(
    const std::vector<std::string>& arguments, Tier tier);

}  // namespace dsg::eval
