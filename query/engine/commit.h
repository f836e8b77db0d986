// SPDX-License-Identifier: Apache-2.0
// The way in over the service: one delta, translated with the map's own layers and handed to the
// map's writer, which alone decides whether it is valid.
#pragma once

#include <string>
#include <string_view>

namespace dsg::query {

/// A session for the deltas of one piece of the engine's own work, such as a prune: deltas are
/// known by session and sequence, so no two pieces may share one, in any process.
std::string NewSessionId(std::string_view work);

}  // namespace dsg::query
