// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/archive_map.h"

#include <utility>

#include "schema/archive/row_file.h"
#include "schema/archive/scratch_store.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"

namespace dsg {
namespace {

constexpr char kProgram[] = "dsgdb " DSG_VERSION;

// From the copy itself, so that what the manifest says is of the copy and of no later revision.
absl::StatusOr<ArchiveManifest> DescribeCopy(const std::string& folder, const std::string& map) {
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       OpenStore(folder, {.program = "dsg archive"}));
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> copy, store->OpenMap(map));
  return DescribeMap(copy.get());
}

}  // namespace

absl::StatusOr<ArchiveManifest> DescribeMap(MapReader* map) {
  ArchiveManifest manifest;
  manifest.spec = map->spec();
  manifest.store_format = kStoreFormatVersion;
  DSG_ASSIGN_OR_RETURN(const RevisionInfo newest, map->Head());
  manifest.newest_revision = newest.revision;
  manifest.newest_digest = newest.digest;
  DSG_ASSIGN_OR_RETURN(manifest.oldest_revision, map->OldestRevision());
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, map->Tags());
  manifest.state = StateDigest(manifest.spec, manifest.newest_revision, manifest.newest_digest,
                               manifest.oldest_revision, tags);
  manifest.program = kProgram;
  return manifest;
}

absl::StatusOr<std::unique_ptr<ArchiveEncoder>> ArchiveMap(MapReader* map,
                                                           const std::string& scratch,
                                                           const StopCheck& stop,
                                                           const Progress& progress) {
  const std::string name = map->spec().name;
  DSG_ASSIGN_OR_RETURN(const auto place, ScratchStore::Make(scratch, "archive"));
  DSG_ASSIGN_OR_RETURN(const std::string path, place->MakeMapPath(name));
  DSG_RETURN_IF_ERROR(map->CopyTo(path, stop, progress));
  DSG_ASSIGN_OR_RETURN(ArchiveManifest manifest, DescribeCopy(place->folder(), name));
  // Open files outlive their names, so that nothing is left of the copy even after kill -9.
  DSG_ASSIGN_OR_RETURN(InputFile database, InputFile::Open(path));
  manifest.database_bytes = database.byte_count();
  return std::make_unique<ArchiveEncoder>(std::move(database), std::move(manifest));
}

absl::StatusOr<std::unique_ptr<ArchiveEncoder>> ArchiveRows(MapReader* map,
                                                            const std::string& scratch,
                                                            const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const auto place, ScratchStore::Make(scratch, "archive"));
  const std::string path = place->folder() + "/rows";
  RowsSummary summary;
  {
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path));
    std::string bytes;
    const auto write = [&](const StreamRow& row) {
      summary.Take(row);
      bytes.clear();
      AppendRow(row, &bytes);
      return file.Write(bytes);
    };
    DSG_RETURN_IF_ERROR(map->ReadRows(write, stop));
    DSG_RETURN_IF_ERROR(file.Commit());
  }
  ArchiveManifest manifest = summary.Describe(map->spec());
  manifest.program = kProgram;
  DSG_ASSIGN_OR_RETURN(InputFile rows, InputFile::Open(path));
  manifest.database_bytes = rows.byte_count();
  return std::make_unique<ArchiveEncoder>(std::move(rows), std::move(manifest));
}

}  // namespace dsg
