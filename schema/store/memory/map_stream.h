// SPDX-License-Identifier: Apache-2.0
// Maps in memory as streams of rows, and the way back.
#pragma once

#include <memory>

#include "schema/base/stop_check.h"
#include "schema/store/memory/map_rows.h"
#include "schema/store/row_stream.h"

namespace dsg::memory {

/// See MapReader::ReadRows. Requires: the rows are locked.
absl::Status StreamRows(const MapRows& rows, const StopCheck& stop, const RowSink& sink);

/// See GraphStore::InstallRows; the digests are the caller's to prove.
absl::StatusOr<std::shared_ptr<MapRows>> CollectRows(const MapSpec& spec, const RowSource& source,
                                                     const StopCheck& stop);

}  // namespace dsg::memory
