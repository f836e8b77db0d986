// SPDX-License-Identifier: Apache-2.0
// Where agents stand, or are foreseen to stand, as things to run into.
// Refuses to foresee further than ten seconds: someone could be anywhere by then.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/collision/obstacles.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// Someone without a box is a capsule around the pose, which is that of the torso.
inline constexpr double kAgentRadiusM = 0.3;
inline constexpr double kAgentHeightM = 1.7;
/// Standard deviations that are added to the radius of those who are foreseen.
inline constexpr double kForeseenSigmas = 2.0;
inline constexpr TimeNs kForeseenNsMax = 10 * kNsPerSecond;

/// Agents where they were at `at_ns`; those whose tracks have a gap or an end there are left out.
/// Unset: at their last poses, if these are no further than their gap limit before the newest pose
/// of all. Ascending id.
absl::StatusOr<std::vector<Obstacle>> AgentsAt(const Snapshot& snapshot,
                                               std::optional<TimeNs> at_ns, const StopCheck& stop);

/// Agents whose tracks end before `at_ns`, where they are if they walk on as they did: by weighted
/// velocity, one place each, through walls if need be. Goals on the places graph would cost some
/// milliseconds an agent and give several places.
absl::StatusOr<std::vector<Obstacle>> AgentsForeseenAt(const Snapshot& snapshot, TimeNs at_ns,
                                                       const StopCheck& stop);

}  // namespace dsg::query
