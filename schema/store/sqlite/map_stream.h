// SPDX-License-Identifier: Apache-2.0
// Maps in files as streams of rows, and the way back. Refuses to keep more than one track's
// directory in memory.
#pragma once

#include <string>

#include "schema/base/stop_check.h"
#include "schema/model/layer.h"
#include "schema/store/row_stream.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// See MapReader::ReadRows. `db` must have no statements running.
absl::Status StreamRows(Database& db, const MapSpec& spec, const RowSink& sink,
                        const StopCheck& stop);

/// Fills a new map, as CreateMapFile leaves it before its rows, from a stream. What it holds is
/// not proven, and after an error it is half a map.
absl::Status CollectRows(Database& db, const MapSpec& spec, const RowSource& rows,
                         const StopCheck& stop);

}  // namespace dsg::sqlite
