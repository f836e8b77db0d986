// SPDX-License-Identifier: Apache-2.0
// A small house in a store, and a prune of it from plan to compaction.
#pragma once

#include <string>
#include <vector>

#include "schema/retention/batches.h"
#include "schema/retention/plan.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {

/// Building B1 holds rooms R1 (x 0 to 10) and R2 (x 10 to 20), y 0 to 10, z 0 to 3. R1 holds places
/// p1 and p2, R2 holds p3. O1 and O4 are in p1, O2 is in p3, O3 in both p2 and p3. O1 and O2 have
/// one model, O4 has another. O5 left the world at 5 s and is in p3. Mesh: squares of 1 m on the
/// floor, blocks of 2 m.
///
/// H1 walks from x = 0.5 to x = 19.5 at y = 5, ten poses a second from 0 to 38 s, with a shape and
/// an odometry factor a second; stays p1, R1 [0, 10), p2, R1 [10, 19), p3, R2 [19, open). H2 stands
/// in p1 from 0 to 4 s; stay p1, R1 [0, open).
void FillHouse(TestMap* map);

inline constexpr NodeId kWalker('H', 1);
inline constexpr NodeId kStander('H', 2);

PrunePolicy PolicyOf(PrunePolicy::What what, std::vector<std::string> layers = {});

PrunePlan PlanOf(TestMap* map, const std::vector<PrunePolicy>& policies);

/// Plans and commits; `batch_count_max` < 0 = all batches. Returns the plan.
PrunePlan Prune(TestMap* map, const std::vector<PrunePolicy>& policies, int batch_count_max = -1);

/// All of the map but the revisions that wrote it: nodes, edges, poses, shapes, factors, stays,
/// mesh.
std::string ContentOf(const Snapshot& map);

/// Ids of all nodes, with blanks between.
std::string NodesOf(const Snapshot& map);

}  // namespace dsg::test
