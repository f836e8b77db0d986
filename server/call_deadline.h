// SPDX-License-Identifier: Apache-2.0
// How long a call may take: the caller's deadline, up to a maximum. Watches and maintenance have no
// maximum.
#pragma once

#include <chrono>

#include "query/api/call_context.h"

namespace dsg::server {

/// Deadline of calls whose caller set none.
inline constexpr std::chrono::seconds kDeadlineDefault{5};
/// Upper bound for every caller's deadline.
inline constexpr std::chrono::seconds kDeadlineMax{300};

/// When a call must end. `deadline` is as gRPC reports it: the largest time point if the caller set
/// none.
query::CallContext::Clock::time_point BoundDeadline(std::chrono::system_clock::time_point deadline);

/// Whether gRPC alone would let a call with that deadline run longer than BoundDeadline.
bool OutlastsBound(std::chrono::system_clock::time_point deadline);

/// The same for watches and maintenance, which have no maximum: the caller's deadline, or the
/// largest time point if the caller set none.
query::CallContext::Clock::time_point WatchDeadline(std::chrono::system_clock::time_point deadline);

}  // namespace dsg::server
