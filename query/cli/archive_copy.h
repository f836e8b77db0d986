// SPDX-License-Identifier: Apache-2.0
// The archive of a map, read from a store or a server, and handed on piece by piece.
// Knows nothing of where the bytes go.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "query/cli/session.h"
#include "schema/model/node.h"
#include "schema/store/map_writer.h"

namespace dsg::cli {

/// Errors: of ReadArchive; what `write` returns.
absl::Status CopyArchive(Session* session, const std::string& map, const query::CallContext& call,
                         const std::function<absl::Status(std::string_view)>& write,
                         const dsg::Progress& progress);

/// What StateDigest says of the map as it is now. Errors: of the calls that are made.
absl::StatusOr<Sha256> StateOfMap(Session* session, const std::string& map);

}  // namespace dsg::cli
