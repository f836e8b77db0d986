// SPDX-License-Identifier: Apache-2.0
// How long a call may take: what the caller gave, within bounds. Only a watch may last for ever.
#pragma once

#include <chrono>

#include "query/engine/call_context.h"

namespace dsg::server {

/// For callers that gave no deadline.
inline constexpr std::chrono::seconds kDeadlineDefault{5};
/// No call takes longer, whatever the caller gave.
inline constexpr std::chrono::seconds kDeadlineMax{300};
/// A watch whose reader takes no message for so long is ended.
inline constexpr std::chrono::seconds kWatchStallMax{30};

/// `deadline` as gRPC reports it: the largest time point when the caller gave none.
query::CallContext::Clock::time_point BoundDeadline(std::chrono::system_clock::time_point deadline);

/// The same for watches, which have no end of their own: none unless the caller gave one.
query::CallContext::Clock::time_point WatchDeadline(std::chrono::system_clock::time_point deadline);

}  // namespace dsg::server
