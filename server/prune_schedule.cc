// SPDX-License-Identifier: Apache-2.0
#include "server/prune_schedule.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/maintenance/prune_convert.h"
#include "schema/base/log.h"
#include "schema/base/status.h"

namespace dsg::server {
namespace {

class SteadyClock final : public ScheduleClock {
 public:
  TimePoint Now() override { return std::chrono::steady_clock::now(); }

  bool WaitUntil(TimePoint until) override {
    std::unique_lock lock(mutex_);
    return !changed_.wait_until(lock, until, [this] { return is_interrupted_; });
  }

  void Interrupt() override {
    {
      const std::lock_guard lock(mutex_);
      is_interrupted_ = true;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_interrupted_ = false;
};

std::string RowsOf(const v1::Amount& amount) {
  return absl::StrCat(amount.node_count() + amount.edge_count() + amount.pose_count() +
                      amount.shape_count() + amount.factor_count() + amount.stay_count() +
                      amount.mesh_block_count());
}

}  // namespace

std::unique_ptr<ScheduleClock> MakeScheduleClock() { return std::make_unique<SteadyClock>(); }

PruneSchedule::PruneSchedule(query::ServiceCore* core, PolicyFile file,
                             const PruneScheduleOptions& options,
                             std::unique_ptr<ScheduleClock> clock)
    : core_(core), file_(std::move(file)), options_(options), clock_(std::move(clock)) {}

PruneSchedule::~PruneSchedule() = default;

void PruneSchedule::Stop() {
  call_.Cancel();
  clock_->Interrupt();
}

void PruneSchedule::Run() {
  const auto every = std::chrono::nanoseconds(file_.every_ns);
  auto due = clock_->Now() + options_.first_after;
  while (clock_->WaitUntil(due)) {
    RunOnce();
    due = std::max(due + every, clock_->Now());
  }
}

void PruneSchedule::RunOnce() {
  v1::ListMapsResponse maps;
  const absl::Status listed = core_->ListMaps(call_, v1::ListMapsRequest(), &maps);
  if (!listed.ok()) {
    Log(LogLevel::kError, "policies not applied", {{"error", std::string(listed.message())}});
    return;
  }
  std::vector<std::string> names;
  for (const auto& map : maps.maps()) names.push_back(map.name());
  for (const std::string& name : names) {
    if (call_.cancelled()) return;
    RunMap(name);
  }
}

void PruneSchedule::RunMap(const std::string& map) {
  const absl::Status status = PruneMap(map, file_.policies);
  if (call_.cancelled()) return;
  if (ReasonOf(status) == Reason::kPolicyTakesTooMuch) {
    Log(LogLevel::kError, "policies not applied to map: they would take too much",
        {{"map", map}, {"error", std::string(status.message())}});
    return;
  }
  const bool are_alone = !status.ok() && file_.policies.size() > 1;
  // A policy that cannot be applied must not stop the others.
  for (const PrunePolicy& policy : file_.policies) {
    absl::Status result = are_alone ? PruneMap(map, {policy}) : status;
    if (call_.cancelled()) return;
    // When applied together with others, a policy for a removed branch matches nothing.
    if (are_alone && ReasonOf(result) == Reason::kNodeUnknown) result = absl::OkStatus();
    Report(map, policy, result);
  }
}

void PruneSchedule::Report(const std::string& map, const PrunePolicy& policy,
                           const absl::Status& status) {
  const auto [at, is_new] = told_.try_emplace({map, policy.name}, absl::OkStatus());
  const bool is_told = !is_new && !status.ok() && status.code() == at->second.code() &&
                       ReasonOf(status) == ReasonOf(at->second);
  at->second = status;
  if (status.ok() || is_told) return;
  Log(LogLevel::kWarning, "policy not applied to map",
      {{"map", map}, {"policy", policy.name}, {"error", std::string(status.message())}});
}

absl::Status PruneSchedule::PruneMap(const std::string& map,
                                     const std::vector<PrunePolicy>& policies) {
  v1::PruneRequest request;
  request.set_map(map);
  request.set_author("dsg-server policies");
  request.set_share_max(file_.share_max.value_or(kShareMaxDefault));
  for (const PrunePolicy& policy : policies) query::ToProto(policy, request.add_policies());
  DSG_ASSIGN_OR_RETURN(const auto cursor, core_->Prune(call_, request));
  v1::PruneResponse all;
  do {
    v1::PruneResponse message;
    DSG_RETURN_IF_ERROR(cursor->Next(call_, &message).status());
    all.MergeFrom(message);
    if (cursor->done()) break;
  } while (clock_->WaitUntil(clock_->Now() + options_.pause));
  if (!cursor->done()) return absl::OkStatus();
  for (const v1::PolicyReport& policy : all.policies()) {
    Log(LogLevel::kInfo, "policy applied",
        {{"map", map},
         {"policy", policy.name()},
         {"rows", RowsOf(policy.matched())},
         {"revisions", absl::StrCat(policy.matched().revision_count())},
         {"bytes", absl::StrCat(policy.matched().byte_count())}});
  }
  for (const std::string& note : all.notes()) {
    Log(LogLevel::kWarning, "clocks of the map disagree", {{"map", map}, {"note", note}});
  }
  if (all.left_count() > 0) {
    Log(LogLevel::kWarning,
        "erasure incomplete: other clients kept writing the data; the next run tries again",
        {{"map", map}, {"left", absl::StrCat(all.left_count())}, {"first", all.left_ids(0)}});
  }
  Log(LogLevel::kInfo, "policies applied to map",
      {{"map", map},
       {"revision", absl::StrCat(all.revision())},
       {"file_bytes_before", absl::StrCat(all.file_bytes_before())},
       {"file_bytes_after", absl::StrCat(all.file_bytes_after())}});
  return absl::OkStatus();
}

}  // namespace dsg::server
