// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/merge_deltas.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <set>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/status.h"
#include "schema/merge/agent_copy.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {
namespace {

std::set<Sha256> AssetsOfNodes(const GraphDelta& graph) {
  std::set<Sha256> assets;
  for (const Node& node : graph.nodes) {
    for (const Sha256& asset : AssetsOf(node)) assets.insert(asset);
  }
  return assets;
}

std::string TitleOf(const MergePlan& plan) {
  return absl::StrCat("merge of ", plan.other_name, " revision ", plan.other_revision);
}

// In the format of `dsg merge --transform`.
std::string DescribeForCommand(const Pose3d& pose) {
  const Eigen::Vector3d& p = pose.position;
  const Eigen::Quaterniond& q = pose.orientation;
  const std::string position = absl::StrFormat("%.4f,%.4f,%.4f", p.x(), p.y(), p.z());
  if (TiltOf(pose) < 1e-6) {
    return absl::StrFormat("%s,%.6f", position, 2.0 * std::atan2(q.z(), q.w()));
  }
  return absl::StrFormat("%s,%.8f,%.8f,%.8f,%.8f", position, q.x(), q.y(), q.z(), q.w());
}

// Finds out whether a delta depends on what others have changed.
class ConflictFinder {
 public:
  explicit ConflictFinder(const Touched& touched)
      : nodes_(touched.nodes.begin(), touched.nodes.end()),
        has_new_numbers_(touched.layers_or_labels) {
    for (const EdgeKey& key : touched.edges) {
      edges_.insert(key);
      if (key.relation == relations::kContains) children_.insert(key.target);
    }
  }

  bool IsIn(const GraphDelta& delta) const {
    if (has_new_numbers_ && !delta.nodes.empty()) return true;
    const auto is_touched_node = [&](const Node& node) { return nodes_.contains(node.id); };
    const auto is_touched_edge = [&](const Edge& edge) {
      return nodes_.contains(edge.source) || nodes_.contains(edge.target) ||
             edges_.contains(edge.key()) ||
             (edge.relation == relations::kContains && children_.contains(edge.target));
    };
    return std::any_of(delta.nodes.begin(), delta.nodes.end(), is_touched_node) ||
           std::any_of(delta.edges.begin(), delta.edges.end(), is_touched_edge);
  }

 private:
  std::set<NodeId> nodes_;
  std::set<EdgeKey> edges_;
  /// Nodes that gained or lost a parent.
  std::set<NodeId> children_;
  bool has_new_numbers_;
};

size_t RowsOf(const MeshBlock& block) { return block.positions_map.size() + block.faces.size(); }

}  // namespace

class MergeDeltas::Impl {
 public:
  Impl(std::shared_ptr<const Snapshot> into, std::shared_ptr<const Snapshot> other, MergePlan plan,
       std::string author, int64_t part_count)
      : into_(std::move(into)),
        other_(std::move(other)),
        plan_(std::move(plan)),
        mesh_(into_, other_, plan_.map_T_other, {plan_.class_of, plan_.instance_of}, plan_.mesh),
        part_count_(part_count) {
    header_.map = plan_.into_name;
    header_.session_id = absl::StrCat("merge/", plan_.other_name, "@", plan_.other_revision, "/",
                                      plan_.into_revision);
    header_.author = std::move(author);
    header_.message = TitleOf(plan_);
    header_.parent_revision = plan_.into_revision;
    for (const auto& [theirs, mine] : plan_.node_ids) agents_left_.emplace_back(theirs, mine);
  }

  absl::StatusOr<std::optional<GraphDelta>> Next(const StopCheck& stop) {
    if (!is_graph_ready_) DSG_RETURN_IF_ERROR(PrepareGraph());
    while (queue_.empty()) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      DSG_ASSIGN_OR_RETURN(const bool is_done, ReadMore(stop));
      if (is_done && queue_.empty()) return std::optional<GraphDelta>();
    }
    GraphDelta delta = std::move(queue_.front());
    queue_.pop_front();
    delta.map = header_.map;
    delta.session_id = header_.session_id;
    delta.author = header_.author;
    delta.message = absl::StrCat(header_.message, ", part ", ++part_count_);
    // Stated once, so that the merge can be repeated by hand.
    if (part_count_ == 1)
      absl::StrAppend(&delta.message, " at ", DescribeForCommand(plan_.map_T_other), Kept());
    delta.parent_revision = header_.parent_revision;
    delta.sequence = ++sequence_;
    // Only the first delta knows its parent; the caller sets those of the others.
    header_.parent_revision.reset();
    return std::optional<GraphDelta>(std::move(delta));
  }

  absl::StatusOr<bool> Follow(const std::shared_ptr<const Snapshot>& head, const Touched& touched) {
    if (!is_graph_ready_) DSG_RETURN_IF_ERROR(PrepareGraph());
    const ConflictFinder conflicts(touched);
    for (const GraphDelta& delta : queue_) {
      if (conflicts.IsIn(delta)) return false;
    }
    for (const NodeId mine : touched.tracks) DSG_RETURN_IF_ERROR(CheckTrackOf(mine));
    DSG_RETURN_IF_ERROR(mesh_.Follow(head, touched.mesh_blocks));
    return true;
  }

  double progress() const {
    if (!is_graph_ready_ || !queue_.empty()) return 0.05;
    const double agents =
        1.0 - static_cast<double>(agents_left_.size()) /
                  std::max<double>(1.0, static_cast<double>(plan_.node_ids.size()));
    return 0.1 + 0.4 * agents + 0.5 * mesh_.progress();
  }

  const MergePlan& plan() const { return plan_; }
  const MeshJoin& mesh() const { return mesh_; }

 private:
  std::string Kept() const {
    const int64_t count = plan_.counts.kept_count;
    if (count == 0) return "";
    return absl::StrCat("; nodes that were changed here since they were copied, and stay: ", count);
  }

  absl::Status PrepareGraph() {
    for (const Sha256& sha256 : AssetsOfNodes(plan_.graph)) DSG_RETURN_IF_ERROR(QueueAsset(sha256));
    if (!plan_.graph.empty()) {
      for (GraphDelta& part : SplitDelta(plan_.graph, plan_.batch_row_count)) {
        queue_.push_back(std::move(part));
      }
    }
    is_graph_ready_ = true;
    return absl::OkStatus();
  }

  // Fails if others have extended an agent of which the other map has more poses to write.
  absl::Status CheckTrackOf(NodeId mine) const {
    const auto known = into_->GetTrack(mine);
    if (!known.ok()) return absl::OkStatus();
    for (const auto& [theirs_id, mine_id] : plan_.node_ids) {
      if (mine_id != mine) continue;
      DSG_ASSIGN_OR_RETURN(const TrackInfo theirs, other_->GetTrack(theirs_id));
      const bool has_more =
          theirs.pose_count > 0 && (known->pose_count == 0 || theirs.last_ns > known->last_ns);
      if (!has_more) continue;
      return MakeError(Reason::kParentRevisionStale,
                       absl::StrCat("agent ", ToString(mine), " \"", known->name, "\" of map \"",
                                    plan_.into_name,
                                    "\" was written by others while its track was to go on with ",
                                    "that of map \"", plan_.other_name,
                                    "\"; stop its writer, or give one of them another name"),
                       {{"map", plan_.into_name}, {"agent", ToString(mine)}});
    }
    return absl::OkStatus();
  }

  // Assets may be large, so each has its own delta.
  absl::Status QueueAsset(const Sha256& sha256) {
    if (into_->ReadAsset(sha256).ok()) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(Asset asset, other_->ReadAsset(sha256));
    GraphDelta delta;
    delta.assets.push_back(std::move(asset));
    queue_.push_back(std::move(delta));
    return absl::OkStatus();
  }

  // Returns true when nothing is left.
  absl::StatusOr<bool> ReadMore(const StopCheck& stop) {
    if (agent_ != nullptr) {
      DSG_ASSIGN_OR_RETURN(std::optional<GraphDelta> delta, agent_->Next(stop));
      if (!delta.has_value()) {
        agent_.reset();
        return false;
      }
      for (const Sha256& topology : agent_->TakeTopologies()) {
        DSG_RETURN_IF_ERROR(QueueAsset(topology));
      }
      queue_.push_back(*std::move(delta));
      return false;
    }
    while (!agents_left_.empty()) {
      const auto [theirs, mine] = agents_left_.front();
      agents_left_.pop_front();
      DSG_ASSIGN_OR_RETURN(const Node node, other_->GetNode(theirs));
      if (!IsAgentKind(node.kind)) continue;
      agent_ = std::make_unique<AgentCopy>(*into_, *other_, plan_, theirs, mine);
      return false;
    }
    return ReadMesh(stop);
  }

  absl::StatusOr<bool> ReadMesh(const StopCheck& stop) {
    GraphDelta delta;
    size_t row_count = 0;
    while (row_count < kMeshRowsMax) {
      DSG_ASSIGN_OR_RETURN(std::optional<MeshBlock> block, mesh_.Next(stop));
      if (!block.has_value()) break;
      row_count += RowsOf(*block);
      delta.mesh_blocks.push_back(*std::move(block));
    }
    if (delta.mesh_blocks.empty()) return true;
    queue_.push_back(std::move(delta));
    return false;
  }

  static constexpr size_t kMeshRowsMax = 200'000;

  std::shared_ptr<const Snapshot> into_;
  std::shared_ptr<const Snapshot> other_;
  MergePlan plan_;
  MeshJoin mesh_;
  GraphDelta header_;
  int64_t sequence_ = 0;
  int64_t part_count_;
  bool is_graph_ready_ = false;
  std::deque<GraphDelta> queue_;
  std::deque<std::pair<NodeId, NodeId>> agents_left_;
  std::unique_ptr<AgentCopy> agent_;
};

MergeDeltas::MergeDeltas(std::shared_ptr<const Snapshot> into,
                         std::shared_ptr<const Snapshot> other, MergePlan plan, std::string author,
                         int64_t part_count)
    : impl_(std::make_unique<Impl>(std::move(into), std::move(other), std::move(plan),
                                   std::move(author), part_count)) {}
MergeDeltas::~MergeDeltas() = default;

const MergePlan& MergeDeltas::plan() const { return impl_->plan(); }
absl::StatusOr<std::optional<GraphDelta>> MergeDeltas::Next(const StopCheck& stop) {
  return impl_->Next(stop);
}
absl::StatusOr<bool> MergeDeltas::Follow(const std::shared_ptr<const Snapshot>& head,
                                         const Touched& touched) {
  return impl_->Follow(head, touched);
}
double MergeDeltas::progress() const { return impl_->progress(); }
int64_t MergeDeltas::fused_mesh_block_count() const { return impl_->mesh().fused_block_count(); }

}  // namespace dsg::merge
