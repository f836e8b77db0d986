// SPDX-License-Identifier: Apache-2.0
// The verb backup: archives of all maps in a folder, while a server runs and robots commit.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/archive_copy.h"
#include "query/cli/interrupt.h"
#include "query/cli/map_names.h"
#include "query/cli/progress.h"
#include "query/cli/render_maps.h"
#include "query/cli/table.h"
#include "query/cli/verbs.h"
#include "schema/archive/backup_folder.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;

// A map of the new backup, and how it came there.
struct Saved {
  BackupEntry entry;
  enum class How { kCopied, kUnchanged, kKept } how = How::kCopied;
};

const char* TextOf(Saved::How how) {
  switch (how) {
    case Saved::How::kUnchanged:
      return "unchanged since the last backup";
    case Saved::How::kKept:
      return "kept from the last backup";
    default:
      return "copied";
  }
}

// A backup inside of what is backed up would be taken for a map.
absl::Status CheckIsOutside(const std::string& folder, const std::string& store) {
  if (store.empty()) return absl::OkStatus();
  std::error_code error;
  const std::string out = fs::weakly_canonical(folder, error).string();
  const std::string in = fs::weakly_canonical(store, error).string();
  if (out != in && !absl::StartsWith(out, in + "/")) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("folder ", folder, " is inside of the store ", store,
                                "; name one elsewhere, on another disk if there is one"),
                   {{"path", folder}});
}

absl::StatusOr<std::vector<std::string>> MapsOf(Session* session) {
  const CommonOptions& common = session->common();
  // A map that cannot be opened must fail the backup, not be missing from it.
  if (!common.store.empty()) return MapNames(common.store, common.map);
  if (!common.map.empty()) return std::vector<std::string>{common.map};
  v1::ListMapsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListMaps(session->NewCall(), v1::ListMapsRequest(), &reply));
  std::vector<std::string> names;
  for (const v1::MapSpec& map : reply.maps()) names.push_back(map.name());
  return names;
}

class Backup {
 public:
  Backup(Session* session, BackupFolder* folder, std::string path, std::ostream* progress_out)
      : session_(session), folder_(folder), path_(std::move(path)), progress_out_(progress_out) {}

  absl::StatusOr<std::vector<Saved>> Run(const query::CallContext& call) {
    DSG_ASSIGN_OR_RETURN(const std::vector<std::string> maps, MapsOf(session_));
    std::vector<Saved> saved;
    for (const std::string& map : maps) {
      absl::StatusOr<Saved> one = Save(map, call);
      if (!one.ok()) return Annotate(one.status(), absl::StrCat("backup of map \"", map, "\""));
      saved.push_back(*std::move(one));
    }
    for (const BackupEntry& entry : folder_->last().maps) {
      if (std::find(maps.begin(), maps.end(), entry.map) != maps.end()) continue;
      saved.push_back({entry, Saved::How::kKept});
    }
    std::sort(saved.begin(), saved.end(),
              [](const Saved& a, const Saved& b) { return a.entry.map < b.entry.map; });
    BackupManifest manifest;
    for (const Saved& one : saved) manifest.maps.push_back(one.entry);
    DSG_RETURN_IF_ERROR(folder_->Finish(manifest));
    return saved;
  }

 private:
  absl::StatusOr<Saved> Save(const std::string& map, const query::CallContext& call) {
    Progress progress(absl::StrCat("backup ", map), progress_out_);
    const auto tell = [&](double fraction) { progress.Update(fraction); };
    const BackupEntry* last = folder_->last().Find(map);
    if (last != nullptr) {
      DSG_ASSIGN_OR_RETURN(const Sha256 state, StateOfMap(session_, map));
      const bool is_as_it_was = state == last->state;
      if (is_as_it_was && CheckBackupFile(path_, *last, call.stop(), tell).ok()) {
        return Saved{*last, Saved::How::kUnchanged};
      }
      DSG_RETURN_IF_ERROR(call.Check());
    }
    DSG_ASSIGN_OR_RETURN(BackupFile file, BackupFile::Create(path_, map));
    DSG_RETURN_IF_ERROR(CopyArchive(
        session_, map, call, [&](std::string_view bytes) { return file.Write(bytes); }, tell));
    DSG_ASSIGN_OR_RETURN(BackupEntry entry, file.Commit(call.stop()));
    return Saved{std::move(entry), Saved::How::kCopied};
  }

  Session* const session_;
  BackupFolder* const folder_;
  const std::string path_;
  std::ostream* const progress_out_;
};

void TellSaved(const std::vector<Saved>& saved, const std::string& folder, bool as_json,
               std::ostream& out) {
  nlohmann::ordered_json json = {{"folder", folder}, {"maps", nlohmann::ordered_json::array()}};
  for (const auto& [entry, how] : saved) {
    json["maps"].push_back({{"map", entry.map},
                            {"file", entry.file},
                            {"newest_revision", std::to_string(entry.newest_revision)},
                            {"byte_count", std::to_string(entry.byte_count)},
                            {"copied", how == Saved::How::kCopied}});
    if (as_json) continue;
    out << entry.map << ": " << TextOf(how) << ", revision " << entry.newest_revision << ", "
        << BytesText(entry.byte_count) << ", " << entry.file << "\n";
  }
  if (as_json) {
    out << json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
    return;
  }
  out << "backup of " << Counted(static_cast<int64_t>(saved.size()), "map") << " in "
      << Printable(folder) << "\n";
}

}  // namespace

absl::Status RunBackup(Session* session, const BackupVerb& verb, std::ostream& out,
                       std::ostream& progress_out) {
  const CommonOptions& common = session->common();
  DSG_RETURN_IF_ERROR(CheckIsOutside(verb.folder, common.store));
  DSG_ASSIGN_OR_RETURN(const auto folder, BackupFolder::Open(verb.folder));
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  Backup backup(session, folder.get(), verb.folder, &progress_out);
  DSG_ASSIGN_OR_RETURN(const std::vector<Saved> saved, backup.Run(call));
  TellSaved(saved, verb.folder, common.json, out);
  return absl::OkStatus();
}

}  // namespace dsg::cli
