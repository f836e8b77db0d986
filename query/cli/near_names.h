// SPDX-License-Identifier: Apache-2.0
// What may have been meant by a name that nobody knows.
#pragma once

#include "absl/status/status.h"
#include "query/cli/session.h"

namespace dsg::cli {

/// The same error. If it is about an unknown map, agent or node by name, it also gets the known
/// names that are near in spelling, which are asked for in further calls; errors of these are
/// ignored. Requires: the session is open.
absl::Status WithNearNames(Session* session, const absl::Status& status);

}  // namespace dsg::cli
