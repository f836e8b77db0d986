// SPDX-License-Identifier: Apache-2.0
// The interval that --from and --to mean.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "query/cli/session.h"
#include "schema/base/time.h"

namespace dsg::cli {

/// An end that is left open is that of all poses, so that the whole of the map's time is asked.
/// Errors: INVALID_ARGUMENT naming the option; of the calls.
absl::StatusOr<Interval> AskedInterval(Session* session, const std::string& from,
                                       const std::string& to);

}  // namespace dsg::cli
