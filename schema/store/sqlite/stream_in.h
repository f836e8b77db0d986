// SPDX-License-Identifier: Apache-2.0
// A stream of rows into the tables of a new map. Refuses to keep more than one track's directory in
// memory.
#pragma once

#include "schema/base/stop_check.h"
#include "schema/model/layer.h"
#include "schema/store/row_stream.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// Fills the tables of a new map. What they hold is not proven, and after an error it is half a
/// map.
absl::Status CollectRows(Database& db, const MapSpec& spec, const RowSource& rows,
                         const StopCheck& stop);

}  // namespace dsg::sqlite
