// SPDX-License-Identifier: Apache-2.0
// Wipes things out of all revisions of a map. Refuses to touch what is believed now.
#pragma once

#include "schema/store/map_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// What one transaction takes out, so that its log fits into the space kept for forgetting.
struct EraseStep {
  int64_t bytes = int64_t{2} << 20;
  int64_t rows = 10'000;
};

/// The work of MapWriter::Erase but for the counting of bytes and files. Each step is a
/// transaction, after which the map is sound.
absl::Status EraseFromMap(Database& db, const MapSpec& spec, const Erasure& erasure,
                          const StopCheck& stop, const Progress& progress, EraseReport* report,
                          const EraseStep& step = {});

}  // namespace dsg::sqlite
