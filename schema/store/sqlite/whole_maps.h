// SPDX-License-Identifier: Apache-2.0
// Drops and renames maps, and ends what programs that were killed meanwhile have begun.
//
// A map is dropped by renaming its folder to ".dropped-NUMBER", which is no name of a map; its
// files are removed after that. A map is renamed by writing the new name into it, and renaming its
// folder after that; ".renaming.OLD.NEW", an empty file in the store's folder, says between the two
// that the folder is to follow. Both begin with the writer's lock of the map.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/store/graph_store.h"

namespace dsg::sqlite {

/// See GraphStore::DropMap.
absl::StatusOr<DropReport> DropMapFiles(const std::string& store_folder, const std::string& name,
                                        const MapCondition& condition, const std::string& program);

/// See GraphStore::RenameMap.
absl::Status RenameMapFiles(const std::string& store_folder, const std::string& from,
                            const std::string& to, const std::string& program);

/// Removes files of dropped maps, and ends renamings. What cannot be done, such as by a program
/// that may only read the store, is left for the next one.
void SettleWholeMaps(const std::string& store_folder);

/// Whether the map in the folder of map `folder_name` is being renamed to `name`.
bool IsBeingRenamed(const std::string& store_folder, const std::string& folder_name,
                    const std::string& name);

}  // namespace dsg::sqlite
