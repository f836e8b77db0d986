// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/restore.h"

#include <filesystem>
#include <memory>

#include "absl/strings/str_cat.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/archive_map.h"
#include "schema/archive/scratch_store.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"

namespace dsg {
namespace {

// Of the progress of the whole: reading the archive, then verifying the map.
constexpr double kReadShare = 0.5;

// Unpacks into a folder of its own.
absl::StatusOr<ArchiveManifest> Unpack(const std::string& path, const std::string& database,
                                       const StopCheck& stop, const Progress& progress) {
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(database));
  const auto write = [&](std::string_view bytes) { return file.Write(bytes); };
  const auto tell = [&](double fraction) {
    if (progress) progress(kReadShare * fraction);
  };
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest manifest, ReadArchiveFile(path, write, stop, tell));
  DSG_RETURN_IF_ERROR(file.Commit());
  return manifest;
}

absl::StatusOr<std::shared_ptr<MapReader>> OpenUnpacked(const std::string& path,
                                                        const std::string& folder,
                                                        const ArchiveManifest& manifest) {
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       GraphStore::Open(folder, {.program = "dsg restore"}));
  auto map = store->OpenMap(manifest.spec.name);
  if (!map.ok()) return Annotate(map.status(), absl::StrCat("archive ", path));
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest found, DescribeMap(map->get()));
  if (found.state == manifest.state && found.newest_digest == manifest.newest_digest &&
      found.newest_revision == manifest.newest_revision) {
    return *std::move(map);
  }
  return MakeError(Reason::kStoreCorrupt,
                   absl::StrCat("archive ", path, " holds map \"", found.spec.name,
                                "\" at revision ", found.newest_revision,
                                ", which is not the one that its manifest names; take another "
                                "copy of it"),
                   {{"path", path}});
}

}  // namespace

absl::Status CheckNameIsFree(GraphStore* store, const std::string& name) {
  const auto there = store->OpenMap(name);
  if (ReasonOf(there.status()) == Reason::kMapUnknown) return absl::OkStatus();
  // Whatever is there, readable or not, is not ours to replace.
  return MakeError(Reason::kMapExists,
                   absl::StrCat("map \"", name, "\" is in store ", store->folder(),
                                " already; restore under another name, or say that it may be "
                                "replaced"),
                   {{"map", name}});
}

absl::StatusOr<ArchiveManifest> RestoreArchive(const std::string& path, GraphStore* store,
                                               const RestoreOptions& options, const StopCheck& stop,
                                               const Progress& progress) {
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest head, ReadArchiveManifest(path));
  const std::string name = options.name.empty() ? head.spec.name : options.name;
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  if (!options.replace) DSG_RETURN_IF_ERROR(CheckNameIsFree(store, name));
  DSG_ASSIGN_OR_RETURN(const auto place, ScratchStore::Make(store->folder(), "restore"));
  DSG_ASSIGN_OR_RETURN(const std::string database, place->MakeDatabasePath(head.spec.name));
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest manifest, Unpack(path, database, stop, progress));
  DSG_RETURN_IF_ERROR(OpenUnpacked(path, place->folder(), manifest).status());
  DSG_RETURN_IF_ERROR(AskStop(stop));
  DSG_RETURN_IF_ERROR(store->InstallMap(name, database, options.replace));
  if (progress) progress(1.0);
  return manifest;
}

absl::StatusOr<VerifyReport> VerifyArchive(const std::string& path, const StopCheck& stop,
                                           const Progress& progress) {
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest head, ReadArchiveManifest(path));
  std::error_code error;
  const std::string folder = std::filesystem::temp_directory_path(error).string();
  DSG_ASSIGN_OR_RETURN(const auto place,
                       ScratchStore::Make(error ? std::string("/tmp") : folder, "dsg-verify"));
  DSG_ASSIGN_OR_RETURN(const std::string database, place->MakeDatabasePath(head.spec.name));
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest manifest, Unpack(path, database, stop, progress));
  DSG_ASSIGN_OR_RETURN(const auto map, OpenUnpacked(path, place->folder(), manifest));
  return map->Verify([&](double fraction) {
    if (progress) progress(kReadShare + (1.0 - kReadShare) * fraction);
  });
}

}  // namespace dsg
