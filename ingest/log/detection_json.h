// SPDX-License-Identifier: Apache-2.0
// One human detection as a line of JSON, as docs/sensor_logs.md describes it.
// Refuses numbers that no detector gives: they would pass unseen until a person flies away.
#pragma once

#include <string_view>

#include "absl/status/statusor.h"
#include "ingest/log/text_table.h"
#include "ingest/sensor/human_detection.h"

namespace dsg::ingest {

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED at `at`, naming the field and the value. A line has at
/// most 1 MiB and nests at most 8 deep.
absl::StatusOr<HumanDetection> ParseDetection(const LinePosition& at, std::string_view line);

}  // namespace dsg::ingest
