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
#include "query/cli/progress.h"
#include "query/cli/render_maps.h"
#include "query/cli/table.h"
#include "query/cli/verbs.h"
#include "schema/archive/backup_folder.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;

// A map that cannot be read, so that only the last backup has it, if that does.
struct LeftOut {
  std::string map;
  absl::Status why;
};

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

// Also those that cannot be opened: they must be told of, not be missing.
absl::StatusOr<std::vector<std::string>> MapsOf(Session* session) {
  const CommonOptions& common = session->common();
  if (!common.map.empty()) return std::vector<std::string>{common.map};
  v1::ListMapsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListMaps(session->NewCall(), v1::ListMapsRequest(), &reply));
  std::vector<std::string> names(reply.unreadable_maps().begin(), reply.unreadable_maps().end());
  for (const v1::MapSpec& map : reply.maps()) names.push_back(map.name());
  std::sort(names.begin(), names.end());
  return names;
}

// What is wrong with one map, and is no reason to leave out the others; the rest is about the disk,
// the link or the caller.
bool IsOfTheMap(const absl::Status& status) {
  return absl::IsDataLoss(status) || absl::IsFailedPrecondition(status) ||
         absl::IsNotFound(status) || absl::IsInternal(status);
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
      if (one.ok()) {
        saved.push_back(*std::move(one));
      } else if (session_->common().map.empty() && IsOfTheMap(one.status())) {
        left_out_.push_back({map, one.status()});
      } else {
        return Annotate(one.status(), absl::StrCat("backup of map \"", map, "\""));
      }
    }
    KeepOthers(&saved);
    std::sort(saved.begin(), saved.end(),
              [](const Saved& a, const Saved& b) { return a.entry.map < b.entry.map; });
    BackupManifest manifest;
    for (const Saved& one : saved) manifest.maps.push_back(one.entry);
    DSG_RETURN_IF_ERROR(folder_->Finish(manifest));
    return saved;
  }

  /// Once Run has returned.
  const std::vector<LeftOut>& left_out() const { return left_out_; }

 private:
  void KeepOthers(std::vector<Saved>* saved) const {
    for (const BackupEntry& entry : folder_->last().maps) {
      const auto is_it = [&](const Saved& one) { return one.entry.map == entry.map; };
      if (std::none_of(saved->begin(), saved->end(), is_it)) {
        saved->push_back({entry, Saved::How::kKept});
      }
    }
  }

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
  std::vector<LeftOut> left_out_;
};

// The error that a backup without some maps ends with.
absl::Status VerdictOn(const std::vector<LeftOut>& left_out, const std::string& folder) {
  if (left_out.empty()) return absl::OkStatus();
  const Reason reason = ReasonOf(left_out.front().why);
  return MakeError(reason == Reason::kUnspecified ? Reason::kStoreCorrupt : reason,
                   absl::StrCat("the backup in ", folder, " is without the newest of ",
                                Counted(static_cast<int64_t>(left_out.size()), "map"),
                                " that could not be read, \"", left_out.front().map,
                                "\" first; the others are in it. Run dsg verify on the store, and "
                                "mend or remove what it names"),
                   {{"map", left_out.front().map}});
}

void TellSaved(const std::vector<Saved>& saved, const std::vector<LeftOut>& left_out,
               const std::string& folder, bool as_json, std::ostream& out) {
  nlohmann::ordered_json json = {{"folder", folder},
                                 {"maps", nlohmann::ordered_json::array()},
                                 {"left_out", nlohmann::ordered_json::array()}};
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
  for (const auto& [map, why] : left_out) {
    json["left_out"].push_back({{"map", map}, {"error", std::string(why.message())}});
    if (!as_json) out << map << ": left out: " << Printable(std::string(why.message())) << "\n";
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
  TellSaved(saved, backup.left_out(), verb.folder, common.json, out);
  return VerdictOn(backup.left_out(), verb.folder);
}

}  // namespace dsg::cli
