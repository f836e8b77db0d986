// SPDX-License-Identifier: Apache-2.0
// The poses of one agent over an interval, one message at a time, so that a slow reader holds
// neither a thread nor more memory than one message.
#pragma once

#include <memory>
#include <optional>

#include "query/engine/service_core.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

class AgentNames;
class ReadView;

/// Errors: AGENT_UNKNOWN; TIME_RANGE_INVERTED; FIELD_INVALID for a period below 1 ms.
absl::StatusOr<std::unique_ptr<TrajectoryCursor>> OpenTrajectory(
    const ReadView& view, AgentNames* names, const v1::GetTrajectoryRequest& request);

}  // namespace dsg::query
