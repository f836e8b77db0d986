// SPDX-License-Identifier: Apache-2.0
// The verbs about files of a store: verify, upgrade. verify also checks archives and backups.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/cli/progress.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/archive/backup_folder.h"
#include "schema/archive/restore.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

struct VerifyVerb {
  /// An archive, or the folder of a backup; empty = the store.
  std::string path;
};

struct UpgradeVerb {};

// The map asked for, or all maps, also those that cannot be opened, by name.
absl::StatusOr<std::vector<std::string>> MapNames(GraphStore* store, const std::string& asked) {
  if (!asked.empty()) return std::vector<std::string>{asked};
  return store->MapNames();
}

VerifyReport DamageOf(const absl::Status& status) {
  VerifyReport damaged;
  damaged.problems.push_back(std::string(status.message()));
  return damaged;
}

absl::StatusOr<VerifyReport> VerifyMap(GraphStore* store, const std::string& name,
                                       const StopCheck& stop, std::ostream& progress_out) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, store->OpenMap(name));
  Progress progress(absl::StrCat("verify ", name), &progress_out);
  return map->Verify(stop, [&progress](double fraction) { progress.Update(fraction); });
}

// A map that is too damaged to be opened is a problem of that map; the others are still checked.
absl::StatusOr<VerifyReport> FindProblems(GraphStore* store, const std::string& name, bool is_asked,
                                          const StopCheck& stop, std::ostream& progress_out) {
  auto report = VerifyMap(store, name, stop, progress_out);
  const Reason reason = ReasonOf(report.status());
  const bool is_other_format = reason == Reason::kFormatTooNew || reason == Reason::kFormatTooOld;
  // A name that was given may be wrong.
  const bool is_damage = absl::IsDataLoss(report.status()) || (!is_asked && !is_other_format);
  if (report.ok() || absl::IsCancelled(report.status()) || !is_damage) return report;
  return DamageOf(report.status());
}

// The maps that were checked, and their problems.
class Findings {
 public:
  Findings(std::ostream* out, bool as_json) : out_(*out), as_json_(as_json) {}

  void Add(const std::string& name, const VerifyReport& report) {
    problem_count_ += static_cast<int64_t>(report.problems.size());
    json_["maps"].push_back({{"map", name},
                             {"revision_count", std::to_string(report.revision_count)},
                             {"row_count", std::to_string(report.row_count)},
                             {"pose_count", std::to_string(report.pose_count)},
                             {"problems", report.problems},
                             {"notes", report.notes}});
    if (as_json_) return;
    out_ << name << ": " << Counted(report.revision_count, "revision") << ", "
         << Counted(report.row_count, "row") << ", " << Counted(report.pose_count, "pose") << ", "
         << Counted(static_cast<int64_t>(report.problems.size()), "problem") << "\n";
    for (const std::string& problem : report.problems) out_ << "  " << Printable(problem) << "\n";
    for (const std::string& note : report.notes) out_ << "  note: " << Printable(note) << "\n";
  }

  /// A map that only another release can read.
  void AddOtherFormat(const std::string& name, const absl::Status& why) {
    if (other_format_.ok()) other_format_ = why;
    json_["maps"].push_back({{"map", name}, {"unchecked", std::string(why.message())}});
    if (!as_json_) {
      out_ << name << ": not checked: " << Printable(std::string(why.message())) << "\n";
    }
  }

  /// `what` has no maps.
  void AddNothing(const std::string& what) {
    if (!as_json_) out_ << what << " has no maps\n";
  }

  /// Call once, at the end.
  absl::Status Verdict(const std::string& where, const std::string& advice) const {
    if (as_json_)
      out_ << json_.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
    if (problem_count_ == 0) return other_format_;
    return MakeError(Reason::kStoreCorrupt,
                     absl::StrCat(where, " has ", Counted(problem_count_, "problem"), "; ", advice),
                     {{"problem_count", absl::StrCat(problem_count_)}});
  }

 private:
  std::ostream& out_;
  const bool as_json_;
  nlohmann::ordered_json json_ = {{"maps", nlohmann::ordered_json::array()}};
  int64_t problem_count_ = 0;
  absl::Status other_format_;
};

absl::Status AddArchive(const std::string& path, const std::string& name, const StopCheck& stop,
                        Findings* findings, std::ostream& progress_out) {
  Progress progress(absl::StrCat("verify ", name), &progress_out);
  const auto report =
      VerifyArchive(path, stop, [&progress](double fraction) { progress.Update(fraction); });
  if (!report.ok() && !absl::IsDataLoss(report.status())) return report.status();
  findings->Add(name, report.ok() ? *report : DamageOf(report.status()));
  return absl::OkStatus();
}

absl::Status VerifyFiles(const std::string& path, const CommonOptions& common,
                         const StopCheck& stop, std::ostream& out, std::ostream& progress_out) {
  Findings findings(&out, common.json);
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) {
    DSG_RETURN_IF_ERROR(AddArchive(path, path, stop, &findings, progress_out));
    return findings.Verdict(absl::StrCat("archive ", path), "copy it again");
  }
  DSG_ASSIGN_OR_RETURN(const BackupManifest backup, ReadBackupManifest(path));
  for (const BackupEntry& entry : backup.maps) {
    if (!common.map.empty() && entry.map != common.map) continue;
    const absl::Status intact = CheckBackupFile(path, entry, stop, nullptr);
    if (!intact.ok() && !absl::IsDataLoss(intact)) return intact;
    if (intact.ok()) {
      const std::string file = absl::StrCat(path, "/", entry.file);
      DSG_RETURN_IF_ERROR(AddArchive(file, entry.map, stop, &findings, progress_out));
    } else {
      findings.Add(entry.map, DamageOf(intact));
    }
  }
  if (backup.maps.empty()) findings.AddNothing(absl::StrCat("backup ", path));
  return findings.Verdict(absl::StrCat("backup ", path),
                          "copy it again, or back the maps up again");
}

absl::Status RunVerify(Session* session, const VerifyVerb& verb, std::ostream& out) {
  const CommonOptions& common = session->common();
  std::ostream& progress_out = session->notes();
  query::CallContext call;
  const InterruptGuard guard(&call);
  const StopCheck stop = call.stop();
  if (!verb.path.empty()) return VerifyFiles(verb.path, common, stop, out, progress_out);
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       OpenStore(common.store, {.program = "dsg verify"}));
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, MapNames(store.get(), common.map));
  Findings findings(&out, common.json);
  if (names.empty()) findings.AddNothing(absl::StrCat("store ", common.store));
  for (const std::string& name : names) {
    const auto report = FindProblems(store.get(), name, !common.map.empty(), stop, progress_out);
    if (report.ok()) {
      findings.Add(name, *report);
    } else if (common.map.empty() && absl::IsFailedPrecondition(report.status())) {
      findings.AddOtherFormat(name, report.status());
    } else {
      return report.status();
    }
  }
  return findings.Verdict(absl::StrCat("store ", common.store),
                          "restore the maps listed from a backup, or ingest their logs again into "
                          "a new store");
}

absl::Status RunUpgrade(Session* session, const UpgradeVerb&, std::ostream& out) {
  const CommonOptions& common = session->common();
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       OpenStore(common.store, {.program = "dsg upgrade"}));
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, MapNames(store.get(), common.map));
  if (names.empty() && !common.json) out << "store " << common.store << " has no maps\n";
  nlohmann::ordered_json json = {{"maps", nlohmann::ordered_json::array()}};
  for (const std::string& name : names) {
    DSG_ASSIGN_OR_RETURN(const UpgradeReport report, store->UpgradeMap(name));
    json["maps"].push_back({{"map", name},
                            {"from_format", report.from_format},
                            {"to_format", report.to_format},
                            {"copy", report.copy}});
    if (common.json) continue;
    out << name << ": ";
    if (report.copy.empty()) {
      out << "has format " << report.to_format << " already\n";
    } else {
      out << "format " << report.from_format << " to " << report.to_format << "; the old file is "
          << report.copy << ", delete it when you no longer need it\n";
    }
  }
  if (common.json)
    out << json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
  return absl::OkStatus();
}

absl::Status CheckVerify(const VerifyVerb& verb, const CommonOptions& common) {
  if (!verb.path.empty() || !common.store.empty()) return absl::OkStatus();
  return Usage("verify reads a store folder: give --store DIR", "verify");
}

absl::Status CheckUpgrade(const UpgradeVerb&, const CommonOptions& common) {
  if (!common.store.empty()) return absl::OkStatus();
  return Usage("upgrade works on a store folder: give --store DIR", "upgrade");
}

}  // namespace

void AddStoreVerbs(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<VerifyVerb>(
      {.name = "verify",
       .what = "Check every page, row and revision of a map, an archive or a backup",
       .example = "--store store --map office",
       .takes = kMapFilter | kJson,
       .opens = Opens::kNothing,
       .run = RunVerify,
       .check = CheckVerify});
  app->add_option("PATH", verb->path, "A .dsgz file, or the folder of a backup; default the store");
  grammar->Add<UpgradeVerb>({.name = "upgrade",
                             .what = "Bring maps to this program's store format",
                             .example = "--store store --map office",
                             .takes = kMap | kJson,
                             .opens = Opens::kNothing,
                             .run = RunUpgrade,
                             .check = CheckUpgrade});
}

}  // namespace dsg::cli
