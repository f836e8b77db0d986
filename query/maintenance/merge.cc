// SPDX-License-Identifier: Apache-2.0
// Answers MergeMaps: takes another map into this one, a batch a message. Refuses to guess a
// transform that the maps do not tell.
#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/maintenance/commit.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/merge/merge.h"
#include "schema/merge/merge_deltas.h"
#include "schema/merge/refine.h"

namespace dsg::query {
namespace {

// A message of so many pairs of ids stays below a megabyte.
constexpr int kIdsAMessage = 20'000;

class Merge final : public EngineCursor<v1::MergeMapsResponse> {
 public:
  Merge(MapTable* maps, std::shared_ptr<MapReader> into, std::shared_ptr<MapReader> other,
        std::optional<Pose3d> map_T_other, bool is_dry_run, std::string author)
      : maps_(maps),
        into_(std::move(into)),
        other_(std::move(other)),
        map_T_other_(map_T_other),
        is_dry_run_(is_dry_run),
        author_(std::move(author)) {}

  bool done() const override { return is_done_; }

 private:
  absl::Status Fill(const CallContext& call, v1::MergeMapsResponse* reply) override {
    if (deltas_ == nullptr) {
      DSG_RETURN_IF_ERROR(Plan(call));
    } else if (!is_written_) {
      DSG_RETURN_IF_ERROR(Write(call));
    }
    if (is_written_) TellIds(reply);
    Tell(reply);
    return absl::OkStatus();
  }

  absl::Status Plan(const CallContext& call) {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> into, into_->Latest());
    DSG_ASSIGN_OR_RETURN(other_now_, other_->Latest());
    DSG_RETURN_IF_ERROR(merge::CheckMergeable(*into, *other_now_));
    if (!map_T_other_.has_value()) {
      DSG_ASSIGN_OR_RETURN(const merge::Alignment alignment,
                           merge::FindTransform(*into, *other_now_, {}, call.stop()));
      map_T_other_ = alignment.map_T_other;
      agreeing_count_ = alignment.agreeing_count;
    }
    options_.into_map = into_.get();
    options_.other_map = other_.get();
    DSG_ASSIGN_OR_RETURN(options_.used_ids, merge::FindUsedIds(into_.get(), call.stop()));
    DSG_RETURN_IF_ERROR(PlanAt(into, call));
    options_.check_reach = false;
    is_written_ = is_dry_run_;
    return absl::OkStatus();
  }

  absl::Status PlanAt(const std::shared_ptr<const Snapshot>& into, const CallContext& call) {
    DSG_ASSIGN_OR_RETURN(merge::MergePlan plan, merge::PlanMerge(*into, *other_now_, *map_T_other_,
                                                                 options_, call.stop()));
    // What a plan finds written by an earlier one is neither added nor gone to it.
    added_node_count_ = std::max(added_node_count_, plan.counts.added_node_count);
    gone_.insert(plan.gone.begin(), plan.gone.end());
    for (const auto& [before, after] : plan.moved) moved_[before] = after;
    if (session_id_.empty()) session_id_ = NewSessionId("merge");
    // Later plans meet what earlier ones have written.
    if (part_count_ == 0) evidence_ = plan.evidence;
    seen_ = plan.into_revision;
    deltas_ = std::make_unique<merge::MergeDeltas>(into, other_now_, std::move(plan), author_,
                                                   part_count_);
    next_id_ = deltas_->plan().node_ids.begin();
    return absl::OkStatus();
  }

  // With the map's writer, so that nobody changes the map between the look at it and the commit.
  absl::Status Write(const CallContext& call) {
    return maps_->WithWriter(
        into_->spec().name, call.stop(), [&](MapWriter& writer) -> absl::Status {
          DSG_RETURN_IF_ERROR(CatchUp(call));
          DSG_ASSIGN_OR_RETURN(std::optional<GraphDelta> delta, deltas_->Next(call.stop()));
          is_written_ = !delta.has_value();
          if (is_written_) return absl::OkStatus();
          return Commit(*std::move(delta), &writer);
        });
  }

  absl::Status Commit(GraphDelta delta, MapWriter* writer) {
    delta.parent_revision = seen_;
    delta.session_id = session_id_;
    delta.sequence = ++part_count_;
    std::vector<NodeId> nodes;
    for (const Node& node : delta.nodes) nodes.push_back(node.id);
    std::vector<EdgeKey> edges;
    for (const Edge& edge : delta.edges) edges.push_back(edge.key());
    DSG_ASSIGN_OR_RETURN(const CommitResult result, writer->Commit(std::move(delta)));
    if (result.replayed) {
      return absl::InternalError(
          absl::StrCat("part ", part_count_, " of the merge was known to map \"",
                       into_->spec().name, "\" already and not written; run the merge again"));
    }
    seen_ = revision_ = result.revision;
    Note(std::move(nodes), edges);
    return absl::OkStatus();
  }

  // What is written is not written again, whatever becomes of it.
  void Note(std::vector<NodeId> nodes, const std::vector<EdgeKey>& edges) {
    options_.written.edges.insert(edges.begin(), edges.end());
    if (nodes.empty()) return;
    std::sort(nodes.begin(), nodes.end());
    for (const auto& [theirs, mine] : deltas_->plan().node_ids) {
      if (std::binary_search(nodes.begin(), nodes.end(), mine)) {
        options_.written.nodes[theirs] = mine;
      }
    }
  }

  // A robot may commit all the time: only what touches the rest of the plan has it made anew.
  absl::Status CatchUp(const CallContext& call) {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> head, into_->Latest());
    if (head->revision() == seen_) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const Touched touched,
                         into_->TouchedBetween(seen_, head->revision(), call.stop()));
    for (const NodeId id : touched.nodes) {
      uint64_t& largest = options_.used_ids[id.letter()];
      largest = std::max(largest, id.index());
    }
    DSG_ASSIGN_OR_RETURN(const bool holds, deltas_->Follow(head, touched));
    if (!holds) return PlanAt(head, call);
    seen_ = head->revision();
    return absl::OkStatus();
  }

  void TellIds(v1::MergeMapsResponse* reply) {
    const auto& ids = deltas_->plan().node_ids;
    for (int count = 0; next_id_ != ids.end() && count < kIdsAMessage; ++count, ++next_id_) {
      (*reply->mutable_node_ids())[ToString(next_id_->first)] = ToString(next_id_->second);
    }
    is_done_ = next_id_ == ids.end();
    if (!is_done_) return;
    for (const NodeId id : gone_) reply->add_gone_ids(ToString(id));
    for (const auto& [before, after] : moved_) {
      (*reply->mutable_moved_ids())[ToString(before)] = ToString(after);
    }
  }

  void Tell(v1::MergeMapsResponse* reply) {
    const merge::MergePlan& plan = deltas_->plan();
    ToProto(*map_T_other_, reply->mutable_map_t_other());
    reply->set_residual_m(plan.residual_m);
    reply->set_agreeing_count(agreeing_count_ > 0
                                  ? agreeing_count_
                                  : static_cast<int32_t>(plan.counts.fused_object_count));
    reply->set_missing_count(evidence_.missing_count);
    reply->set_blocked_share(evidence_.blocked_share);
    reply->set_fused_object_count(plan.counts.fused_object_count);
    reply->set_fused_place_count(plan.counts.fused_place_count);
    reply->set_fused_room_count(plan.counts.fused_room_count);
    reply->set_fused_structure_count(plan.counts.fused_structure_count);
    reply->set_fused_mesh_block_count(deltas_->fused_mesh_block_count());
    reply->set_added_node_count(added_node_count_);
    reply->set_gone_count(static_cast<int64_t>(gone_.size()));
    reply->set_revision(revision_);
    progress_ = std::max(progress_, 0.99 * (is_written_ ? 1.0 : deltas_->progress()));
    reply->set_progress(is_done_ ? 1.0 : progress_);
    reply->set_done(is_done_);
  }

  MapTable* const maps_;
  const std::shared_ptr<MapReader> into_;
  const std::shared_ptr<MapReader> other_;
  std::optional<Pose3d> map_T_other_;
  const bool is_dry_run_;
  const std::string author_;
  std::shared_ptr<const Snapshot> other_now_;
  merge::MergeOptions options_;
  std::unique_ptr<merge::MergeDeltas> deltas_;
  std::map<NodeId, NodeId>::const_iterator next_id_;
  int32_t agreeing_count_ = 0;
  merge::Evidence evidence_;
  int64_t added_node_count_ = 0;
  std::set<NodeId> gone_;
  std::map<NodeId, NodeId> moved_;
  /// The newest revision that the plan was compared with, or that it wrote.
  Revision seen_ = 0;
  Revision revision_ = 0;
  std::string session_id_;
  int64_t part_count_ = 0;
  double progress_ = 0.0;
  bool is_written_ = false;
  bool is_done_ = false;
};

}  // namespace

// The first message has the transform and what will become of the nodes, as counts; then each has
// one more batch on disk, and the last ones the ids.
CursorOr<v1::MergeMapsResponse> MergeMaps(Engine* engine, const CallContext&,
                                          const v1::MergeMapsRequest& request) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> into, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> other, engine->maps.Reader(request.other()));
  if (request.map() == request.other()) {
    return FieldError("other", request.other(),
                      "a map cannot be merged with itself; name another map");
  }
  std::optional<Pose3d> map_T_other;
  if (request.has_map_t_other()) map_T_other = FromProto(request.map_t_other());
  return std::make_unique<Merge>(&engine->maps, std::move(into), std::move(other), map_T_other,
                                 request.dry_run(), request.author());
}

}  // namespace dsg::query
