// SPDX-License-Identifier: Apache-2.0
// Brings the file of a map to the newest format. The only code that knows older ones.
#pragma once

#include <string>

#include "schema/store/graph_store.h"

namespace dsg::sqlite {

/// See GraphStore::UpgradeMap.
absl::StatusOr<UpgradeReport> UpgradeMapFile(const std::string& store_folder,
                                             const std::string& map, const std::string& program);

}  // namespace dsg::sqlite
