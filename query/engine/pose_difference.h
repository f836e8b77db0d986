// SPDX-License-Identifier: Apache-2.0
// Whether poses that a snapshot told are others, or gone, in a later one.
// Refuses to say which: a corrected track is read again.
#pragma once

#include "absl/status/statusor.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// Equal to the last bit, but that q and -q are one rotation: which of them is stored depends on
/// the poses before it.
bool IsSamePose(const TimedPose& a, const TimedPose& b);

/// An agent that either snapshot does not know has no poses there.
/// Cost: the poses up to the first difference; a few thousand are held at a time.
absl::StatusOr<bool> PosesWereCorrected(const Snapshot& earlier, const Snapshot& later,
                                        NodeId agent, const StopCheck& stop);

}  // namespace dsg::query
