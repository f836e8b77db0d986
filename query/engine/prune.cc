// SPDX-License-Identifier: Apache-2.0
#include "query/engine/prune.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/compact.h"
#include "query/engine/prune_convert.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/retention/batches.h"
#include "schema/retention/plan.h"
#include "schema/store/log_bytes.h"

namespace dsg::query {
namespace {

constexpr int kPolicyCountMax = 100;
// How long commits to the map wait for a slice of erasing, about; it doubles up to the second
// number, for a step that takes longer than a slice would never end.
constexpr std::chrono::milliseconds kEraseSlice{500};
constexpr std::chrono::milliseconds kEraseSliceMax{60'000};
// Shares of the whole work, for the progress.
constexpr double kPlanned = 0.05;
constexpr double kCommitted = 0.6;
constexpr double kErased = 0.8;

// Deltas are known by session and sequence, so each prune needs a session of its own.
std::string NewSessionId() {
  static std::atomic<int64_t> count{0};
  return absl::StrCat("prune-", WallClockNs(), "-", getpid(), "-", ++count);
}

std::string MessageOf(const std::vector<PrunePolicy>& policies) {
  constexpr size_t kNamed = 3;
  std::string message = "prune";
  for (size_t i = 0; i < std::min(policies.size(), kNamed); ++i) {
    absl::StrAppend(&message, i == 0 ? " " : "; ", policies[i].name);
  }
  if (policies.size() > kNamed) {
    absl::StrAppend(&message, " and ", policies.size() - kNamed, " more");
  }
  return message;
}

struct OpenedMap {
  std::shared_ptr<MapReader> reader;
  std::shared_ptr<const Snapshot> map;
};

absl::StatusOr<OpenedMap> OpenNewest(MapTable* maps, const std::string& name) {
  OpenedMap opened;
  DSG_ASSIGN_OR_RETURN(opened.reader, maps->Reader(name));
  DSG_ASSIGN_OR_RETURN(opened.map, opened.reader->Latest());
  return opened;
}

// A reader notices that its past was rewritten, by an erasure just before, only when it reads; then
// the map is opened anew.
absl::Status WithoutOldReaders(const std::function<absl::Status()>& work) {
  constexpr int kTries = 3;
  absl::Status status;
  for (int i = 0; i < kTries; ++i) {
    status = work();
    if (ReasonOf(status) != Reason::kMapReplaced) return status;
  }
  return status;
}

class Prune final : public PruneCursor {
 public:
  Prune(MapTable* maps, const v1::PruneRequest& request, std::vector<PrunePolicy> policies)
      : maps_(maps),
        map_(request.map()),
        is_dry_run_(request.dry_run()),
        allow_everything_(request.allow_everything()),
        author_(request.author()),
        policies_(std::move(policies)) {}

  absl::Status Next(const CallContext& call, v1::PruneResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    switch (phase_) {
      case Phase::kPlan:
        DSG_RETURN_IF_ERROR(WithoutOldReaders([&] { return Plan(call, reply); }));
        break;
      case Phase::kCommit:
        DSG_RETURN_IF_ERROR(CommitBatch(call));
        break;
      case Phase::kErase:
        DSG_RETURN_IF_ERROR(EraseSlice(call));
        break;
      case Phase::kCompact:
        DSG_RETURN_IF_ERROR(CompactSlice(call));
        break;
      case Phase::kEnd:
        break;
    }
    if (phase_ == Phase::kEnd) {
      DSG_RETURN_IF_ERROR(WithoutOldReaders([&] { return End(call, reply); }));
    }
    reply->set_progress(progress_);
    reply->set_revision(revision_);
    reply->set_done(is_done_);
    return absl::OkStatus();
  }

  bool done() const override { return is_done_; }

 private:
  enum class Phase { kPlan, kCommit, kErase, kCompact, kEnd };

  absl::Status Plan(const CallContext& call, v1::PruneResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
    const auto& [reader, map] = opened;
    auto planned =
        PlanPrune(reader.get(), *map, policies_, {.wall_now_ns = WallClockNs()}, call.stop());
    if (!planned.ok()) return EndErasure(call, opened, planned.status(), reply);
    PrunePlan& plan = *planned;
    if (!is_dry_run_ && !allow_everything_ && !plan.all_matching_policy.empty()) {
      return MakeError(
          Reason::kPolicyMatchesAll,
          absl::StrCat("map \"", map_, "\": ", plan.all_matching_policy,
                       " matches every node, every pose or the only building; nothing was "
                       "forgotten. Narrow it, or say that everything may go"),
          {{"map", map_}, {"policy", plan.all_matching_policy}});
    }
    DSG_ASSIGN_OR_RETURN(before_, CountMap(*map, call.stop()));
    DSG_ASSIGN_OR_RETURN(const MapStats stats, map->Stats());
    before_.revision_count = stats.at.revision;
    file_bytes_before_ = stats.bytes_on_disk;
    log_bytes_before_ = LogBytesOnDisk(maps_->store(), map_);
    reply->clear_policies();
    for (const PolicyMatch& match : plan.policies) {
      v1::PolicyReport* const report = reply->add_policies();
      report->set_name(match.name);
      ToProto(match.matched, report->mutable_matched());
    }
    ToProto(before_, reply->mutable_map_before());
    DSG_RETURN_IF_ERROR(FillHeader(reader.get(), *map, reply));
    has_changes_ = !plan.IsEmpty();
    seen_ = plan.revision;
    // Nothing to compact is no reason to take the writer's lock.
    if (plan.total.revision_count > 0) keep_from_ = plan.keep_from;
    erasure_ = std::move(plan.erasure);
    plan.erasure.reset();
    progress_ = kPlanned;
    const bool has_work = has_changes_ || erasure_.has_value() || keep_from_.has_value();
    phase_ = is_dry_run_ || !has_work ? Phase::kEnd : Phase::kCommit;
    batches_.emplace(map, std::move(plan),
                     BatchHeader{map_, NewSessionId(), author_, MessageOf(policies_)});
    return absl::OkStatus();
  }

  // Of a branch that is wholly erased no revision knows any more. If that was done by a call that
  // was cut off, what it left in the file is still to be overwritten.
  absl::Status EndErasure(const CallContext& call, const OpenedMap& opened,
                          const absl::Status& failure, v1::PruneResponse* reply) {
    const bool may_be_erased = ReasonOf(failure) == Reason::kNodeUnknown && !is_dry_run_ &&
                               policies_.size() == 1 &&
                               policies_.front().strength == PruneStrength::kErase;
    if (!may_be_erased) return failure;
    DSG_RETURN_IF_ERROR(
        maps_->WithWriter(map_, call.stop(), [&](MapWriter& writer) -> absl::Status {
          DSG_ASSIGN_OR_RETURN(const EraseReport report, writer.Erase({}, call.stop(), {}));
          is_clean_ = report.is_clean;
          return report.was_pending ? absl::OkStatus() : failure;
        }));
    maps_->archives().EndOf(map_);
    DSG_ASSIGN_OR_RETURN(before_, CountMap(*opened.map, call.stop()));
    reply->clear_policies();
    reply->add_policies()->set_name(policies_.front().name);
    ToProto(before_, reply->mutable_map_before());
    erasure_.emplace();
    phase_ = Phase::kEnd;
    return absl::OkStatus();
  }

  static absl::Status FillHeader(MapReader* reader, const Snapshot& map, v1::PruneResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const Revision oldest, reader->OldestRevision());
    reply->mutable_header()->set_read_revision(map.revision());
    reply->mutable_header()->set_head_revision(map.revision());
    reply->mutable_header()->set_oldest_revision(oldest);
    return absl::OkStatus();
  }

  absl::Status CommitBatch(const CallContext& call) {
    bool is_over = false;
    DSG_RETURN_IF_ERROR(
        maps_->WithWriter(map_, call.stop(), [&](MapWriter& writer) -> absl::Status {
          DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
          const auto& [reader, head] = opened;
          if (head->revision() > seen_) {
            DSG_ASSIGN_OR_RETURN(const Touched touched,
                                 reader->TouchedBetween(seen_, head->revision(), call.stop()));
            batches_->Avoid(touched);
            seen_ = head->revision();
          }
          DSG_ASSIGN_OR_RETURN(std::optional<GraphDelta> delta, batches_->Next(*head, call.stop()));
          is_over = !delta.has_value();
          if (is_over) return absl::OkStatus();
          DSG_ASSIGN_OR_RETURN(const CommitResult result, writer.Commit(*std::move(delta)));
          revision_ = seen_ = result.revision;
          return absl::OkStatus();
        }));
    progress_ = kPlanned + (kCommitted - kPlanned) * batches_->progress();
    if (!is_over) return absl::OkStatus();
    // Nothing may hold on to the past that is to be wiped out.
    batches_.reset();
    progress_ = kCommitted;
    return AfterCommit(call);
  }

  absl::Status AfterCommit(const CallContext& call) {
    if (erasure_.has_value()) {
      phase_ = Phase::kErase;
      return LeaveOutWhatIsThere(call);
    }
    return AfterErase();
  }

  absl::Status AfterErase() {
    if (!keep_from_.has_value()) {
      phase_ = Phase::kEnd;
      return absl::OkStatus();
    }
    v1::CompactRequest request;
    request.set_map(map_);
    request.set_keep_from_revision(*keep_from_);
    DSG_ASSIGN_OR_RETURN(compaction_, OpenCompact(maps_, request));
    phase_ = Phase::kCompact;
    return absl::OkStatus();
  }

  // What others wrote again meanwhile is no more to be forgotten.
  absl::Status LeaveOutWhatIsThere(const CallContext& call) {
    DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
    DSG_ASSIGN_OR_RETURN(const auto nodes, opened.map->FindNodes(erasure_->nodes, call.stop()));
    std::vector<NodeId> gone;
    for (size_t i = 0; i < nodes.size(); ++i) {
      if (!nodes[i].has_value()) gone.push_back(erasure_->nodes[i]);
    }
    erasure_->nodes = std::move(gone);
    return absl::OkStatus();
  }

  absl::Status EraseSlice(const CallContext& call) {
    const auto slice_end = CallContext::Clock::now() + erase_slice_;
    erase_slice_ = std::min<std::chrono::milliseconds>(2 * erase_slice_, kEraseSliceMax);
    bool slice_is_over = false;
    const StopCheck stop = [&]() -> absl::Status {
      DSG_RETURN_IF_ERROR(call.Check());
      slice_is_over = CallContext::Clock::now() >= slice_end;
      return slice_is_over ? absl::CancelledError("commits go first") : absl::OkStatus();
    };
    double fraction = 0.0;
    const auto tell = [&](double done) { fraction = done; };
    bool is_over = false;
    // A copy that is being made keeps the log from being cut.
    maps_->archives().EndOf(map_);
    const absl::Status status =
        maps_->WithWriter(map_, call.stop(), [&](MapWriter& writer) -> absl::Status {
          DSG_ASSIGN_OR_RETURN(const EraseReport report, writer.Erase(*erasure_, stop, tell));
          is_clean_ = report.is_clean;
          is_over = true;
          return absl::OkStatus();
        });
    progress_ = std::max(progress_, kCommitted + (kErased - kCommitted) * fraction);
    if (!status.ok()) {
      return slice_is_over && absl::IsCancelled(status) ? absl::OkStatus() : status;
    }
    if (!is_over) return absl::OkStatus();
    // Those that began meanwhile hold the bytes, too.
    maps_->archives().EndOf(map_);
    return AfterErase();
  }

  absl::Status CompactSlice(const CallContext& call) {
    v1::CompactResponse slice;
    DSG_RETURN_IF_ERROR(compaction_->Next(call, &slice));
    progress_ = std::max(progress_, kErased + (1.0 - kErased) * slice.progress());
    if (compaction_->done()) phase_ = Phase::kEnd;
    return absl::OkStatus();
  }

  absl::Status End(const CallContext& call, v1::PruneResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
    const auto& [reader, map] = opened;
    DSG_ASSIGN_OR_RETURN(const MapStats stats, map->Stats());
    Amount after = before_;
    if (!is_dry_run_ && has_changes_) {
      DSG_ASSIGN_OR_RETURN(after, CountMap(*map, call.stop()));
    }
    after.revision_count = stats.at.revision;
    ToProto(after, reply->mutable_map_after());
    reply->set_file_bytes_before(file_bytes_before_);
    reply->set_file_bytes_after(stats.bytes_on_disk);
    reply->set_log_bytes_before(log_bytes_before_);
    reply->set_log_bytes_after(LogBytesOnDisk(maps_->store(), map_));
    reply->set_erased(erasure_.has_value() && !is_dry_run_ && is_clean_);
    DSG_RETURN_IF_ERROR(FillHeader(reader.get(), *map, reply));
    progress_ = 1.0;
    is_done_ = true;
    return absl::OkStatus();
  }

  MapTable* const maps_;
  const std::string map_;
  const bool is_dry_run_;
  const bool allow_everything_;
  const std::string author_;
  const std::vector<PrunePolicy> policies_;
  Phase phase_ = Phase::kPlan;
  std::optional<PruneBatches> batches_;
  std::optional<Erasure> erasure_;
  std::optional<Revision> keep_from_;
  std::unique_ptr<CompactCursor> compaction_;
  std::chrono::milliseconds erase_slice_ = kEraseSlice;
  Amount before_;
  int64_t file_bytes_before_ = 0;
  int64_t log_bytes_before_ = 0;
  bool has_changes_ = false;
  bool is_clean_ = false;
  // The newest revision that the plan was compared with, or that it wrote.
  Revision seen_ = 0;
  Revision revision_ = 0;
  double progress_ = 0.0;
  bool is_done_ = false;
};

}  // namespace

absl::StatusOr<std::unique_ptr<PruneCursor>> OpenPrune(MapTable* maps,
                                                       const v1::PruneRequest& request) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, maps->Reader(request.map()));
  if (request.policies().empty() || request.policies_size() > kPolicyCountMax) {
    return FieldError("policies", absl::StrCat(request.policies_size()),
                      absl::StrCat("give 1 to ", kPolicyCountMax, " policies"));
  }
  std::vector<PrunePolicy> policies;
  for (const v1::PrunePolicy& policy : request.policies()) {
    DSG_ASSIGN_OR_RETURN(PrunePolicy made, FromProto(policy, map->spec()));
    policies.push_back(std::move(made));
  }
  return std::make_unique<Prune>(maps, request, std::move(policies));
}

}  // namespace dsg::query
