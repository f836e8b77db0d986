// SPDX-License-Identifier: Apache-2.0
// What a log gave a map: whether it is anything, and what to do about frames that were lost.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ingest/log/log_source.h"
#include "ingest/pipeline/ingest_log.h"

namespace dsg::ingest {

/// Whether a log that was read to its end gave anything. A log whose content the map has already
/// gave something, also if nothing was written.
///
/// Errors: FAILED_PRECONDITION, saying why and what to do, if it has neither poses nor nodes, or if
/// not one of its frames could be used and it shows nobody but the robot that made it.
absl::Status CheckYield(const LogInfo& info, const IngestSummary& summary);

/// "no pose 3, pose jump 2".
std::string CountsText(const std::map<std::string, int64_t>& counts);

/// One sentence on each reason for which frames were lost, and which option helps; empty for
/// reasons without a remedy. Order: by reason.
std::vector<std::string> HintsOnLostFrames(const SkipCounts& skipped);

}  // namespace dsg::ingest
