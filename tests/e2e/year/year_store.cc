// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/year/year_store.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/retention/batches.h"
#include "schema/retention/plan.h"
#include "tests/e2e/year/year_world.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

std::unique_ptr<GraphStore> OpenStore(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  return OrDie(GraphStore::Open(folder, options));
}

}  // namespace

YearStore::YearStore(const std::string& folder, std::vector<PrunePolicy> policies)
    : folder_(folder), policies_(std::move(policies)), store_(OpenStore(folder)) {
  MapSpec spec;
  spec.name = kMap;
  spec.epoch_ns = kYearEpochNs;
  OrDie(store_->CreateMap(spec));
  writer_ = OrDie(store_->OpenWriter(kMap));
  reader_ = OrDie(store_->OpenMap(kMap));
  core_ = query::MakeServiceCore(OpenStore(folder));
}

absl::Status YearStore::Commit(GraphDelta delta) {
  delta.map = kMap;
  return writer_->Commit(std::move(delta)).status();
}

absl::Status YearStore::Forget(int day) {
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, reader_->Head());
  day_ends_.push_back(head.revision);
  const std::vector<PrunePolicy> policies = PoliciesOf(day);
  if (policies.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> now, reader_->Latest());
  DSG_ASSIGN_OR_RETURN(PrunePlan plan, PlanPrune(reader_.get(), *now, policies, {}, {}));
  const std::optional<Revision> keep_from = plan.keep_from;
  const std::optional<Erasure> erasure = plan.erasure;
  PruneBatches batches(now, std::move(plan),
                       {.map = kMap,
                        .session_id = absl::StrCat("forget-", day),
                        .author = "year",
                        .message = "prune"});
  while (true) {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> latest, reader_->Latest());
    DSG_ASSIGN_OR_RETURN(std::optional<GraphDelta> delta, batches.Next(*latest, {}));
    if (!delta.has_value()) break;
    DSG_RETURN_IF_ERROR(writer_->Commit(*std::move(delta)).status());
  }
  if (erasure.has_value()) DSG_RETURN_IF_ERROR(writer_->Erase(*erasure, {}, {}).status());
  if (!keep_from.has_value()) return absl::OkStatus();
  return writer_->Compact(*keep_from, {}, {}).status();
}

std::vector<PrunePolicy> YearStore::PoliciesOf(int day) const {
  std::vector<PrunePolicy> policies = policies_;
  std::erase_if(policies, [&](PrunePolicy& policy) {
    const auto* history = std::get_if<PrunePolicy::HistoryOlderThan>(&policy.what);
    if (history == nullptr) return false;
    const int64_t kept_from = day - history->age_ns / kDayNs;
    if (kept_from < 0) return true;
    policy.what = PrunePolicy::HistoryBefore{day_ends_[static_cast<size_t>(kept_from)]};
    return false;
  });
  return policies;
}

absl::Status YearStore::CopyTo(const std::string& folder) const {
  std::error_code error;
  std::filesystem::copy(folder_, folder, std::filesystem::copy_options::recursive, error);
  if (!error) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("cannot copy ", folder_, ": ", error.message()));
}

int64_t YearStore::FileBytes() const {
  int64_t bytes = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(absl::StrCat(folder_, "/", std::string(kMap)))) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("graph.db", 0) == 0 && !name.ends_with("-shm")) {
      bytes += static_cast<int64_t>(entry.file_size());
    }
  }
  return bytes;
}

absl::StatusOr<int64_t> YearStore::PoseCount() const {
  DSG_ASSIGN_OR_RETURN(const auto snapshot, reader_->Latest());
  DSG_ASSIGN_OR_RETURN(const MapStats stats, snapshot->Stats());
  return stats.at.pose_count;
}

absl::StatusOr<VerifyReport> YearStore::Verify() const {
  DSG_ASSIGN_OR_RETURN(const auto map, store_->OpenMap(kMap));
  return map->Verify({}, {});
}

}  // namespace dsg::test
