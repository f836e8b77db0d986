// SPDX-License-Identifier: Apache-2.0
// Reads the whole content of a map from a store or a server, all at one revision.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "query/cli/export/map_content.h"
#include "query/cli/session.h"
#include "schema/base/time.h"
#include "schema/model/revision.h"

namespace dsg::cli {

struct ContentOptions {
  /// The world at this instant, with tracks up to it; unset = all that has not ended, whole tracks.
  std::optional<TimeNs> at_ns{};
  bool with_mesh = true;
  /// Only the mesh of this node, by id or unique name; empty = all of it.
  std::string mesh_node{};
  /// False: only the building, without agents.
  bool with_agents = true;
  /// Also the bodies with faces of people: at the instant, or over time. A note says if none has.
  bool with_bodies = false;
  /// Bodies over time are at least so far apart, and no more than so many in all.
  TimeNs body_step_ns = 0;
  int64_t body_count_max = 0;
  /// Also every pose of the tracks.
  bool with_poses = false;
  /// Unset = the revision that the session asks for.
  std::optional<Revision> revision{};
};

struct ContentAnswer {
  MapContent content;
  /// The time of the last pose of all agents; unset without poses.
  std::optional<TimeNs> last_pose_ns;
};

/// Requires: the session's map is chosen.
/// Errors: of the calls; DATA_LOSS when the answers contradict each other;
/// RESOURCE_EXHAUSTED/LIMIT_EXCEEDED for more bodies than asked for.
absl::StatusOr<ContentAnswer> ReadContent(Session* session, const ContentOptions& options);

/// The same at the instant of --at, which may be empty. Errors: also INVALID_ARGUMENT naming --at.
absl::StatusOr<ContentAnswer> ReadContentAt(Session* session, const std::string& at,
                                            ContentOptions options);

}  // namespace dsg::cli
