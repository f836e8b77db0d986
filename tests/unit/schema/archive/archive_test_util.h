// SPDX-License-Identifier: Apache-2.0
// A map with history and tags, and its archive as bytes and as a file.
#pragma once

#include <memory>
#include <string>

#include "schema/store/graph_store.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {

/// `revision_count` deltas of the stream that uses every part of the model, two of them tagged.
std::unique_ptr<TestMap> MakeArchivedMap(int64_t revision_count, uint64_t seed = 1);

/// The archive of rows. Errors: of ArchiveRows and ArchiveEncoder.
absl::StatusOr<std::string> RowArchiveBytes(MapReader* map, const std::string& scratch);

/// Errors: of ArchiveMap and ArchiveEncoder.
absl::StatusOr<std::string> ArchiveBytes(MapReader* map, const std::string& scratch);
absl::StatusOr<std::string> ArchiveBytes(GraphStore* store, const std::string& map);

std::string ReadBytes(const std::string& path);
void WriteBytes(const std::string& path, const std::string& bytes);

/// Names in a folder, sorted and joined.
std::string NamesOf(const std::string& folder);

}  // namespace dsg::test
