// SPDX-License-Identifier: Apache-2.0
// The verb verify: every page, row and revision of one map, or of all maps of a store.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/cli/map_names.h"
#include "query/cli/progress.h"
#include "query/cli/table.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

absl::StatusOr<VerifyReport> VerifyMap(GraphStore* store, const std::string& name,
                                       std::ostream& progress_out) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, store->OpenMap(name));
  Progress progress(absl::StrCat("verify ", name), &progress_out);
  return map->Verify([&progress](double fraction) { progress.Update(fraction); });
}

// A map that is too damaged to be read is a finding about it, and the others are still checked.
absl::StatusOr<VerifyReport> FindProblems(GraphStore* store, const std::string& name,
                                          std::ostream& progress_out) {
  auto report = VerifyMap(store, name, progress_out);
  if (!absl::IsDataLoss(report.status())) return report;
  VerifyReport damaged;
  damaged.problems.push_back(std::string(report.status().message()));
  return damaged;
}

}  // namespace

absl::Status RunVerify(const CommonOptions& common, std::ostream& out, std::ostream& progress_out) {
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       GraphStore::Open(common.store, {.program = "dsg verify"}));
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, MapNames(store.get(), common.map));
  size_t problem_count = 0;
  if (names.empty()) out << "store " << common.store << " has no maps\n";
  for (const std::string& name : names) {
    DSG_ASSIGN_OR_RETURN(const VerifyReport report, FindProblems(store.get(), name, progress_out));
    out << name << ": " << Counted(report.revision_count, "revision") << ", "
        << Counted(report.row_count, "row") << ", " << Counted(report.pose_count, "pose") << ", "
        << Counted(static_cast<int64_t>(report.problems.size()), "problem") << "\n";
    for (const std::string& problem : report.problems) out << "  " << Printable(problem) << "\n";
    problem_count += report.problems.size();
  }
  if (problem_count == 0) return absl::OkStatus();
  return MakeError(Reason::kStoreCorrupt,
                   absl::StrCat("store ", common.store, " has ",
                                Counted(static_cast<int64_t>(problem_count), "problem"),
                                "; restore the maps listed from a backup, or ingest "
                                "their logs again into a new store"),
                   {{"problem_count", absl::StrCat(problem_count)}});
}

}  // namespace dsg::cli
