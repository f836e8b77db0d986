// SPDX-License-Identifier: Apache-2.0
// Answers CheckCollision: what a body touches at a pose or on its way, and its clearance to
// everything else.
#pragma once

namespace dsg::v1 {
class CollisionResult;
}  // namespace dsg::v1

namespace dsg::query {

struct CollisionHit;

void FillCollision(const CollisionHit& hit, v1::CollisionResult* out);

}  // namespace dsg::query
