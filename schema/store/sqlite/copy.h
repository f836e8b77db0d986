// SPDX-License-Identifier: Apache-2.0
// Whole maps as single files: copied out of a store, and taken into one.
// Refuses to let anybody see half of one.
#pragma once

#include <string>

#include "schema/store/map_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// See MapReader::CopyTo. `db` must have no statements running.
absl::Status CopyMap(Database& db, const std::string& path, const StopCheck& stop,
                     const Progress& progress);

/// See GraphStore::InstallMap.
absl::Status InstallMapFile(const std::string& store_folder, const std::string& name,
                            const std::string& file, bool replace, const std::string& program);

}  // namespace dsg::sqlite
