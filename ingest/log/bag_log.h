// SPDX-License-Identifier: Apache-2.0
// A bag as a log: topics as channels, and where its poses and loop closures come from.
#pragma once

#include <string>

#include "ingest/log/readers.h"

namespace dsg::ingest {

/// The log is a BagStream.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming byte offset or topic, message and stamps.
OpenedLog OpenBag(const std::string& path, const LogOptions& options);

}  // namespace dsg::ingest
