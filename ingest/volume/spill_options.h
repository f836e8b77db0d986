// SPDX-License-Identifier: Apache-2.0
// How much of the volume stays in memory, and where the rest goes.
#pragma once

#include <string>
#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

/// Results do not depend on any of these, so they are no part of a session.
struct SpillOptions {
  double resident_block_count = 60'000;
  /// Where the file is to be; empty = TMPDIR, or /tmp.
  std::string folder;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
