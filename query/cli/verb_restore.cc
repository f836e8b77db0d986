// SPDX-License-Identifier: Apache-2.0
// The verb restore: maps of a backup, or of one archive, into a store folder.
// All that is to be restored is checked before anything in the store changes.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/cli/interrupt.h"
#include "query/cli/progress.h"
#include "query/cli/table.h"
#include "query/cli/verbs.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/backup_folder.h"
#include "schema/archive/restore.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;

// A map that is to be restored.
struct Wanted {
  std::string path;
  std::string name;
};

class Restorer {
 public:
  Restorer(const CommonOptions& common, const RestoreVerb& verb, std::ostream* progress_out)
      : common_(common), verb_(verb), progress_out_(progress_out), guard_(&call_) {}

  absl::Status Run() {
    std::error_code error;
    const bool is_folder = fs::is_directory(verb_.path, error);
    DSG_RETURN_IF_ERROR(is_folder ? TakeFolder() : TakeFile());
    // From the deepest one up.
    std::vector<fs::path> made;
    for (fs::path path = common_.store; !path.empty() && !fs::exists(path, error);
         path = path.parent_path()) {
      made.push_back(path);
    }
    const absl::Status status = RestoreAll();
    // Those that hold nothing.
    if (!status.ok()) {
      for (const fs::path& path : made) fs::remove(path, error);
    }
    return status;
  }

  bool has_restored() const { return !restored_.empty(); }
  /// Also of those that were restored before an error.
  void Tell(std::ostream& out) const {
    nlohmann::ordered_json json = {{"maps", nlohmann::ordered_json::array()}};
    for (const auto& [name, manifest] : restored_) {
      json["maps"].push_back({{"map", name},
                              {"newest_revision", std::to_string(manifest.newest_revision)},
                              {"oldest_revision", std::to_string(manifest.oldest_revision)}});
      if (common_.json) continue;
      out << name << ": restored at revision " << manifest.newest_revision << ", readable from "
          << manifest.oldest_revision << " on";
      if (name != manifest.spec.name) out << "; it was called " << manifest.spec.name;
      out << "\n";
    }
    if (common_.json) out << json.dump() << "\n";
  }

 private:
  absl::Status RestoreAll() {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                         OpenStore(common_.store, {.create = true, .program = "dsg restore"}));
    for (const Wanted& wanted : wanted_) DSG_RETURN_IF_ERROR(CheckMayRestore(wanted, store.get()));
    for (const Wanted& wanted : wanted_) DSG_RETURN_IF_ERROR(Restore(wanted, store.get()));
    return absl::OkStatus();
  }

  absl::Status TakeFile() {
    DSG_ASSIGN_OR_RETURN(const ArchiveManifest manifest, ReadArchiveManifest(verb_.path));
    std::string name = !verb_.as.empty() ? verb_.as : common_.map;
    wanted_.push_back({verb_.path, name.empty() ? manifest.spec.name : std::move(name)});
    return absl::OkStatus();
  }

  absl::Status TakeFolder() {
    DSG_ASSIGN_OR_RETURN(const BackupManifest backup, ReadBackupManifest(verb_.path));
    for (const BackupEntry& entry : backup.maps) {
      if (!common_.map.empty() && entry.map != common_.map) continue;
      Progress progress(absl::StrCat("check ", entry.file), progress_out_);
      DSG_RETURN_IF_ERROR(CheckBackupFile(verb_.path, entry, call_.stop(),
                                          [&](double fraction) { progress.Update(fraction); }));
      wanted_.push_back({absl::StrCat(verb_.path, "/", entry.file), entry.map});
    }
    if (wanted_.empty() && !common_.map.empty()) {
      return MakeError(Reason::kMapUnknown,
                       absl::StrCat("the backup in ", verb_.path, " has no map \"", common_.map,
                                    "\"; its MANIFEST lists those it has"),
                       {{"backup", verb_.path}});
    }
    if (verb_.as.empty()) return absl::OkStatus();
    if (wanted_.size() == 1) {
      wanted_.front().name = verb_.as;
      return absl::OkStatus();
    }
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--as names one map, and the backup has ", wanted_.size(),
                                  "; choose one with --map"),
                     {{"field", "--as"}});
  }

  absl::Status CheckMayRestore(const Wanted& wanted, GraphStore* store) const {
    if (verb_.force) return CheckMayReplace(store, wanted.name);
    if (CheckNameIsFree(store, wanted.name).ok()) return absl::OkStatus();
    return ExistsError(wanted.name);
  }

  absl::Status ExistsError(const std::string& name) const {
    return MakeError(Reason::kMapExists,
                     absl::StrCat("map \"", name, "\" is in store ", common_.store,
                                  " already; restore it --as another, or add --force to replace "
                                  "it"),
                     {{"map", name}});
  }

  absl::Status Restore(const Wanted& wanted, GraphStore* store) {
    Progress progress(absl::StrCat("restore ", wanted.name), progress_out_);
    const auto manifest =
        RestoreArchive(wanted.path, store, {.name = wanted.name, .replace = verb_.force},
                       call_.stop(), [&](double fraction) { progress.Update(fraction); });
    if (ReasonOf(manifest.status()) == Reason::kMapExists) return ExistsError(wanted.name);
    DSG_RETURN_IF_ERROR(manifest.status());
    restored_.emplace_back(wanted.name, *manifest);
    return absl::OkStatus();
  }

  const CommonOptions& common_;
  const RestoreVerb& verb_;
  std::ostream* const progress_out_;
  query::CallContext call_;
  const InterruptGuard guard_;
  std::vector<Wanted> wanted_;
  std::vector<std::pair<std::string, ArchiveManifest>> restored_;
};

}  // namespace

absl::Status RunRestore(const CommonOptions& common, const RestoreVerb& verb, std::ostream& out,
                        std::ostream& progress_out) {
  for (const std::string* name : {&verb.as, &common.map}) {
    if (!name->empty()) DSG_RETURN_IF_ERROR(CheckMapName(*name));
  }
  Restorer restorer(common, verb, &progress_out);
  const absl::Status status = restorer.Run();
  if (status.ok() || restorer.has_restored()) restorer.Tell(out);
  return status;
}

}  // namespace dsg::cli
