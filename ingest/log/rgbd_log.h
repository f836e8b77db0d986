// SPDX-License-Identifier: Apache-2.0
// RGB-D datasets in folders as logs: frame numbers become times, matrices become poses.
// Refuses to invent a clock: without stamps, frames follow each other by LogOptions::frame_period.
#pragma once

#include <string>

#include "ingest/log/readers.h"

namespace dsg::ingest {

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file and what to do.
OpenedLog OpenRgbdFolder(const std::string& folder, const LogOptions& options);

}  // namespace dsg::ingest
