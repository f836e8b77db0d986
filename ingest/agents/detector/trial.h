// SPDX-License-Identifier: Apache-2.0
// Tries something that may crash or never end in a process of its own.
// Refuses to bring anything back but whether it came to its end.
#pragma once

#include <functional>

#include "absl/status/status.h"

namespace dsg::ingest {

/// OpenCV 4.6 trusts networks: some stop the whole process, or run for ever.
///
/// Errors: INTERNAL saying what ended `work`: a signal, more than `seconds_max`, or an exit.
/// Requires: `work` neither needs nor leaves threads, and writes nothing.
absl::Status TryApart(const std::function<void()>& work, double seconds_max);

}  // namespace dsg::ingest
