// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/batches.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/retention/measure.h"
#include "schema/retention/track_batches.h"

namespace dsg {

namespace {

// Vertices and faces of a block that count as one row.
constexpr size_t kMeshPartsPerRow = 100;

}  // namespace

class PruneBatches::Impl {
 public:
  Impl(std::shared_ptr<const Snapshot> at_plan, PrunePlan plan, BatchHeader header)
      : at_plan_(std::move(at_plan)), plan_(std::move(plan)), header_(std::move(header)) {
    for (const NodePlan& node : plan_.nodes) gone_.insert(node.id);
    step_count_ = plan_.mesh.removed.size() + plan_.mesh.cut.size() + plan_.tracks.size() +
                  plan_.stay_removals.size() + plan_.stay_edits.size() + plan_.nodes.size();
  }

  absl::StatusOr<std::optional<GraphDelta>> Next(const Snapshot& head, const StopCheck& stop) {
    GraphDelta delta;
    rows_ = 0;
    DSG_RETURN_IF_ERROR(AddMesh(stop, &delta));
    DSG_RETURN_IF_ERROR(AddTracks(stop, &delta));
    AddStays(&delta);
    // Nodes go last: until then the branch is found again by its root. They look at the stays as
    // these are in `head`, so not in one delta with changes of them.
    const bool has_stays = !delta.stays.empty() || !delta.stay_removals.empty();
    if (!IsFull() && !has_stays && !ChangesGoneAgents(delta)) {
      DSG_RETURN_IF_ERROR(AddNodes(head, stop, &delta));
    }
    if (delta.empty()) return std::optional<GraphDelta>();
    delta.map = header_.map;
    delta.session_id = header_.session_id;
    delta.sequence = ++part_;
    delta.author = header_.author;
    delta.message = absl::StrCat(header_.message, ", part ", part_);
    delta.is_forgetting = true;
    return std::optional<GraphDelta>(std::move(delta));
  }

  void Avoid(const Touched& touched) {
    kept_nodes_.insert(touched.nodes.begin(), touched.nodes.end());
    kept_tracks_.insert(touched.corrected_tracks.begin(), touched.corrected_tracks.end());
    kept_blocks_.insert(touched.mesh_blocks.begin(), touched.mesh_blocks.end());
  }

  double progress() const {
    return step_count_ == 0 ? 1.0 : static_cast<double>(step_) / static_cast<double>(step_count_);
  }
  const PrunePlan& plan() const { return plan_; }

 private:
  bool IsFull() const { return rows_ >= kPruneBatchRows; }

  // A delta that retires an agent cannot correct its track as well.
  bool ChangesGoneAgents(const GraphDelta& delta) const {
    const auto is_gone = [this](const auto& change) { return gone_.contains(change.agent); };
    const auto any = [&](const auto& changes) {
      return std::any_of(changes.begin(), changes.end(), is_gone);
    };
    return any(delta.corrections) || any(delta.shape_removals) || any(delta.factor_removals);
  }

  absl::Status AddMesh(const StopCheck& stop, GraphDelta* delta) {
    const MeshPlan& mesh = plan_.mesh;
    for (; !IsFull() && next_removed_ < mesh.removed.size(); ++next_removed_, ++step_) {
      if (kept_blocks_.contains(mesh.removed[next_removed_])) continue;
      delta->mesh_removals.push_back(mesh.removed[next_removed_]);
      ++rows_;
    }
    for (; !IsFull() && next_cut_ < mesh.cut.size(); ++next_cut_, ++step_) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      if (kept_blocks_.contains(mesh.cut[next_cut_])) continue;
      DSG_ASSIGN_OR_RETURN(const MeshBlock block, at_plan_->ReadMeshBlock(mesh.cut[next_cut_]));
      bool is_cut = false;
      delta->mesh_blocks.push_back(CutMesh(block, mesh.solids, &is_cut));
      // A transaction is to have a bounded number of bytes too.
      rows_ += 1 + (block.positions_map.size() + block.faces.size()) / kMeshPartsPerRow;
    }
    return absl::OkStatus();
  }

  absl::Status AddTracks(const StopCheck& stop, GraphDelta* delta) {
    while (!IsFull() && next_track_ < plan_.tracks.size()) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      const TrackPlan& track = plan_.tracks[next_track_];
      size_t count = 0;
      if (!kept_tracks_.contains(track.agent)) {
        if (track_ == nullptr) track_ = std::make_unique<TrackBatches>(*at_plan_, track);
        DSG_ASSIGN_OR_RETURN(count, track_->AddTo(kPruneBatchRows - rows_, stop, delta));
        rows_ += count;
      }
      if (count > 0) continue;
      track_.reset();
      ++next_track_;
      ++step_;
    }
    return absl::OkStatus();
  }

  void AddStays(GraphDelta* delta) {
    for (; !IsFull() && next_stay_ < plan_.stay_removals.size(); ++next_stay_, ++step_, ++rows_) {
      delta->stay_removals.push_back(plan_.stay_removals[next_stay_]);
    }
    for (; !IsFull() && next_edit_ < plan_.stay_edits.size(); ++next_edit_, ++step_, ++rows_) {
      const StayEdit& edit = plan_.stay_edits[next_edit_];
      // Its beginning is part of its key.
      if (edit.stay.enter_ns != edit.key.enter_ns) delta->stay_removals.push_back(edit.key);
      delta->stays.push_back(edit.stay);
    }
  }

  absl::Status AddNodes(const Snapshot& head, const StopCheck& stop, GraphDelta* delta) {
    // The nodes of one delta are gone for each other only once it is committed.
    const bool has_others = !delta->empty();
    for (; !IsFull() && next_node_ < plan_.nodes.size(); ++next_node_, ++step_) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      const NodePlan& node = plan_.nodes[next_node_];
      if (kept_nodes_.contains(node.id)) continue;
      const auto row_count = static_cast<size_t>(node.edge_count) + 1;
      if (row_count > kPruneBatchRows && !edges_are_gone_) {
        if (has_others || !delta->retirements.empty()) return absl::OkStatus();
        DSG_ASSIGN_OR_RETURN(edges_are_gone_, AddEdges(node.id, head, stop, delta));
        if (!edges_are_gone_) return absl::OkStatus();
      }
      if (node.may_hold_stays) DSG_RETURN_IF_ERROR(AddLateStays(node.id, head, stop, delta));
      delta->retirements.push_back({node.id, std::nullopt});
      rows_ += edges_are_gone_ ? 1 : row_count;
      edges_are_gone_ = false;
    }
    return absl::OkStatus();
  }

  // Edges of a hub, but for those that hold it in its branch. True if no more were left.
  absl::StatusOr<bool> AddEdges(NodeId id, const Snapshot& head, const StopCheck& stop,
                                GraphDelta* delta) {
    const auto take = [&](const Edge& edge) {
      const bool holds = edge.target == id && edge.relation == relations::kContains;
      if (!holds) {
        delta->edge_removals.push_back(edge.key());
        ++rows_;
      }
      return !IsFull();
    };
    EdgeFilter from;
    from.source = id;
    DSG_RETURN_IF_ERROR(head.ScanEdges(from, std::nullopt, stop, take));
    EdgeFilter to;
    to.target = id;
    if (!IsFull()) DSG_RETURN_IF_ERROR(head.ScanEdges(to, std::nullopt, stop, take));
    return !IsFull();
  }

  // Stays that came after the plan: no stay may name a node that is gone.
  absl::Status AddLateStays(NodeId id, const Snapshot& head, const StopCheck& stop,
                            GraphDelta* delta) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Stay> stays,
                         head.StaysInNode(id, kTimeMin, kTimeMax, stop));
    for (Stay stay : stays) {
      DSG_ASSIGN_OR_RETURN(const TrackInfo track, head.GetTrack(stay.agent));
      stay = WithOpenEnd(stay, track);
      if (gone_.contains(stay.place)) stay.place = NodeId();
      if (gone_.contains(stay.room)) stay.room = NodeId();
      ++rows_;
      if (stay.place.empty() && stay.room.empty()) {
        delta->stay_removals.push_back({stay.agent, stay.enter_ns});
      } else {
        delta->stays.push_back(stay);
      }
    }
    return absl::OkStatus();
  }

  const std::shared_ptr<const Snapshot> at_plan_;
  const PrunePlan plan_;
  const BatchHeader header_;
  std::set<NodeId> gone_;
  std::set<NodeId> kept_nodes_;
  std::set<NodeId> kept_tracks_;
  std::set<BlockIndex> kept_blocks_;
  size_t step_count_ = 0;
  size_t step_ = 0;
  size_t rows_ = 0;
  int64_t part_ = 0;
  size_t next_removed_ = 0;
  size_t next_cut_ = 0;
  size_t next_track_ = 0;
  std::unique_ptr<TrackBatches> track_;
  size_t next_stay_ = 0;
  size_t next_edit_ = 0;
  size_t next_node_ = 0;
  bool edges_are_gone_ = false;
};

PruneBatches::PruneBatches(std::shared_ptr<const Snapshot> at_plan, PrunePlan plan,
                           BatchHeader header)
    : impl_(std::make_unique<Impl>(std::move(at_plan), std::move(plan), std::move(header))) {}

PruneBatches::~PruneBatches() = default;

absl::StatusOr<std::optional<GraphDelta>> PruneBatches::Next(const Snapshot& head,
                                                             const StopCheck& stop) {
  return impl_->Next(head, stop);
}

void PruneBatches::Avoid(const Touched& touched) { impl_->Avoid(touched); }

double PruneBatches::progress() const { return impl_->progress(); }

const PrunePlan& PruneBatches::plan() const { return impl_->plan(); }

}  // namespace dsg
