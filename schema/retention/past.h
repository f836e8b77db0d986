// SPDX-License-Identifier: Apache-2.0
// What a policy that erases means in the past: entities that are gone already, as they were last
// believed, and older beliefs about tracks and meshes. That is also how a prune that was cut off
// between retiring and erasing finds what is left to do.
// Refuses to touch the past of what is believed to be elsewhere now.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/measure.h"
#include "schema/retention/policy.h"
#include "schema/store/graph_store.h"

namespace dsg {

/// Adds what the policy matches at the revision of the plan.
void AddPresent(const GraphIndex& index, const Measured& measured, Erasure* erasure);

/// Adds what it matched before.
/// Cost: looks at what each readable revision ended.
absl::Status AddPast(MapReader* reader, const Snapshot& map, const GraphIndex& index,
                     const PrunePolicy& policy, const StopCheck& stop, Erasure* erasure);

/// Oldest first, up to `newest`.
absl::StatusOr<std::vector<Revision>> ReadableRevisions(MapReader* reader, Revision newest,
                                                        const StopCheck& stop);

/// Whether the node that a branch policy names was there at any readable revision.
absl::StatusOr<bool> WasEverThere(MapReader* reader, const Snapshot& map, const PrunePolicy& policy,
                                  const StopCheck& stop);

/// Sorts, and leaves out what stands twice.
void Normalize(Erasure* erasure);
/// Names also what `other` names.
void Join(const Erasure& other, Erasure* erasure);
/// Names nothing.
bool IsEmpty(const Erasure& erasure);

}  // namespace dsg
