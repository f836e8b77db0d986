// SPDX-License-Identifier: Apache-2.0
// How long a call may take: what the caller gave, within bounds.
// Only watches and maintenance may last for ever.
#pragma once

#include <chrono>

#include "query/api/call_context.h"

namespace dsg::server {

/// For callers that gave no deadline.
inline constexpr std::chrono::seconds kDeadlineDefault{5};
/// No call takes longer, whatever the caller gave.
inline constexpr std::chrono::seconds kDeadlineMax{300};

/// `deadline` as gRPC reports it: the largest time point when the caller gave none.
query::CallContext::Clock::time_point BoundDeadline(std::chrono::system_clock::time_point deadline);

/// Whether gRPC would let a call with that deadline last longer.
bool OutlastsBound(std::chrono::system_clock::time_point deadline);

/// BoundDeadline for watches and maintenance, which may take any time: none unless the caller gave
/// one.
query::CallContext::Clock::time_point WatchDeadline(std::chrono::system_clock::time_point deadline);

}  // namespace dsg::server
