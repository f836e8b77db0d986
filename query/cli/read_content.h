// SPDX-License-Identifier: Apache-2.0
// Asks a store or a server for all of a map at once.
// Refuses to mix revisions: everything is read at the revision of the first answer.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "query/cli/export/map_content.h"
#include "query/cli/session.h"
#include "schema/base/time.h"
#include "schema/model/revision.h"

namespace dsg::cli {

struct ContentOptions {
  /// The world at this instant, tracks up to it; unset = what has not ended, whole tracks.
  std::optional<TimeNs> at_ns{};
  bool with_mesh = true;
  /// False: without agents, as they are no part of the building.
  bool with_agents = true;
  /// Also every pose of the tracks.
  bool with_poses = false;
  /// As believed then; unset = as the session asks.
  std::optional<Revision> revision{};
};

struct ContentAnswer {
  MapContent content;
  /// The last pose of all agents, where there is any.
  std::optional<TimeNs> last_pose_ns;
};

/// Requires: the session's map is chosen.
/// Errors: of the calls; DATA_LOSS when the answers contradict each other.
absl::StatusOr<ContentAnswer> ReadContent(const Session& session, query::Api* api,
                                          const ContentOptions& options);

}  // namespace dsg::cli
