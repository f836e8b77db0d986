// SPDX-License-Identifier: Apache-2.0
// Drops what no readable revision shows. Refuses to touch anything that one does.
#pragma once

#include "schema/store/map_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// The work of MapWriter::Compact but for its checks and for the counting of bytes. Each step is a
/// transaction, after which the map is sound and can be read.
/// Requires: `keep_from` is at most the head and not below the oldest revision.
absl::Status CompactMap(Database& db, Revision keep_from, const StopCheck& stop,
                        const Progress& progress, CompactReport* report);

}  // namespace dsg::sqlite
