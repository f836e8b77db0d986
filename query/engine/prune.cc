// SPDX-License-Identifier: Apache-2.0
// Forgetting by policy, a batch a message.
// Refuses to forget all of a map unless it is told that it may.
#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/commit.h"
#include "query/engine/compact.h"
#include "query/engine/engine.h"
#include "query/engine/engine_cursor.h"
#include "query/engine/prune_convert.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/retention/batches.h"
#include "schema/retention/past.h"
#include "schema/retention/plan.h"

namespace dsg::query {
namespace {

constexpr int kPolicyCountMax = 100;
// How long commits to the map wait for a slice of erasing, about; it doubles up to the second
// number, for a step that takes longer than a slice would never end.
constexpr std::chrono::milliseconds kEraseSlice{500};
constexpr std::chrono::milliseconds kEraseSliceMax{60'000};
// How often what others wrote meanwhile is planned again, when all of it is to be erased.
constexpr int kRoundsMax = 4;
// Of what is left, so many are named.
constexpr size_t kNamedMax = 20;
// Shares of the whole work, for the progress.
constexpr double kPlanned = 0.05;
constexpr double kCommitted = 0.6;
constexpr double kErased = 0.8;

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

class Pruning final : public EngineCursor<v1::PruneResponse> {
 public:
  Pruning(MapTable* maps, const v1::PruneRequest& request, std::vector<PrunePolicy> policies)
      : maps_(maps),
        map_(request.map()),
        is_dry_run_(request.dry_run()),
        allow_everything_(request.allow_everything()),
        share_max_(request.share_max()),
        author_(request.author()),
        policies_(std::move(policies)) {}

  bool done() const override { return is_done_; }

 private:
  absl::Status Fill(const CallContext& call, v1::PruneResponse* reply) override {
    switch (phase_) {
      case Phase::kPlan:
        DSG_RETURN_IF_ERROR(WithoutOldReaders([&] { return Plan(call, reply); }));
        break;
      case Phase::kPlanAgain:
        DSG_RETURN_IF_ERROR(WithoutOldReaders([&] { return PlanAgain(call); }));
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

  enum class Phase { kPlan, kPlanAgain, kCommit, kErase, kCompact, kEnd };

  absl::Status Plan(const CallContext& call, v1::PruneResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
    const auto& [reader, map] = opened;
    auto planned =
        PlanPrune(reader.get(), *map, policies_, {.wall_now_ns = WallClockNs()}, call.stop());
    if (!planned.ok()) return EndErasure(call, opened, planned.status(), reply);
    PrunePlan& plan = *planned;
    const absl::Status refusal = RefusalOf(plan);
    if (!is_dry_run_) DSG_RETURN_IF_ERROR(refusal);
    DSG_RETURN_IF_ERROR(FillBefore(call, opened, reply));
    FillDoubts(plan, refusal, reply);
    for (const PolicyMatch& match : plan.policies) {
      v1::PolicyReport* const report = reply->add_policies();
      report->set_name(match.name);
      ToProto(match.matched, report->mutable_matched());
    }
    has_changes_ = !plan.IsEmpty();
    // Nothing to compact is no reason to take the writer's lock.
    if (plan.total.revision_count > 0) keep_from_ = plan.keep_from;
    DSG_RETURN_IF_ERROR(TakeErasure(opened, &plan));
    progress_ = kPlanned;
    const bool has_work = has_changes_ || erasure_.has_value() || keep_from_.has_value();
    phase_ = is_dry_run_ || !has_work ? Phase::kEnd : Phase::kCommit;
    BeginRound(map, std::move(plan));
    return absl::OkStatus();
  }

  absl::Status RefusalOf(const PrunePlan& plan) const {
    if (!allow_everything_ && !plan.all_matching_policy.empty()) {
      return MakeError(
          Reason::kPolicyMatchesAll,
          absl::StrCat("map \"", map_, "\": ", plan.all_matching_policy,
                       " matches every node, every pose or the only building; nothing was "
                       "forgotten. Narrow it, or say that everything may go"),
          {{"map", map_}, {"policy", plan.all_matching_policy}});
    }
    if (share_max_ == 0.0 || plan.share <= share_max_) return absl::OkStatus();
    return MakeError(
        Reason::kPolicyTakesTooMuch,
        absl::StrCat("map \"", map_, "\": ", plan.share_policy, " takes ", plan.share,
                     " of the nodes or of the poses, more than the share of ", share_max_,
                     " that may go; nothing was forgotten. Look with a dry run whether the clocks "
                     "of agents are right, narrow it, or allow a larger share"),
        {{"map", map_},
         {"policy", plan.share_policy},
         {"share", absl::StrCat(plan.share)},
         {"share_max", absl::StrCat(share_max_)}});
  }

  static void FillDoubts(const PrunePlan& plan, const absl::Status& refusal,
                         v1::PruneResponse* reply) {
    reply->set_refusal(std::string(refusal.message()));
    reply->clear_implausible_ids();
    reply->clear_notes();
    for (const NodeId id : plan.implausible_agents) reply->add_implausible_ids(ToString(id));
    for (const std::string& note : plan.notes) reply->add_notes(note);
  }

  // Nor is nothing to erase a reason to end the archives that are being read.
  absl::Status TakeErasure(const OpenedMap& opened, PrunePlan* plan) {
    std::optional<Erasure> erasure;
    erasure.swap(plan->erasure);
    if (!erasure.has_value()) return absl::OkStatus();
    is_erase_ = true;
    DSG_ASSIGN_OR_RETURN(const auto pending, opened.reader->GetPendingErasure());
    is_clean_ = IsEmpty(*erasure) && !has_changes_ && !pending.has_value();
    if (!is_clean_) erasure_ = std::move(erasure);
    return absl::OkStatus();
  }

  // Of a branch that is wholly gone no revision knows any more. If it was erased by a call that was
  // cut off, the map knows what that left.
  absl::Status EndErasure(const CallContext& call, const OpenedMap& opened,
                          const absl::Status& failure, v1::PruneResponse* reply) {
    const bool may_be_erased = ReasonOf(failure) == Reason::kNodeUnknown && !is_dry_run_ &&
                               policies_.size() == 1 &&
                               policies_.front().strength == PruneStrength::kErase;
    if (!may_be_erased) return failure;
    DSG_ASSIGN_OR_RETURN(const auto pending, opened.reader->GetPendingErasure());
    if (!pending.has_value()) return failure;
    DSG_RETURN_IF_ERROR(FillBefore(call, opened, reply));
    reply->add_policies()->set_name(policies_.front().name);
    is_erase_ = true;
    erasure_.emplace();
    progress_ = kCommitted;
    phase_ = Phase::kErase;
    return absl::OkStatus();
  }

  absl::Status FillBefore(const CallContext& call, const OpenedMap& opened,
                          v1::PruneResponse* reply) {
    const auto& [reader, map] = opened;
    DSG_ASSIGN_OR_RETURN(before_, CountMap(*map, call.stop()));
    DSG_ASSIGN_OR_RETURN(const MapStats stats, map->Stats());
    before_.revision_count = stats.at.revision;
    file_bytes_before_ = stats.bytes_on_disk;
    log_bytes_before_ = maps_->store().ReusedBytesOnDisk(map_);
    reply->clear_policies();
    ToProto(before_, reply->mutable_map_before());
    return FillHeader(reader.get(), *map, reply);
  }

  void BeginRound(const std::shared_ptr<const Snapshot>& map, PrunePlan plan) {
    seen_ = plan.revision;
    others_ = {};
    is_noted_ = false;
    batches_.emplace(map, std::move(plan),
                     BatchHeader{map_, NewSessionId("prune"), author_, MessageOf(policies_)});
  }

  // What others wrote of agents, tracks and meshes would else be left for good. Other nodes keep
  // what was written of them.
  absl::Status PlanAgain(const CallContext& call) {
    ++round_;
    phase_ = Phase::kErase;
    DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
    auto planned = PlanPrune(opened.reader.get(), *opened.map, policies_,
                             {.wall_now_ns = WallClockNs()}, call.stop());
    if (ReasonOf(planned.status()) == Reason::kNodeUnknown) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(planned.status());
    // That so much may go was not said; then what is contested is left, and told.
    if (!RefusalOf(*planned).ok()) return absl::OkStatus();
    if (planned->erasure.has_value()) Join(*planned->erasure, &*erasure_);
    planned->erasure.reset();
    const std::vector<NodeId> rewritten(rewritten_.begin(), rewritten_.end());
    DSG_ASSIGN_OR_RETURN(const auto nodes, opened.map->FindNodes(rewritten, call.stop()));
    Touched kept;
    for (const auto& node : nodes) {
      if (node.has_value() && !IsAgentKind(node->kind)) kept.nodes.push_back(node->id);
    }
    has_changes_ = has_changes_ || !planned->IsEmpty();
    BeginRound(opened.map, *std::move(planned));
    batches_->Avoid(kept);
    phase_ = Phase::kCommit;
    return absl::OkStatus();
  }

  static absl::Status FillHeader(MapReader* reader, const Snapshot& map, v1::PruneResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const Revision oldest, reader->OldestRevision());
    reply->mutable_header()->set_read_revision(map.revision());
    reply->mutable_header()->set_head_revision(map.revision());
    reply->mutable_header()->set_oldest_revision(oldest);
    reply->mutable_header()->set_incarnation(reader->incarnation());
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
            if (erasure_.has_value()) others_.Add(touched);
            seen_ = head->revision();
          }
          DSG_ASSIGN_OR_RETURN(std::optional<GraphDelta> delta, batches_->Next(*head, call.stop()));
          is_over = !delta.has_value();
          if (is_over) return absl::OkStatus();
          // A call that ends between here and the erasing has begun something that is to be ended.
          if (erasure_.has_value() && !is_noted_) {
            absl::Status noted = writer.NoteErasure(*erasure_, batches_->plan().revision);
            if (!noted.ok()) return noted;
            is_noted_ = true;
          }
          DSG_ASSIGN_OR_RETURN(const CommitResult result, writer.Commit(*std::move(delta)));
          revision_ = seen_ = result.revision;
          return absl::OkStatus();
        }));
    progress_ = std::max(progress_, kPlanned + (kCommitted - kPlanned) * batches_->progress());
    if (!is_over) return absl::OkStatus();
    progress_ = kCommitted;
    return AfterCommit();
  }

  absl::Status AfterCommit() {
    if (erasure_.has_value()) {
      left_ = others_.FindContested(batches_->plan(), *erasure_);
      rewritten_.insert(others_.nodes().begin(), others_.nodes().end());
      phase_ = left_.empty() || round_ >= kRoundsMax ? Phase::kErase : Phase::kPlanAgain;
    }
    // Nothing may hold on to the past that is to be wiped out.
    batches_.reset();
    return erasure_.has_value() ? absl::OkStatus() : AfterErase();
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

  // Of the nodes to erase those that are there now: others wrote them meanwhile.
  absl::StatusOr<std::vector<Node>> ErasedThatAreThere(const CallContext& call) {
    std::vector<Node> there;
    DSG_RETURN_IF_ERROR(WithoutOldReaders([&]() -> absl::Status {
      there.clear();
      DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
      DSG_ASSIGN_OR_RETURN(const auto nodes, opened.map->FindNodes(erasure_->nodes, call.stop()));
      for (const auto& node : nodes) {
        if (node.has_value()) there.push_back(*node);
      }
      return absl::OkStatus();
    }));
    return there;
  }

  // The past of an agent that is there again cannot go without its present. True if there is time
  // for another round; else it is left.
  absl::StatusOr<bool> MustPlanAgain(const CallContext& call) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Node> there, ErasedThatAreThere(call));
    std::set<NodeId> agents;
    for (const Node& node : there) {
      if (IsAgentKind(node.kind)) agents.insert(node.id);
    }
    if (agents.empty()) return false;
    if (round_ < kRoundsMax) {
      phase_ = Phase::kPlanAgain;
      return true;
    }
    std::erase_if(erasure_->nodes, [&](NodeId id) { return agents.contains(id); });
    left_.agents.insert(agents.begin(), agents.end());
    return false;
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
    bool must_plan_again = false;
    // A copy that is being made keeps the log from being cut.
    maps_->archives().EndOf(map_);
    const absl::Status status =
        maps_->WithWriter(map_, call.stop(), [&](MapWriter& writer) -> absl::Status {
          DSG_ASSIGN_OR_RETURN(must_plan_again, MustPlanAgain(call));
          if (must_plan_again) return absl::OkStatus();
          DSG_ASSIGN_OR_RETURN(const EraseReport report, writer.Erase(*erasure_, stop, tell));
          is_clean_ = report.is_clean;
          left_.agents.insert(report.left_agents.begin(), report.left_agents.end());
          is_over = true;
          return absl::OkStatus();
        });
    progress_ = std::max(progress_, kCommitted + (kErased - kCommitted) * fraction);
    if (!status.ok()) {
      return slice_is_over && absl::IsCancelled(status) ? absl::OkStatus() : status;
    }
    if (!is_over || must_plan_again) return absl::OkStatus();
    // Those that began meanwhile hold the bytes, too.
    maps_->archives().EndOf(map_);
    return AfterErase();
  }

  absl::Status CompactSlice(const CallContext& call) {
    v1::CompactResponse slice;
    DSG_RETURN_IF_ERROR(compaction_->Next(call, &slice).status());
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
    reply->set_log_bytes_after(maps_->store().ReusedBytesOnDisk(map_));
    DSG_ASSIGN_OR_RETURN(const auto pending, reader->GetPendingErasure());
    reply->set_erased(is_erase_ && !is_dry_run_ && is_clean_ && left_.empty() &&
                      !pending.has_value());
    if (erasure_.has_value() && !is_dry_run_) DSG_RETURN_IF_ERROR(FillLeft(call, reply));
    DSG_RETURN_IF_ERROR(FillHeader(reader.get(), *map, reply));
    progress_ = 1.0;
    is_done_ = true;
    return absl::OkStatus();
  }

  absl::Status FillLeft(const CallContext& call, v1::PruneResponse* reply) {
    reply->clear_left_ids();
    reply->clear_rewritten_ids();
    reply->set_left_count(static_cast<int64_t>(left_.size()));
    for (const std::string& name : left_.Names(kNamedMax)) reply->add_left_ids(name);
    DSG_ASSIGN_OR_RETURN(const std::vector<Node> there, ErasedThatAreThere(call));
    int64_t count = 0;
    for (const Node& node : there) {
      if (IsAgentKind(node.kind)) continue;
      if (static_cast<size_t>(count++) < kNamedMax) reply->add_rewritten_ids(ToString(node.id));
    }
    reply->set_rewritten_count(count);
    return absl::OkStatus();
  }

  MapTable* const maps_;
  const std::string map_;
  const bool is_dry_run_;
  const bool allow_everything_;
  /// 0 = no limit.
  const double share_max_;
  const std::string author_;
  const std::vector<PrunePolicy> policies_;
  Phase phase_ = Phase::kPlan;
  std::optional<PruneBatches> batches_;
  /// Whether a policy erases, also when there is nothing to erase.
  bool is_erase_ = false;
  std::optional<Erasure> erasure_;
  /// The map remembers `erasure_`.
  bool is_noted_ = false;
  int round_ = 1;
  /// What others touched since the plan of this round.
  Others others_;
  /// Nodes that others touched in any round.
  std::set<NodeId> rewritten_;
  Contested left_;
  std::optional<Revision> keep_from_;
  std::unique_ptr<StreamCursor<v1::CompactResponse>> compaction_;
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

// The first message says what will go; the others that a batch of it is gone and on disk. Commits
// of others go in between; what they change meanwhile is left as it is, but where it is to be
// erased: there its past goes, and what cannot go is named. A prune that ended early resumes when
// the same request is repeated; the map itself knows what an erasure has left.
CursorOr<v1::PruneResponse> Prune(Engine* engine, const CallContext&,
                                  const v1::PruneRequest& request) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  if (request.policies().empty() || request.policies_size() > kPolicyCountMax) {
    return FieldError("policies", absl::StrCat(request.policies_size()),
                      absl::StrCat("give 1 to ", kPolicyCountMax, " policies"));
  }
  // Not-a-number is in no range.
  if (!(request.share_max() >= 0.0 && request.share_max() <= 1.0)) {
    return FieldError("share_max", absl::StrCat(request.share_max()),
                      "give a share from 0 (no limit) to 1");
  }
  std::vector<PrunePolicy> policies;
  for (const v1::PrunePolicy& policy : request.policies()) {
    DSG_ASSIGN_OR_RETURN(PrunePolicy made, FromProto(policy, map->spec()));
    policies.push_back(std::move(made));
  }
  return std::make_unique<Pruning>(&engine->maps, request, std::move(policies));
}

}  // namespace dsg::query
