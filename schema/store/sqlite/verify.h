// SPDX-License-Identifier: Apache-2.0
// Reads a whole map: SQLite's structure and every checksum, and what each row adds to the digests
// of the revisions.
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/store/graph_store.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// See MapReader::Verify.
absl::StatusOr<VerifyReport> VerifyMap(Database& db, const MapSpec& spec, const StopCheck& stop,
                                       const std::function<void(double)>& progress);

}  // namespace dsg::sqlite
