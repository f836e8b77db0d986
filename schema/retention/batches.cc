// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/batches.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/retention/measure.h"

namespace dsg {
namespace {

// Number of vertices and faces of a block that count as one row.
constexpr size_t kMeshPartsPerRow = 100;

// A correction ends where this many consecutive poses are kept, so that they are not rewritten.
constexpr size_t kKeptRunMax = 500;

}  // namespace

/// The changes of one track, in pieces of bounded size.
class TrackBatches {
 public:
  /// `plan` must outlive this.
  TrackBatches(const Snapshot& map, const TrackPlan& plan) : map_(map), plan_(plan) {}

  /// Adds the next piece, of about `row_count_max` rows. Returns its number of rows; 0 at the end.
  absl::StatusOr<size_t> AddTo(size_t row_count_max, const StopCheck& stop, GraphDelta* delta);

 private:
  struct Piece;
  absl::StatusOr<size_t> AddShapes(size_t row_count_max, const StopCheck& stop, GraphDelta* delta);
  absl::StatusOr<size_t> AddFactors(size_t row_count_max, GraphDelta* delta);
  absl::StatusOr<size_t> AddPoses(size_t row_count_max, const StopCheck& stop, GraphDelta* delta);
  bool Goes(TimeNs time_ns);

  const Snapshot& map_;
  const TrackPlan& plan_;
  size_t shape_span_ = 0;
  TimeNs shapes_from_ns_ = kTimeMin;
  size_t factor_span_ = 0;
  bool poses_are_done_ = false;
  TimeNs poses_from_ns_ = kTimeMin;
  size_t next_span_ = 0;
  size_t next_thinned_ = 0;
};

absl::StatusOr<size_t> TrackBatches::AddTo(size_t row_count_max, const StopCheck& stop,
                                           GraphDelta* delta) {
  if (shape_span_ < plan_.shape_spans.size()) return AddShapes(row_count_max, stop, delta);
  if (factor_span_ < plan_.factor_spans.size()) return AddFactors(row_count_max, delta);
  if (poses_are_done_) return size_t{0};
  return AddPoses(row_count_max, stop, delta);
}

absl::StatusOr<size_t> TrackBatches::AddShapes(size_t row_count_max, const StopCheck& stop,
                                               GraphDelta* delta) {
  const Interval& span = plan_.shape_spans[shape_span_];
  const TimeNs from_ns = std::max(span.from_ns, shapes_from_ns_);
  size_t count = 0;
  TimeNs to_ns = span.to_ns;
  DSG_RETURN_IF_ERROR(map_.ReadShapes(plan_.agent, from_ns, span.to_ns, /*with_vertices=*/false,
                                      stop, [&](const ShownShape& shown) {
                                        if (count == row_count_max) {
                                          to_ns = shown.shape.time_ns;
                                          return false;
                                        }
                                        ++count;
                                        return true;
                                      }));
  delta->shape_removals.push_back({plan_.agent, from_ns, to_ns});
  shapes_from_ns_ = to_ns;
  if (to_ns == span.to_ns) {
    ++shape_span_;
    shapes_from_ns_ = kTimeMin;
  }
  return std::max<size_t>(count, 1);
}

// A whole span at once: the store keeps hundreds of factors per row.
absl::StatusOr<size_t> TrackBatches::AddFactors(size_t row_count_max, GraphDelta* delta) {
  const Interval& span = plan_.factor_spans[factor_span_++];
  DSG_ASSIGN_OR_RETURN(const std::vector<PoseFactor> factors,
                       map_.Factors(plan_.agent, span.from_ns, span.to_ns));
  delta->factor_removals.push_back({plan_.agent, span.from_ns, span.to_ns});
  return std::clamp<size_t>(factors.size(), 1, row_count_max);
}

bool TrackBatches::Goes(TimeNs time_ns) {
  const auto& spans = plan_.forgotten;
  while (next_span_ < spans.size() && spans[next_span_].to_ns <= time_ns) ++next_span_;
  if (next_span_ < spans.size() && spans[next_span_].Contains(time_ns)) return true;
  const auto& thinned = plan_.thinned_ns;
  while (next_thinned_ < thinned.size() && thinned[next_thinned_] < time_ns) ++next_thinned_;
  return next_thinned_ < thinned.size() && thinned[next_thinned_] == time_ns;
}

// From the first to the last dropped pose, with the kept ones between.
struct TrackBatches::Piece {
  TrajectoryCorrection correction;
  size_t row_count = 0;
  /// Kept poses since the last dropped one.
  std::vector<TimedPose> kept;

  void Drop(NodeId agent, TimeNs time_ns) {
    if (row_count == 0) {
      correction.agent = agent;
      correction.from_ns = time_ns;
    } else {
      row_count += kept.size();
      correction.poses.insert(correction.poses.end(), kept.begin(), kept.end());
    }
    kept.clear();
    ++row_count;
    correction.to_ns = time_ns + 1;
  }
};

absl::StatusOr<size_t> TrackBatches::AddPoses(size_t row_count_max, const StopCheck& stop,
                                              GraphDelta* delta) {
  TimeNs from_ns = kTimeMax;
  TimeNs to_ns = kTimeMin;
  if (!plan_.forgotten.empty()) {
    from_ns = plan_.forgotten.front().from_ns;
    to_ns = plan_.forgotten.back().to_ns;
  }
  if (!plan_.thinned_ns.empty()) {
    from_ns = std::min(from_ns, plan_.thinned_ns.front());
    to_ns = std::max(to_ns, plan_.thinned_ns.back() + 1);
  }
  Piece piece;
  poses_are_done_ = true;
  const auto take = [&](const TimedPose& pose) {
    if (Goes(pose.time_ns)) {
      piece.Drop(plan_.agent, pose.time_ns);
    } else if (piece.row_count > 0) {
      piece.kept.push_back(pose);
    }
    const bool is_full = piece.row_count + piece.kept.size() >= row_count_max;
    if (piece.row_count == 0 || (!is_full && piece.kept.size() < kKeptRunMax)) return true;
    poses_from_ns_ = pose.time_ns + 1;
    poses_are_done_ = false;
    return false;
  };
  DSG_RETURN_IF_ERROR(
      map_.ReadPoses(plan_.agent, std::max(from_ns, poses_from_ns_), to_ns, stop, take));
  if (piece.row_count == 0) return size_t{0};
  delta->corrections.push_back(std::move(piece.correction));
  return piece.row_count;
}

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
    // Nodes go last, so that an interrupted prune finds the branch again by its root. Their
    // retirement reads the stays in `head`, so it cannot share a delta with changes of stays.
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

  // A delta cannot retire an agent and correct its track.
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
      // Bounds the bytes of a transaction too.
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
      // The beginning is part of the key.
      if (edit.stay.enter_ns != edit.key.enter_ns) delta->stay_removals.push_back(edit.key);
      delta->stays.push_back(edit.stay);
    }
  }

  absl::Status AddNodes(const Snapshot& head, const StopCheck& stop, GraphDelta* delta) {
    // Changes of a delta take effect only when it is committed.
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

  // Edges of a hub, except those to its parents. Returns true if no more are left.
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

  // Stays that were written after the plan: no stay may refer to a retired node.
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

std::vector<std::string> Contested::Names(size_t count_max) const {
  std::vector<std::string> names;
  for (const NodeId agent : agents) {
    if (names.size() == count_max) return names;
    names.push_back(ToString(agent));
  }
  for (const BlockIndex& block : mesh_blocks) {
    if (names.size() == count_max) return names;
    names.push_back(absl::StrCat(block.x, ",", block.y, ",", block.z));
  }
  return names;
}

void Others::Add(const Touched& touched) {
  nodes_.insert(touched.nodes.begin(), touched.nodes.end());
  tracks_.insert(touched.corrected_tracks.begin(), touched.corrected_tracks.end());
  mesh_blocks_.insert(touched.mesh_blocks.begin(), touched.mesh_blocks.end());
}

Contested Others::FindContested(const PrunePlan& plan, const Erasure& erasure) const {
  std::set<NodeId> erased_agents(erasure.nodes.begin(), erasure.nodes.end());
  for (const TrackSpan& span : erasure.tracks) erased_agents.insert(span.agent);
  Contested contested;
  for (const TrackPlan& track : plan.tracks) {
    if (tracks_.contains(track.agent) && erased_agents.contains(track.agent)) {
      contested.agents.insert(track.agent);
    }
  }
  for (const NodePlan& node : plan.nodes) {
    if (node.is_agent && nodes_.contains(node.id) && erased_agents.contains(node.id)) {
      contested.agents.insert(node.id);
    }
  }
  const std::set<BlockIndex> erased(erasure.mesh_blocks.begin(), erasure.mesh_blocks.end());
  for (const auto* blocks : {&plan.mesh.removed, &plan.mesh.cut}) {
    for (const BlockIndex& block : *blocks) {
      if (mesh_blocks_.contains(block) && erased.contains(block)) {
        contested.mesh_blocks.insert(block);
      }
    }
  }
  return contested;
}

}  // namespace dsg
