// SPDX-License-Identifier: Apache-2.0
// How much of a map's files is its write-ahead log, which says nothing about the map: it is used
// again. Refuses to speak of the database.
#pragma once

#include <cstdint>
#include <string>

#include "schema/store/graph_store.h"

namespace dsg {

/// Of MapStats::bytes_on_disk, what is the log's, now; 0 when there is none.
int64_t LogBytesOnDisk(const GraphStore& store, const std::string& map);

}  // namespace dsg
