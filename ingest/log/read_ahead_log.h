// SPDX-License-Identifier: Apache-2.0
// A log that a thread of its own reads ahead of its caller.
#pragma once

#include <cstddef>
#include <memory>

#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// The same measurements in the same order, read up to `count_max` (1 or more) ahead: what is made
/// of a log on its way (poses by odometry, places known again) is made while the caller uses what
/// came before. info() is as it was at the beginning until Next has told the end.
///
/// A followed log gives what there is as soon as it is there. Its idle function is not called, so
/// what waits for it must go by the log's time (LogRun::is_timed).
///
/// Requires: nobody else reads the log, and its info() but for the notes is final. Threads: one
/// caller, and one that reads `log`.
std::unique_ptr<LogSource> ReadAhead(std::unique_ptr<LogSource> log, size_t count_max);

}  // namespace dsg::ingest
