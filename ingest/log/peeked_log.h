// SPDX-License-Identifier: Apache-2.0
// A log whose first measurement has been read already, so that one knows that there is one.
// Refuses to read further ahead.
#pragma once

#include <memory>

#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// The same log, after it has proved able to give its first measurement.
/// Errors: of LogSource::Next.
absl::StatusOr<std::unique_ptr<LogSource>> PeekLog(std::unique_ptr<LogSource> log);

}  // namespace dsg::ingest
