// SPDX-License-Identifier: Apache-2.0
// The body of one agent over an interval, one message at a time.
// Refuses to hold more than a message and the shapes that are decoded together.
#pragma once

#include <memory>

#include "query/engine/service_core.h"

namespace dsg::query {

class AgentNames;
class ReadView;

/// Errors: AGENT_UNKNOWN; TIME_RANGE_INVERTED; FIELD_INVALID for a part that there is not.
absl::StatusOr<std::unique_ptr<AgentShapeCursor>> OpenAgentShape(
    const ReadView& view, AgentNames* names, const v1::GetAgentShapeRequest& request);

}  // namespace dsg::query
