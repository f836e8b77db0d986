// SPDX-License-Identifier: Apache-2.0
// A bag as a log: topics as channels, stamps from the messages' headers.
// Refuses stamps that step back within a topic, or by more than a second between topics.
#pragma once

#include <string>

#include "ingest/log/readers.h"

namespace dsg::ingest {

/// A bag without anything usable opens, so that its notes can be read; its first Next() fails.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming byte offset or topic, message and stamps.
OpenedLog OpenBag(const std::string& path, const LogOptions& options);

}  // namespace dsg::ingest
