// SPDX-License-Identifier: Apache-2.0
// How others than its caller end a call.
#pragma once

#include <functional>

#include "absl/status/status.h"

namespace dsg::server {

/// Ends a call with a status, from any thread. Holds what it needs of the call, so that it may be
/// called when the call has ended; it then does nothing.
using EndCall = std::function<void(const absl::Status&)>;

}  // namespace dsg::server
