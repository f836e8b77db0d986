// SPDX-License-Identifier: Apache-2.0
// Answers Revert: makes a map what it was at a revision, as new revisions, a batch a message. The
// revisions between stay readable.
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/maintenance/commit.h"
#include "query/maintenance/prune_convert.h"
#include "query/maintenance/revert_plan.h"
#include "schema/base/status.h"
#include "schema/store/reverts.h"

namespace dsg::query {
namespace {

class Reversion final : public EngineCursor<v1::RevertResponse> {
 public:
  Reversion(MapTable* maps, std::shared_ptr<MapReader> map, std::shared_ptr<const Snapshot> present,
            std::shared_ptr<const Snapshot> wanted, const v1::RevertRequest& request)
      : maps_(maps),
        map_(std::move(map)),
        present_(std::move(present)),
        wanted_(std::move(wanted)),
        author_(request.author().empty() ? "revert" : request.author()),
        is_dry_run_(request.dry_run()),
        parent_(present_->revision()) {}

  bool done() const override {
    return is_planned_ && (is_dry_run_ || next_ == plan_.batches.size());
  }

 private:
  // The first message has what will change; each later one a batch.
  absl::Status Fill(const CallContext& call, v1::RevertResponse* reply) override {
    if (!is_planned_) {
      DSG_RETURN_IF_ERROR(PlanFrom(present_, call));
    } else {
      DSG_RETURN_IF_ERROR(Write(call));
    }
    ToProto(plan_.written, reply->mutable_added());
    ToProto(plan_.removed, reply->mutable_removed());
    reply->set_revision(written_);
    reply->set_done(done());
    reply->set_progress(
        done() ? 1.0 : static_cast<double>(next_) / static_cast<double>(plan_.batches.size()));
    return absl::OkStatus();
  }

  absl::Status PlanFrom(const std::shared_ptr<const Snapshot>& present, const CallContext& call) {
    DSG_ASSIGN_OR_RETURN(plan_, PlanRevert(map_.get(), *present, *wanted_, call.stop()));
    present_ = present;
    parent_ = present->revision();
    next_ = 0;
    session_id_ = NewSessionId(RevertSessionName(wanted_->revision()));
    is_planned_ = true;
    return absl::OkStatus();
  }

  // A batch at a time, so that others may write between; but if they do, the rest is planned anew
  // and written at once while they wait: whatever was committed before is then undone, whatever
  // comes after is kept, and someone who commits all the time cannot keep this from its end.
  absl::Status Write(const CallContext& call) {
    return maps_->WithWriter(
        map_->spec().name, call.stop(), [&](MapWriter& writer) -> absl::Status {
          DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> head, map_->Latest());
          if (head->revision() == parent_) return CommitBatch(*head, &writer, call);
          DSG_RETURN_IF_ERROR(PlanFrom(head, call));
          while (!done()) {
            DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> now, map_->Latest());
            DSG_RETURN_IF_ERROR(CommitBatch(*now, &writer, call));
          }
          return absl::OkStatus();
        });
  }

  absl::Status CommitBatch(const Snapshot& head, MapWriter* writer, const CallContext& call) {
    DSG_ASSIGN_OR_RETURN(GraphDelta delta,
                         MakeRevertDelta(plan_.batches[next_], head, *wanted_, call.stop()));
    ++next_;
    delta.map = map_->spec().name;
    delta.session_id = session_id_;
    delta.sequence = static_cast<int64_t>(next_);
    delta.parent_revision = parent_;
    delta.author = author_;
    delta.message = absl::StrCat("revert to ", wanted_->revision(), ", part ", next_, " of ",
                                 plan_.batches.size());
    DSG_ASSIGN_OR_RETURN(const CommitResult result, writer->Commit(std::move(delta)));
    written_ = parent_ = result.revision;
    return absl::OkStatus();
  }

  MapTable* const maps_;
  const std::shared_ptr<MapReader> map_;
  /// What the plan was made from.
  std::shared_ptr<const Snapshot> present_;
  const std::shared_ptr<const Snapshot> wanted_;
  const std::string author_;
  const bool is_dry_run_;
  /// The newest revision, as far as we know.
  Revision parent_;
  Revision written_ = 0;
  bool is_planned_ = false;
  /// Of the plan.
  std::string session_id_;
  RevertPlan plan_;
  size_t next_ = 0;
};

absl::StatusOr<Revision> WantedRevision(MapReader* map, const v1::RevertRequest& request) {
  if (!request.tag().empty()) return RevisionOfTag(map, request.tag());
  if (request.has_revision() && request.revision() >= 0) return request.revision();
  return FieldError("revision", absl::StrCat(request.revision()),
                    "name the revision or the tag to go back to");
}

}  // namespace

// Layers and labels that came later stay, without nodes; assets stay too.
CursorOr<v1::RevertResponse> Revert(Engine* engine, const CallContext&,
                                    const v1::RevertRequest& request) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(const Revision wanted_revision, WantedRevision(map.get(), request));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> wanted, map->At(wanted_revision));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> present, map->Latest());
  return std::make_unique<Reversion>(&engine->maps, std::move(map), std::move(present),
                                     std::move(wanted), request);
}

}  // namespace dsg::query
