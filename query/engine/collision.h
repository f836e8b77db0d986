// SPDX-License-Identifier: Apache-2.0
// What a body touches at a pose or on its way, and how far away everything else is.
// Refuses to call free what nobody has looked at: such answers are marked.
#pragma once

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/read_view.h"

namespace dsg::v1 {
class CheckCollisionRequest;
class CheckCollisionResponse;
class CollisionResult;
}  // namespace dsg::v1

namespace dsg::query {

class CollisionCache;
struct CollisionHit;

/// Errors: FIELD_INVALID and NUMBER_NOT_FINITE naming the field, NODE_UNKNOWN for what is ignored;
/// as ReadView::Graph; the store's.
absl::Status CheckCollision(const ReadView& view, CollisionCache* collisions,
                            const CallContext& call, const v1::CheckCollisionRequest& request,
                            v1::CheckCollisionResponse* reply);

void FillCollision(const CollisionHit& hit, v1::CollisionResult* out);

}  // namespace dsg::query
