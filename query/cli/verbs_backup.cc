// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verbs_backup.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/progress.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/archive_format.h"
#include "schema/archive/backup_folder.h"
#include "schema/archive/restore.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/node.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

struct BackupVerb {
  std::string folder;
};

// Zero for a map without revisions.
absl::StatusOr<Sha256> NewestDigest(Session* session, const std::string& map) {
  v1::ListRevisionsRequest request;
  request.set_map(map);
  request.set_page_size(1);
  v1::ListRevisionsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListRevisions(session->NewCall(), request, &reply));
  Sha256 digest{};
  if (reply.revisions().empty()) return digest;
  const std::string& bytes = reply.revisions(0).digest();
  if (bytes.size() == digest.size()) std::copy(bytes.begin(), bytes.end(), digest.begin());
  return digest;
}

absl::StatusOr<std::vector<Tag>> TagsOf(Session* session, const std::string& map) {
  v1::ListTagsRequest request;
  request.set_map(map);
  v1::ListTagsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListTags(session->NewCall(), request, &reply));
  std::vector<Tag> tags;
  for (const v1::Tag& tag : reply.tags()) {
    tags.push_back({tag.name(), tag.revision(), tag.created_ns(), tag.note()});
  }
  return tags;
}

// StateDigest of the map as it is now.
absl::StatusOr<Sha256> StateOfMap(Session* session, const std::string& map) {
  v1::GetMapStatsRequest request;
  request.set_map(map);
  v1::GetMapStatsResponse stats;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &stats));
  DSG_ASSIGN_OR_RETURN(const MapSpec spec, FromProto(stats.map()));
  DSG_ASSIGN_OR_RETURN(const Sha256 digest, NewestDigest(session, map));
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, TagsOf(session, map));
  return StateDigest(spec, stats.head_revision(), digest, stats.header().oldest_revision(), tags);
}

namespace fs = std::filesystem;

// A map that cannot be read; at most the last backup has it.
struct LeftOut {
  std::string map;
  absl::Status why;
};

// A map of the new backup.
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

// A backup inside the store would be taken for a map.
absl::Status CheckIsOutside(const std::string& folder, const std::string& store) {
  if (store.empty()) return absl::OkStatus();
  std::error_code error;
  const std::string out = fs::weakly_canonical(folder, error).string();
  const std::string in = fs::weakly_canonical(store, error).string();
  if (out != in && !absl::StartsWith(out, in + "/")) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("folder ", folder, " is inside the store ", store,
                                "; name a folder outside, if possible on another disk"),
                   {{"path", folder}});
}

// Includes maps that cannot be opened: the report must name them.
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

// Errors of one map, which do not stop the backup of the others. Other errors concern the disk, the
// connection or the caller.
bool IsErrorOfMap(const absl::Status& status) {
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
      } else if (session_->common().map.empty() && IsErrorOfMap(one.status())) {
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

// The error of a backup that lacks some maps.
absl::Status VerdictOn(const std::vector<LeftOut>& left_out, const std::string& folder) {
  if (left_out.empty()) return absl::OkStatus();
  const Reason reason = ReasonOf(left_out.front().why);
  return MakeError(reason == Reason::kUnspecified ? Reason::kStoreCorrupt : reason,
                   absl::StrCat("the backup in ", folder, " lacks the newest state of ",
                                Counted(static_cast<int64_t>(left_out.size()), "map"),
                                " that could not be read, first \"", left_out.front().map,
                                "\"; the others are in it. Run dsg verify on the store, and repair "
                                "or remove the maps that it names"),
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

absl::Status RunBackup(Session* session, const BackupVerb& verb, std::ostream& out) {
  const CommonOptions& common = session->common();
  DSG_RETURN_IF_ERROR(CheckIsOutside(verb.folder, common.store));
  DSG_ASSIGN_OR_RETURN(const auto folder, BackupFolder::Open(verb.folder));
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  Backup backup(session, folder.get(), verb.folder, &session->notes());
  DSG_ASSIGN_OR_RETURN(const std::vector<Saved> saved, backup.Run(call));
  TellSaved(saved, backup.left_out(), verb.folder, common.json, out);
  return VerdictOn(backup.left_out(), verb.folder);
}

// A map to restore.
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
    // Folders that do not exist yet, the deepest first.
    std::vector<fs::path> made;
    for (fs::path path = common_.store; !path.empty() && !fs::exists(path, error);
         path = path.parent_path()) {
      made.push_back(path);
    }
    const absl::Status status = RestoreAll();
    // Only empty folders are removed.
    if (!status.ok()) {
      for (const fs::path& path : made) fs::remove(path, error);
    }
    return status;
  }

  bool has_restored() const { return !restored_.empty(); }
  /// Includes the maps that were restored before an error.
  void Tell(std::ostream& out) const {
    nlohmann::ordered_json json = {{"maps", nlohmann::ordered_json::array()}};
    for (const auto& [name, manifest] : restored_) {
      json["maps"].push_back({{"map", name},
                              {"newest_revision", std::to_string(manifest.newest_revision)},
                              {"oldest_revision", std::to_string(manifest.oldest_revision)}});
      if (common_.json) continue;
      out << name << ": restored at revision " << manifest.newest_revision << ", readable from "
          << manifest.oldest_revision << " on";
      if (name != manifest.spec.name) out << "; its name in the archive is " << manifest.spec.name;
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
                                    "\"; its MANIFEST lists the maps"),
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
    return MakeError(
        Reason::kMapExists,
        absl::StrCat("map \"", name, "\" is in store ", common_.store,
                     " already; restore it under another name with --as, or replace it "
                     "with --force"),
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

absl::Status RunRestore(Session* session, const RestoreVerb& verb, std::ostream& out) {
  return Restore(session->common(), verb, out, session->notes());
}

absl::Status CheckRestore(const RestoreVerb&, const CommonOptions& common) {
  if (!common.store.empty()) return absl::OkStatus();
  return Usage("restore writes to a store folder: give --store DIR", "restore");
}

}  // namespace

absl::Status CopyArchive(Session* session, const std::string& map, const query::CallContext& call,
                         const std::function<absl::Status(std::string_view)>& write,
                         const dsg::Progress& progress) {
  v1::ReadArchiveRequest request;
  request.set_map(map);
  absl::Status written;
  DSG_RETURN_IF_ERROR(query::ReadStream(call, session->api().ReadArchive(call, request),
                                        [&](const v1::ReadArchiveResponse& message) {
                                          written = write(message.content());
                                          progress(message.progress());
                                          return written.ok();
                                        }));
  return written;
}

absl::Status Restore(const CommonOptions& common, const RestoreVerb& verb, std::ostream& out,
                     std::ostream& notes) {
  for (const std::string* name : {&verb.as, &common.map}) {
    if (!name->empty()) DSG_RETURN_IF_ERROR(CheckMapName(*name));
  }
  Restorer restorer(common, verb, &notes);
  const absl::Status status = restorer.Run();
  if (status.ok() || restorer.has_restored()) restorer.Tell(out);
  return status;
}

void AddBackupVerbs(Grammar* grammar) {
  const auto [backup_app, backup] =
      grammar->Add<BackupVerb>({.name = "backup",
                                .what = "Write archives of all maps, or of one, to a folder",
                                .example = "backup",
                                .takes = kServer | kMapFilter | kJson,
                                .opens = Opens::kPlace,
                                .run = RunBackup});
  backup_app->add_option("OUT", backup->folder, "The folder; a backup in it is updated")
      ->required();

  const auto [restore_app, restore] =
      grammar->Add<RestoreVerb>({.name = "restore",
                                 .what = "Put the maps of a backup into a store",
                                 .example = "backup --store elsewhere",
                                 .takes = kMapFilter | kJson,
                                 .opens = Opens::kNothing,
                                 .run = RunRestore,
                                 .check = CheckRestore});
  restore_app->add_option("PATH", restore->path, "Folder of a backup, or a .dsgz file")->required();
  restore_app->add_option("--as", restore->as, "Name of the map in the store");
  restore_app->add_flag("--force", restore->force, "Replace existing maps");
}

}  // namespace dsg::cli
