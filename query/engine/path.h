// SPDX-License-Identifier: Apache-2.0
// The way from here to there over the places.
// Refuses ways that are narrower than the robot, and ways nobody has seen to be free.
#pragma once

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/read_view.h"

namespace dsg::v1 {
class PlanPathRequest;
class PlanPathResponse;
class PlanPathsRequest;
class PlanPathsResponse;
}  // namespace dsg::v1

namespace dsg::query {

class CollisionCache;

absl::Status PlanPath(const ReadView& view, CollisionCache* collisions, const CallContext& call,
                      const v1::PlanPathRequest& request, v1::PlanPathResponse* reply);
absl::Status PlanPaths(const ReadView& view, CollisionCache* collisions, const CallContext& call,
                       const v1::PlanPathsRequest& request, v1::PlanPathsResponse* reply);

}  // namespace dsg::query
