// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/restore.h"

#include <charconv>
#include <filesystem>
#include <memory>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/archive_map.h"
#include "schema/archive/row_file.h"
#include "schema/archive/scratch_store.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
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

// All digits, as two numbers that differ in the last are two.
std::string ExactText(double value) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof(text), value).ptr);
}

// What the manifest says of the map must be what the map says of itself. `state` comes last: it is
// of the other fields and of the tags.
absl::Status CheckManifestIs(const std::string& path, const ArchiveManifest& said,
                             const ArchiveManifest& found) {
  const auto number = [](int64_t value) { return absl::StrCat(value); };
  const auto choice = [](auto value) { return absl::StrCat(static_cast<int>(value)); };
  const struct {
    const char* field;
    std::string said;
    std::string found;
  } fields[] = {
      {"map", said.spec.name, found.spec.name},
      {"frame", said.spec.frame, found.spec.frame},
      {"epoch_ns", number(said.spec.epoch_ns), number(found.spec.epoch_ns)},
      {"clock", choice(said.spec.clock), choice(found.spec.clock)},
      {"codec", choice(said.spec.codec), choice(found.spec.codec)},
      {"gap_ns_max", number(said.spec.gap_ns_max), number(found.spec.gap_ns_max)},
      {"mesh_block_size_m", ExactText(said.spec.mesh_block_size_m),
       ExactText(found.spec.mesh_block_size_m)},
      // Rows have no format but that of their payloads, of which all older ones are read.
      {"store_format",
       number(said.content == ArchiveContent::kRows ? found.store_format : said.store_format),
       number(found.store_format)},
      {"newest_revision", number(said.newest_revision), number(found.newest_revision)},
      {"newest_digest", ToHex(said.newest_digest), ToHex(found.newest_digest)},
      {"oldest_revision", number(said.oldest_revision), number(found.oldest_revision)},
      {"state", ToHex(said.state), ToHex(found.state)},
  };
  for (const auto& field : fields) {
    if (field.said == field.found) continue;
    return MakeError(
        Reason::kStoreCorrupt,
        absl::StrCat("the manifest of archive ", path, " says ", field.field, " \"", field.said,
                     "\", and the map in it \"", field.found, "\"; take another copy of it"),
        {{"path", path}, {"field", field.field}, {"expected", field.said}, {"found", field.found}});
  }
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<MapReader>> OpenUnpacked(const std::string& path,
                                                        const std::string& folder,
                                                        const ArchiveManifest& manifest) {
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       OpenStore(folder, {.program = "dsg restore"}));
  auto map = store->OpenMap(manifest.spec.name);
  if (!map.ok()) return Annotate(map.status(), absl::StrCat("archive ", path));
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest found, DescribeMap(map->get()));
  DSG_RETURN_IF_ERROR(CheckManifestIs(path, manifest, found));
  return *std::move(map);
}

// Makes the rows of an archive the map `name`. `place` takes what is under way.
absl::StatusOr<ArchiveManifest> InstallArchivedRows(const std::string& path,
                                                    const ScratchStore& place, GraphStore* store,
                                                    const std::string& name, bool replace,
                                                    const StopCheck& stop,
                                                    const Progress& progress) {
  const std::string unpacked = place.folder() + "/rows";
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest manifest, Unpack(path, unpacked, stop, progress));
  DSG_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(unpacked));
  RowFileReader reader(std::move(file), manifest.spec.name);
  RowsSummary summary;
  const RowSource rows = [&](StreamRow* row) -> absl::StatusOr<bool> {
    DSG_ASSIGN_OR_RETURN(const bool has_row, reader.Next(row));
    if (has_row) {
      summary.Take(*row);
    } else {
      DSG_RETURN_IF_ERROR(CheckManifestIs(path, manifest, summary.Describe(manifest.spec)));
    }
    return has_row;
  };
  MapSpec spec = manifest.spec;
  spec.name = name;
  DSG_RETURN_IF_ERROR(store->InstallRows(spec, rows, place.folder(), replace, stop));
  return manifest;
}

std::string TemporaryFolder() {
  std::error_code error;
  const std::string folder = std::filesystem::temp_directory_path(error).string();
  return error ? std::string("/tmp") : folder;
}

// Unpacks a database, and installs it.
absl::StatusOr<ArchiveManifest> InstallDatabase(const std::string& path, const ScratchStore& place,
                                                const ArchiveManifest& head, GraphStore* store,
                                                const std::string& name, bool replace,
                                                const StopCheck& stop, const Progress& progress) {
  DSG_ASSIGN_OR_RETURN(const std::string database, place.MakeMapPath(head.spec.name));
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest manifest, Unpack(path, database, stop, progress));
  DSG_RETURN_IF_ERROR(OpenUnpacked(path, place.folder(), manifest).status());
  DSG_RETURN_IF_ERROR(AskStop(stop));
  DSG_RETURN_IF_ERROR(store->InstallMap(name, database, replace));
  return manifest;
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

absl::Status CheckMayReplace(GraphStore* store, const std::string& name) {
  const absl::Status opened = store->OpenWriter(name).status();
  // What cannot be opened for another reason is one to be replaced.
  return ReasonOf(opened) == Reason::kWriterLocked ? opened : absl::OkStatus();
}

absl::StatusOr<ArchiveManifest> RestoreArchive(const std::string& path, GraphStore* store,
                                               const RestoreOptions& options, const StopCheck& stop,
                                               const Progress& progress) {
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest head, ReadArchiveManifest(path));
  const std::string name = options.name.empty() ? head.spec.name : options.name;
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  if (!options.replace) DSG_RETURN_IF_ERROR(CheckNameIsFree(store, name));
  const std::string folder = store->folder().empty() ? TemporaryFolder() : store->folder();
  DSG_ASSIGN_OR_RETURN(const auto place, ScratchStore::Make(folder, "restore"));
  auto manifest =
      head.content == ArchiveContent::kRows
          ? InstallArchivedRows(path, *place, store, name, options.replace, stop, progress)
          : InstallDatabase(path, *place, head, store, name, options.replace, stop, progress);
  const absl::Status& status = manifest.status();
  // The file that such an error names is gone by the time it is read.
  const bool is_of_file = (absl::IsDataLoss(status) || absl::IsFailedPrecondition(status)) &&
                          !absl::StrContains(status.message(), path);
  if (is_of_file) return Annotate(status, absl::StrCat("archive ", path));
  if (progress && manifest.ok()) progress(1.0);
  return manifest;
}

absl::StatusOr<VerifyReport> VerifyArchive(const std::string& path, const StopCheck& stop,
                                           const Progress& progress) {
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest head, ReadArchiveManifest(path));
  DSG_ASSIGN_OR_RETURN(const auto place, ScratchStore::Make(TemporaryFolder(), "dsg-verify"));
  const auto tell = [&](double fraction) {
    if (progress) progress(kReadShare + (1.0 - kReadShare) * fraction);
  };
  if (head.content == ArchiveContent::kRows) {
    DSG_ASSIGN_OR_RETURN(const auto store, OpenStore(place->folder(), {.program = "dsg verify"}));
    DSG_RETURN_IF_ERROR(InstallArchivedRows(path, *place, store.get(), head.spec.name,
                                            /*replace=*/false, stop, progress)
                            .status());
    DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(head.spec.name));
    return map->Verify(stop, tell);
  }
  DSG_ASSIGN_OR_RETURN(const std::string database, place->MakeMapPath(head.spec.name));
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest manifest, Unpack(path, database, stop, progress));
  DSG_ASSIGN_OR_RETURN(const auto map, OpenUnpacked(path, place->folder(), manifest));
  return map->Verify(stop, tell);
}

}  // namespace dsg
