// SPDX-License-Identifier: Apache-2.0
// Tracks as files of the form of TUM's benchmarks, which trajectory tools read: a line per pose,
// "timestamp tx ty tz qx qy qz qw", metres in the frame of the map and seconds on its clock.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/cli/json.h"
#include "query/cli/map_rows.h"

namespace dsg::cli {

/// Names of files for agents, in their order: the agent's name if it is plain and no other agent's,
/// else its id.
std::vector<std::string> FileStems(const std::vector<AgentRow>& agents);

/// Writes NAME.tum for each agent with poses to `folder`, which is made if it is not there. A pose
/// without orientation has the identity; a note says of how many.
/// Errors: of AtomicFile, before anything is written if a file exists and `force` is unset; of the
/// calls.
absl::StatusOr<std::vector<Written>> WriteTumFiles(const MapRows& map, const std::string& folder,
                                                   bool force);

}  // namespace dsg::cli
