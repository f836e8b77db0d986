// SPDX-License-Identifier: Apache-2.0
// What comes into the store over the service: new maps, and deltas, which are translated with the
// map's own layers and handed to its writer, which alone decides whether they are valid.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace dsg::query {

/// A session for the deltas of one piece of the engine's own work, such as a prune: deltas are
/// known by session and sequence, so no two pieces may share one, in any process.
std::string NewSessionId(std::string_view work);

/// `work` again, a few times, while it ends with MAP_REPLACED: a reader notices only when it reads
/// that an erasure has rewritten its past, and the map is then opened anew.
absl::Status WithoutOldReaders(const std::function<absl::Status()>& work);

}  // namespace dsg::query
