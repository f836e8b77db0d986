// SPDX-License-Identifier: Apache-2.0
// What comes into the store over the service: new maps, and deltas, which are translated with the
// map's own layers and handed to its writer, which alone decides whether they are valid.
#pragma once

#include <string>
#include <string_view>

namespace dsg::query {

/// A session for the deltas of one piece of the engine's own work, such as a prune: deltas are
/// known by session and sequence, so no two pieces may share one, in any process.
std::string NewSessionId(std::string_view work);

}  // namespace dsg::query
