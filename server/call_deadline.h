// SPDX-License-Identifier: Apache-2.0
// How long a call may take: what the caller gave, within bounds.
#pragma once

#include <chrono>

#include "query/engine/call_context.h"

namespace dsg::server {

/// For callers that gave no deadline.
inline constexpr std::chrono::seconds kDeadlineDefault{5};
/// No call takes longer, whatever the caller gave.
inline constexpr std::chrono::seconds kDeadlineMax{300};

/// `deadline` as gRPC reports it: the largest time point when the caller gave none.
query::CallContext::Clock::time_point BoundDeadline(std::chrono::system_clock::time_point deadline);

}  // namespace dsg::server
