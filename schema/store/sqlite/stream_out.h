// SPDX-License-Identifier: Apache-2.0
// A map in files as a stream of rows. Refuses to keep more than one track's directory in memory.
#pragma once

#include "schema/base/stop_check.h"
#include "schema/model/layer.h"
#include "schema/store/row_stream.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// See MapReader::ReadRows. `db` must have no statements running.
absl::Status StreamRows(Database& db, const MapSpec& spec, const RowSink& sink,
                        const StopCheck& stop);

}  // namespace dsg::sqlite
