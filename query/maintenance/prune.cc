// SPDX-License-Identifier: Apache-2.0
// Answers Prune: forgets by policy, a step a message: plan, check, commit in batches, erase,
// compact, report. Refuses to forget all of a map unless it is told that it may.
#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/maintenance/archives.h"
#include "query/maintenance/commit.h"
#include "query/maintenance/prune_convert.h"
#include "schema/base/status.h"
#include "schema/retention/batches.h"
#include "schema/retention/past.h"
#include "schema/retention/plan.h"

namespace dsg::query {
namespace {

constexpr int kPolicyCountMax = 100;
// How long commits to the map wait for a slice of erasing, about. It doubles up to the second
// number: a step that takes longer than a slice would never end.
constexpr std::chrono::milliseconds kEraseSlice{500};
constexpr std::chrono::milliseconds kEraseSliceMax{60'000};
// How often an erasure plans again what others wrote meanwhile.
constexpr int kRoundsMax = 4;
// So many of the entities that are left are named.
constexpr size_t kNamedMax = 20;
// The progress at the end of each phase.
constexpr double kProgressPlanned = 0.05;
constexpr double kProgressCommitted = 0.6;
constexpr double kProgressErased = 0.8;

// The message of the revisions.
std::string PruneMessageOf(const std::vector<PrunePolicy>& policies) {
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

// Whether the request allows all that the plan takes.
absl::Status CheckPlan(const v1::PruneRequest& request, const PrunePlan& plan) {
  if (!request.allow_everything() && !plan.all_matching_policy.empty()) {
    return MakeError(
        Reason::kPolicyMatchesAll,
        absl::StrCat("map \"", request.map(), "\": ", plan.all_matching_policy,
                     " matches every node, every pose or the only building; nothing was "
                     "forgotten. Narrow it, or say that everything may go"),
        {{"map", request.map()}, {"policy", plan.all_matching_policy}});
  }
  const double share_max = request.share_max();
  if (share_max == 0.0 || plan.share <= share_max) return absl::OkStatus();
  return MakeError(
      Reason::kPolicyTakesTooMuch,
      absl::StrCat("map \"", request.map(), "\": ", plan.share_policy, " takes ", plan.share,
                   " of the nodes or of the poses, more than the share of ", share_max,
                   " that may go; nothing was forgotten. Look with a dry run whether the clocks "
                   "of agents are right, narrow it, or allow a larger share"),
      {{"map", request.map()},
       {"policy", plan.share_policy},
       {"share", absl::StrCat(plan.share)},
       {"share_max", absl::StrCat(share_max)}});
}

void FillPlan(const PrunePlan& plan, const absl::Status& refusal, v1::PruneResponse* reply) {
  reply->set_refusal(std::string(refusal.message()));
  reply->clear_implausible_ids();
  reply->clear_notes();
  for (const NodeId id : plan.implausible_agents) reply->add_implausible_ids(ToString(id));
  for (const std::string& note : plan.notes) reply->add_notes(note);
  for (const PolicyMatch& match : plan.policies) {
    v1::PolicyReport* const report = reply->add_policies();
    report->set_name(match.name);
    ToProto(match.matched, report->mutable_matched());
  }
}

absl::Status FillPruneHeader(const OpenedMap& opened, v1::PruneResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Revision oldest, opened.reader->OldestRevision());
  reply->mutable_header()->set_read_revision(opened.map->revision());
  reply->mutable_header()->set_head_revision(opened.map->revision());
  reply->mutable_header()->set_oldest_revision(oldest);
  reply->mutable_header()->set_incarnation(opened.reader->incarnation());
  return absl::OkStatus();
}

// An erasure beside commits of others. What they write of agents, tracks and meshes would be left
// for good, so it is planned again, a few rounds at most; what is left then is named.
struct ErasureWork {
  Erasure erasure;
  /// The map remembers `erasure`, so that a call that is cut off can be resumed.
  bool is_noted = false;
  int round = 1;
  /// What others touched since the plan of this round.
  Others others;
  /// Nodes that others touched in any round.
  std::set<NodeId> rewritten;
  Contested left;
  std::chrono::milliseconds slice = kEraseSlice;
};

class Pruning final : public EngineCursor<v1::PruneResponse> {
 public:
  Pruning(Engine* engine, v1::PruneRequest request, std::vector<PrunePolicy> policies)
      : engine_(engine),
        maps_(&engine->maps),
        request_(std::move(request)),
        map_(request_.map()),
        policies_(std::move(policies)) {}

  bool done() const override { return is_done_; }

 private:
  enum class Phase { kPlan, kCommit, kPlanAgain, kErase, kCompact, kReport };

  absl::Status Fill(const CallContext& call, v1::PruneResponse* reply) override {
    DSG_RETURN_IF_ERROR(RunStep(call, reply));
    if (phase_ == Phase::kReport) {
      DSG_RETURN_IF_ERROR(WithoutOldReaders([&] { return Report(call, reply); }));
    }
    reply->set_progress(progress_);
    reply->set_revision(revision_);
    reply->set_done(is_done_);
    return absl::OkStatus();
  }

  absl::Status RunStep(const CallContext& call, v1::PruneResponse* reply) {
    switch (phase_) {
      case Phase::kPlan:
        return WithoutOldReaders([&] { return Plan(call, reply); });
      case Phase::kCommit:
        return CommitBatch(call);
      case Phase::kPlanAgain:
        return WithoutOldReaders([&] { return PlanAgain(call); });
      case Phase::kErase:
        return EraseSlice(call);
      case Phase::kCompact:
        return CompactSlice(call);
      case Phase::kReport:
        return absl::OkStatus();
    }
    return absl::OkStatus();
  }

  // --- Plan and check: the first message.

  absl::Status Plan(const CallContext& call, v1::PruneResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
    absl::StatusOr<PrunePlan> plan = PlanAt(opened, call);
    if (!plan.ok()) return ResumeErasure(call, opened, plan.status(), reply);
    const absl::Status refusal = CheckPlan(request_, *plan);
    if (!request_.dry_run()) DSG_RETURN_IF_ERROR(refusal);
    DSG_RETURN_IF_ERROR(MeasureBefore(call, opened, reply));
    FillPlan(*plan, refusal, reply);
    has_changes_ = !plan->IsEmpty();
    // Nothing to compact is no reason to take the writer's lock.
    if (plan->total.revision_count > 0) keep_from_ = plan->keep_from;
    DSG_RETURN_IF_ERROR(TakeErasure(opened, &*plan));
    progress_ = kProgressPlanned;
    const bool has_work = has_changes_ || erasing_.has_value() || keep_from_.has_value();
    phase_ = request_.dry_run() || !has_work ? Phase::kReport : Phase::kCommit;
    BeginRound(opened.map, *std::move(plan));
    return absl::OkStatus();
  }

  absl::StatusOr<PrunePlan> PlanAt(const OpenedMap& opened, const CallContext& call) const {
    return PlanPrune(opened.reader.get(), *opened.map, policies_, {.wall_now_ns = WallClockNs()},
                     call.stop());
  }

  // No revision knows a branch that is wholly gone. If a call was cut off while it erased the
  // branch, the map knows what that call left.
  absl::Status ResumeErasure(const CallContext& call, const OpenedMap& opened,
                             const absl::Status& failure, v1::PruneResponse* reply) {
    const bool may_be_erased = ReasonOf(failure) == Reason::kNodeUnknown && !request_.dry_run() &&
                               policies_.size() == 1 &&
                               policies_.front().strength == PruneStrength::kErase;
    if (!may_be_erased) return failure;
    DSG_ASSIGN_OR_RETURN(const auto pending, opened.reader->GetPendingErasure());
    if (!pending.has_value()) return failure;
    DSG_RETURN_IF_ERROR(MeasureBefore(call, opened, reply));
    reply->add_policies()->set_name(policies_.front().name);
    is_erase_ = true;
    erasing_.emplace();
    progress_ = kProgressCommitted;
    phase_ = Phase::kErase;
    return absl::OkStatus();
  }

  absl::Status MeasureBefore(const CallContext& call, const OpenedMap& opened,
                             v1::PruneResponse* reply) {
    DSG_ASSIGN_OR_RETURN(before_, CountMap(*opened.map, call.stop()));
    DSG_ASSIGN_OR_RETURN(const MapStats stats, opened.map->Stats());
    before_.revision_count = stats.at.revision;
    file_bytes_before_ = stats.bytes_on_disk;
    log_bytes_before_ = maps_->store().ReusedBytesOnDisk(map_);
    reply->clear_policies();
    ToProto(before_, reply->mutable_map_before());
    return FillPruneHeader(opened, reply);
  }

  // Without anything to erase, archives that are being read go on.
  absl::Status TakeErasure(const OpenedMap& opened, PrunePlan* plan) {
    std::optional<Erasure> erasure;
    erasure.swap(plan->erasure);
    if (!erasure.has_value()) return absl::OkStatus();
    is_erase_ = true;
    DSG_ASSIGN_OR_RETURN(const auto pending, opened.reader->GetPendingErasure());
    is_clean_ = IsEmpty(*erasure) && !has_changes_ && !pending.has_value();
    if (!is_clean_) erasing_.emplace().erasure = *std::move(erasure);
    return absl::OkStatus();
  }

  void BeginRound(const std::shared_ptr<const Snapshot>& map, PrunePlan plan) {
    seen_ = plan.revision;
    if (erasing_.has_value()) {
      erasing_->others = {};
      erasing_->is_noted = false;
    }
    batches_.emplace(
        map, std::move(plan),
        BatchHeader{map_, NewSessionId("prune"), request_.author(), PruneMessageOf(policies_)});
  }

  // --- Apply: commits in batches.

  absl::Status CommitBatch(const CallContext& call) {
    bool is_over = false;
    DSG_RETURN_IF_ERROR(
        maps_->WithWriter(map_, call.stop(), [&](MapWriter& writer) -> absl::Status {
          DSG_ASSIGN_OR_RETURN(const OpenedMap head, OpenNewest(maps_, map_));
          DSG_RETURN_IF_ERROR(AvoidOthers(head, call));
          DSG_ASSIGN_OR_RETURN(std::optional<GraphDelta> delta,
                               batches_->Next(*head.map, call.stop()));
          is_over = !delta.has_value();
          if (is_over) return absl::OkStatus();
          // A call that ends between here and the erasing has begun something that is to be ended.
          if (erasing_.has_value() && !erasing_->is_noted) {
            DSG_RETURN_IF_ERROR(writer.NoteErasure(erasing_->erasure, batches_->plan().revision));
            erasing_->is_noted = true;
          }
          DSG_ASSIGN_OR_RETURN(const CommitResult result, writer.Commit(*std::move(delta)));
          revision_ = seen_ = result.revision;
          return absl::OkStatus();
        }));
    progress_ = std::max(progress_, kProgressPlanned + (kProgressCommitted - kProgressPlanned) *
                                                           batches_->progress());
    if (!is_over) return absl::OkStatus();
    progress_ = kProgressCommitted;
    return EndRound();
  }

  absl::Status AvoidOthers(const OpenedMap& head, const CallContext& call) {
    if (head.map->revision() <= seen_) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const Touched touched,
                         head.reader->TouchedBetween(seen_, head.map->revision(), call.stop()));
    batches_->Avoid(touched);
    if (erasing_.has_value()) erasing_->others.Add(touched);
    seen_ = head.map->revision();
    return absl::OkStatus();
  }

  absl::Status EndRound() {
    if (erasing_.has_value()) {
      const Others& others = erasing_->others;
      erasing_->left = others.FindContested(batches_->plan(), erasing_->erasure);
      erasing_->rewritten.insert(others.nodes().begin(), others.nodes().end());
      phase_ = erasing_->left.empty() || erasing_->round >= kRoundsMax ? Phase::kErase
                                                                       : Phase::kPlanAgain;
    }
    // Nothing may hold on to the past that is to be wiped out.
    batches_.reset();
    return erasing_.has_value() ? absl::OkStatus() : BeginCompaction();
  }

  // Other nodes than agents keep what others wrote of them.
  absl::Status PlanAgain(const CallContext& call) {
    ++erasing_->round;
    phase_ = Phase::kErase;
    DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
    absl::StatusOr<PrunePlan> plan = PlanAt(opened, call);
    if (ReasonOf(plan.status()) == Reason::kNodeUnknown) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(plan.status());
    // The request does not allow that much; then what is contested is left, and named.
    if (!CheckPlan(request_, *plan).ok()) return absl::OkStatus();
    if (plan->erasure.has_value()) Join(*plan->erasure, &erasing_->erasure);
    plan->erasure.reset();
    const std::vector<NodeId> rewritten(erasing_->rewritten.begin(), erasing_->rewritten.end());
    DSG_ASSIGN_OR_RETURN(const auto nodes, opened.map->FindNodes(rewritten, call.stop()));
    Touched kept;
    for (const auto& node : nodes) {
      if (node.has_value() && !IsAgentKind(node->kind)) kept.nodes.push_back(node->id);
    }
    has_changes_ = has_changes_ || !plan->IsEmpty();
    BeginRound(opened.map, *std::move(plan));
    batches_->Avoid(kept);
    phase_ = Phase::kCommit;
    return absl::OkStatus();
  }

  // --- Apply: erases the past, a slice of time a message.

  absl::Status EraseSlice(const CallContext& call) {
    const auto slice_end = CallContext::Clock::now() + erasing_->slice;
    erasing_->slice = std::min<std::chrono::milliseconds>(2 * erasing_->slice, kEraseSliceMax);
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
    engine_->archives->EndOf(map_);
    const absl::Status status =
        maps_->WithWriter(map_, call.stop(), [&](MapWriter& writer) -> absl::Status {
          DSG_ASSIGN_OR_RETURN(const bool must_plan_again, MustPlanAgain(call));
          if (must_plan_again) return absl::OkStatus();
          DSG_ASSIGN_OR_RETURN(const EraseReport report,
                               writer.Erase(erasing_->erasure, stop, tell));
          is_clean_ = report.is_clean;
          erasing_->left.agents.insert(report.left_agents.begin(), report.left_agents.end());
          is_over = true;
          return absl::OkStatus();
        });
    progress_ =
        std::max(progress_, kProgressCommitted + (kProgressErased - kProgressCommitted) * fraction);
    if (!status.ok()) {
      return slice_is_over && absl::IsCancelled(status) ? absl::OkStatus() : status;
    }
    if (!is_over) return absl::OkStatus();
    // Archives that began meanwhile hold the bytes, too.
    engine_->archives->EndOf(map_);
    return BeginCompaction();
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
    if (erasing_->round < kRoundsMax) {
      phase_ = Phase::kPlanAgain;
      return true;
    }
    std::erase_if(erasing_->erasure.nodes, [&](NodeId id) { return agents.contains(id); });
    erasing_->left.agents.insert(agents.begin(), agents.end());
    return false;
  }

  // Of the nodes to erase those that are there now: others wrote them meanwhile.
  absl::StatusOr<std::vector<Node>> ErasedThatAreThere(const CallContext& call) {
    std::vector<Node> there;
    DSG_RETURN_IF_ERROR(WithoutOldReaders([&]() -> absl::Status {
      there.clear();
      DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
      DSG_ASSIGN_OR_RETURN(const auto nodes,
                           opened.map->FindNodes(erasing_->erasure.nodes, call.stop()));
      for (const auto& node : nodes) {
        if (node.has_value()) there.push_back(*node);
      }
      return absl::OkStatus();
    }));
    return there;
  }

  // --- Apply: compacts old revisions.

  absl::Status BeginCompaction() {
    if (!keep_from_.has_value()) {
      phase_ = Phase::kReport;
      return absl::OkStatus();
    }
    v1::CompactRequest request;
    request.set_map(map_);
    request.set_keep_from_revision(*keep_from_);
    DSG_ASSIGN_OR_RETURN(compaction_, Compact(engine_, CallContext(), request));
    phase_ = Phase::kCompact;
    return absl::OkStatus();
  }

  absl::Status CompactSlice(const CallContext& call) {
    v1::CompactResponse slice;
    DSG_RETURN_IF_ERROR(compaction_->Next(call, &slice).status());
    progress_ = std::max(progress_, kProgressErased + (1.0 - kProgressErased) * slice.progress());
    if (compaction_->done()) phase_ = Phase::kReport;
    return absl::OkStatus();
  }

  // --- Report: the last message.

  absl::Status Report(const CallContext& call, v1::PruneResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenNewest(maps_, map_));
    DSG_ASSIGN_OR_RETURN(const MapStats stats, opened.map->Stats());
    Amount after = before_;
    if (!request_.dry_run() && has_changes_) {
      DSG_ASSIGN_OR_RETURN(after, CountMap(*opened.map, call.stop()));
    }
    after.revision_count = stats.at.revision;
    ToProto(after, reply->mutable_map_after());
    reply->set_file_bytes_before(file_bytes_before_);
    reply->set_file_bytes_after(stats.bytes_on_disk);
    reply->set_log_bytes_before(log_bytes_before_);
    reply->set_log_bytes_after(maps_->store().ReusedBytesOnDisk(map_));
    DSG_ASSIGN_OR_RETURN(const auto pending, opened.reader->GetPendingErasure());
    const bool is_left = pending.has_value() || (erasing_.has_value() && !erasing_->left.empty());
    reply->set_erased(is_erase_ && !request_.dry_run() && is_clean_ && !is_left);
    if (erasing_.has_value() && !request_.dry_run()) DSG_RETURN_IF_ERROR(FillLeft(call, reply));
    DSG_RETURN_IF_ERROR(FillPruneHeader(opened, reply));
    progress_ = 1.0;
    is_done_ = true;
    return absl::OkStatus();
  }

  absl::Status FillLeft(const CallContext& call, v1::PruneResponse* reply) {
    reply->clear_left_ids();
    reply->clear_rewritten_ids();
    reply->set_left_count(static_cast<int64_t>(erasing_->left.size()));
    for (const std::string& name : erasing_->left.Names(kNamedMax)) reply->add_left_ids(name);
    DSG_ASSIGN_OR_RETURN(const std::vector<Node> there, ErasedThatAreThere(call));
    int64_t count = 0;
    for (const Node& node : there) {
      if (IsAgentKind(node.kind)) continue;
      if (static_cast<size_t>(count++) < kNamedMax) reply->add_rewritten_ids(ToString(node.id));
    }
    reply->set_rewritten_count(count);
    return absl::OkStatus();
  }

  Engine* const engine_;
  MapTable* const maps_;
  const v1::PruneRequest request_;
  const std::string map_;
  const std::vector<PrunePolicy> policies_;
  Phase phase_ = Phase::kPlan;
  std::optional<PruneBatches> batches_;
  /// Whether a policy erases, also when there is nothing to erase.
  bool is_erase_ = false;
  std::optional<ErasureWork> erasing_;
  std::optional<Revision> keep_from_;
  std::unique_ptr<StreamCursor<v1::CompactResponse>> compaction_;
  Amount before_;
  int64_t file_bytes_before_ = 0;
  int64_t log_bytes_before_ = 0;
  bool has_changes_ = false;
  bool is_clean_ = false;
  // The newest revision that the plan was compared with, or that this call wrote.
  Revision seen_ = 0;
  Revision revision_ = 0;
  double progress_ = 0.0;
  bool is_done_ = false;
};

absl::StatusOr<std::vector<PrunePolicy>> PoliciesFromProto(const v1::PruneRequest& request,
                                                           const MapSpec& map) {
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
    DSG_ASSIGN_OR_RETURN(PrunePolicy made, FromProto(policy, map));
    policies.push_back(std::move(made));
  }
  return policies;
}

}  // namespace

// The first message says what will go; each later one says that one more step is on disk. Commits
// of others go in between; what they change meanwhile is left as it is, except where it is to be
// erased: there its past goes, and what cannot go is named. A prune that ended early resumes when
// the same request is repeated; the map itself knows what an erasure has left.
CursorOr<v1::PruneResponse> Prune(Engine* engine, const CallContext&,
                                  const v1::PruneRequest& request) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(std::vector<PrunePolicy> policies, PoliciesFromProto(request, map->spec()));
  return std::make_unique<Pruning>(engine, request, std::move(policies));
}

}  // namespace dsg::query
