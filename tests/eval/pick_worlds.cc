// SPDX-License-Identifier: Apache-2.0
#include "tests/eval/pick_worlds.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "schema/base/status.h"

namespace dsg::eval {

absl::StatusOr<std::vector<PickWorldOptions>> ParsePickWorlds(
    const std::vector<std::string>& arguments, Tier tier) {
  std::vector<PickWorldOptions> worlds;
  for (const std::string& argument : arguments) {
    const std::vector<std::string> parts = absl::StrSplit(argument, ':');
    PickWorldOptions options;
    options.tier = tier;
    uint64_t last_seed = 0;
    if (parts.size() != 4 || !absl::SimpleAtoi(parts[1], &options.people_count) ||
        !absl::SimpleAtoi(parts[2], &options.world.seed) ||
        !absl::SimpleAtoi(parts[3], &last_seed)) {
      return absl::InvalidArgumentError(
          absl::StrCat(argument, ": give KIND:PEOPLE:FIRST:LAST, as in wing:8:1:5"));
    }
    DSG_ASSIGN_OR_RETURN(options.world.kind, simulator::ParseWorldKind(parts[0]));
    for (; options.world.seed <= last_seed; ++options.world.seed) worlds.push_back(options);
  }
  return worlds;
}

}  // namespace dsg::eval
