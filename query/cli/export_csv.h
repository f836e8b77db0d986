// SPDX-License-Identifier: Apache-2.0
// A map as tables: nodes.csv, edges.csv, tracks.csv and stays.csv, RFC 4180 with one line of
// headings. Times are integers in nanoseconds on the map's clock; on a UNIX clock each has a column
// with the date beside it. An unknown value and an open end of an interval are empty cells.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/cli/json.h"
#include "query/cli/map_rows.h"

namespace dsg::cli {

/// Writes the tables to `folder`, which is made if it is not there.
/// Errors: of AtomicFile, before anything is written if a file exists and `force` is unset; of the
/// calls.
absl::StatusOr<std::vector<Written>> WriteCsvTables(const MapRows& map, const std::string& folder,
                                                    bool force);

}  // namespace dsg::cli
