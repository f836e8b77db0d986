// SPDX-License-Identifier: Apache-2.0
// What a body touches at a pose or on its way, and how far away everything else is.
// Refuses to call free what nobody has looked at: such answers are marked.
#pragma once

namespace dsg::v1 {
class CollisionResult;
}  // namespace dsg::v1

namespace dsg::query {

struct CollisionHit;

void FillCollision(const CollisionHit& hit, v1::CollisionResult* out);

}  // namespace dsg::query
