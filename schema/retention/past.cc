// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/past.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/retention/graph_index.h"
#include "schema/retention/selection.h"

namespace dsg {
namespace {

constexpr int kPage = 500;

// Calls `visit` for readable revisions below `before`, newest first, until it returns false.
template <class Visit>
absl::Status ForEachBefore(MapReader* reader, Revision before, const StopCheck& stop,
                           const Visit& visit) {
  while (before > 1) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const std::vector<RevisionInfo> page,
                         reader->ListRevisions(before, kPage));
    if (page.empty()) return absl::OkStatus();
    for (const RevisionInfo& info : page) {
      if (!visit(info)) return absl::OkStatus();
    }
    before = page.back().revision;
  }
  return absl::OkStatus();
}

// Adds up the wall clock from commit to commit, backwards from now.
class AgeOfRevisions {
 public:
  explicit AgeOfRevisions(int64_t wall_now_ns) : before_ns_(wall_now_ns) {}

  /// The least age of a revision. Call in order, newest first.
  int64_t Next(const RevisionInfo& info) {
    // Unsigned, because stamps are arbitrary and the signed difference may overflow.
    const bool is_back = info.committed_ns > before_ns_;
    const uint64_t step_ns =
        static_cast<uint64_t>(before_ns_) - static_cast<uint64_t>(info.committed_ns);
    if (!is_back && step_ns <= static_cast<uint64_t>(kClockLeapMaxNs)) {
      age_ns_ += static_cast<int64_t>(step_ns);
    } else {
      ++leap_count_;
      leap_after_ = info.revision;
    }
    before_ns_ = info.committed_ns;
    return age_ns_;
  }

  std::string Note() const {
    if (leap_count_ == 0) return "";
    return absl::StrCat("the wall clock went back, or on by more than a week, ", leap_count_,
                        leap_count_ == 1 ? " time" : " times", ", first after revision ",
                        leap_after_, "; ages of revisions count without that");
  }

 private:
  int64_t before_ns_;
  int64_t age_ns_ = 0;
  int64_t leap_count_ = 0;
  Revision leap_after_ = 0;
};

// Whether something of a block may be in a solid. Faces may reach into the next block.
bool IsNear(const BlockIndex& block, const Solid& solid, double size_m) {
  const Eigen::Vector3d low(block.x - 1.0, block.y - 1.0, block.z - 1.0);
  return solid.box_map.intersects(Box3d(low * size_m, (low.array() + 3.0).matrix() * size_m));
}

class PastSearch {
 public:
  PastSearch(MapReader* reader, const Snapshot& head, const GraphIndex& index,
             const PrunePolicy& policy, const StopCheck& stop, Erasure* erasure)
      : reader_(*reader),
        head_(head),
        index_(index),
        policy_(policy),
        stop_(stop),
        erasure_(*erasure),
        cutoff_(CutoffOf(policy, index.clock())) {}

  absl::Status Run() {
    DSG_ASSIGN_OR_RETURN(layers_, LayerSet::Of(policy_, head_));
    const auto* layer = std::get_if<PrunePolicy::WholeLayer>(&policy_.what);
    is_all_mesh_ = layer != nullptr && layer->name == "mesh";
    DSG_ASSIGN_OR_RETURN(const auto revisions,
                         ReadableRevisions(&reader_, head_.revision(), stop_));
    if (const auto* region = std::get_if<PrunePolicy::Region>(&policy_.what)) {
      solids_.push_back({region->box_map, {}});
    }
    TakeSpansOfAll(index_.tracks());
    for (size_t i = 1; i < revisions.size(); ++i) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      DSG_ASSIGN_OR_RETURN(const Touched touched,
                           reader_.TouchedBetween(revisions[i - 1], revisions[i], stop_));
      blocks_.insert(touched.mesh_blocks.begin(), touched.mesh_blocks.end());
      DSG_RETURN_IF_ERROR(LookBefore(revisions[i - 1], touched));
    }
    TakeBlocks();
    return absl::OkStatus();
  }

 private:
  bool MeansMesh() const {
    return !policy_.IsThinning() && (layers_.Holds(layers::kMesh)) &&
           (is_all_mesh_ || !solids_.empty());
  }

  absl::Status LookBefore(Revision revision, const Touched& touched) {
    std::vector<NodeId> dead;
    for (const NodeId id : touched.nodes) {
      if (index_.Find(id) < 0) dead.push_back(id);
    }
    const bool asks_region = std::holds_alternative<PrunePolicy::Region>(policy_.what) &&
                             !touched.corrected_tracks.empty() && layers_.Holds(layers::kAgents);
    if (dead.empty() && !asks_region) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> before, reader_.At(revision));
    DSG_RETURN_IF_ERROR(TakeDead(*before, dead));
    return asks_region ? TakeVisits(*before, touched.corrected_tracks) : absl::OkStatus();
  }

  // Nodes by their last state: those before a revision that are missing after it.
  absl::Status TakeDead(const Snapshot& before, const std::vector<NodeId>& dead) {
    if (dead.empty()) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const auto nodes, before.FindNodes(dead, stop_));
    for (const auto& node : nodes) {
      if (!node.has_value()) continue;
      if (IsAgentKind(node->kind)) DSG_RETURN_IF_ERROR(TakeSpans(before, node->id));
      if (policy_.IsThinning() || !layers_.Holds(node->layer)) continue;
      DSG_ASSIGN_OR_RETURN(const bool matches, Matches(before, *node));
      if (!matches) continue;
      erasure_.nodes.push_back(node->id);
      const bool is_branch = std::holds_alternative<PrunePolicy::Branch>(policy_.what);
      if (auto space = SpaceOf(*node); space && is_branch) solids_.push_back(*std::move(space));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<bool> Matches(const Snapshot& before, const Node& node) {
    const bool is_agent = IsAgentKind(node.kind);
    if (const auto* branch = std::get_if<PrunePolicy::Branch>(&policy_.what)) {
      return IsInBranch(before, node, branch->id_or_name);
    }
    if (const auto* region = std::get_if<PrunePolicy::Region>(&policy_.what)) {
      return !is_agent && region->box_map.contains(node.map_T_node.position);
    }
    if (const auto* layer = std::get_if<PrunePolicy::WholeLayer>(&policy_.what)) {
      DSG_ASSIGN_OR_RETURN(const Layer found, head_.FindLayer(layer->name));
      return node.layer == found.id;
    }
    const std::optional<TimeNs> cutoff = is_agent ? CutoffOfAgent(node.id) : cutoff_;
    if (!cutoff.has_value()) return false;
    std::optional<TimeNs> seen = node.last_observed_ns;
    if (is_agent) {
      DSG_ASSIGN_OR_RETURN(const TrackInfo track, before.GetTrack(node.id));
      if (track.pose_count > 0) seen = std::max(seen.value_or(track.last_ns), track.last_ns);
    }
    const bool asks_seen = std::holds_alternative<PrunePolicy::UnseenSince>(policy_.what) ||
                           std::holds_alternative<PrunePolicy::UnseenFor>(policy_.what);
    const bool is_unseen = seen.has_value() && *seen < *cutoff;
    return asks_seen ? is_unseen : node.valid.to_ns <= *cutoff || (is_agent && is_unseen);
  }

  // No present node contains it, so one path to the root is enough.
  absl::StatusOr<bool> IsInBranch(const Snapshot& before, const Node& node,
                                  const std::string& id_or_name) {
    const auto root = before.ResolveNode(id_or_name);
    if (!root.ok()) {
      if (ReasonOf(root.status()) == Reason::kNodeUnknown) return false;
      return root.status();
    }
    if (*root == node.id) return true;
    if (IsAgentKind(node.kind)) return false;
    std::vector<NodeId> open = {node.id};
    std::set<NodeId> known = {node.id};
    while (!open.empty()) {
      EdgeFilter filter;
      filter.relation = relations::kContains;
      filter.target = open.back();
      open.pop_back();
      DSG_RETURN_IF_ERROR(before.ScanEdges(filter, std::nullopt, stop_, [&](const Edge& edge) {
        if (known.insert(edge.source).second) open.push_back(edge.source);
        return true;
      }));
    }
    return known.contains(*root);
  }

  bool IsTimed() const {
    return std::holds_alternative<PrunePolicy::Before>(policy_.what) ||
           std::holds_alternative<PrunePolicy::OlderThan>(policy_.what);
  }

  std::optional<TimeNs> CutoffOfAgent(NodeId agent) const {
    return CutoffOf(policy_, index_.clock(), agent);
  }

  void TakeSpansOfAll(const std::vector<TrackInfo>& tracks) {
    if (!layers_.Holds(layers::kAgents) || !IsTimed() || !cutoff_.has_value()) return;
    for (const TrackInfo& track : tracks) {
      erasure_.tracks.push_back({track.agent, kTimeMin, *CutoffOfAgent(track.agent)});
    }
  }

  absl::Status TakeSpans(const Snapshot& before, NodeId agent) {
    if (!layers_.Holds(layers::kAgents)) return absl::OkStatus();
    if (IsTimed() && cutoff_.has_value()) {
      erasure_.tracks.push_back({agent, kTimeMin, *CutoffOfAgent(agent)});
      return absl::OkStatus();
    }
    if (!std::holds_alternative<PrunePolicy::Region>(policy_.what)) return absl::OkStatus();
    return TakeVisits(before, {agent});
  }

  absl::Status TakeVisits(const Snapshot& before, const std::vector<NodeId>& agents) {
    const auto& region = std::get<PrunePolicy::Region>(policy_.what);
    DSG_ASSIGN_OR_RETURN(const std::vector<BoxVisit> visits,
                         before.VisitsToBox(region.box_map, kTimeMin, kTimeMax, stop_));
    for (const BoxVisit& visit : visits) {
      if (std::find(agents.begin(), agents.end(), visit.agent) == agents.end()) continue;
      erasure_.tracks.push_back({visit.agent, visit.enter_ns, visit.exit_ns});
    }
    return absl::OkStatus();
  }

  void TakeBlocks() {
    if (!MeansMesh()) return;
    const double size_m = head_.spec().mesh_block_size_m;
    for (const BlockIndex& block : blocks_) {
      const bool is_near =
          is_all_mesh_ || std::any_of(solids_.begin(), solids_.end(), [&](const Solid& solid) {
            return IsNear(block, solid, size_m);
          });
      if (is_near) erasure_.mesh_blocks.push_back(block);
    }
  }

  MapReader& reader_;
  const Snapshot& head_;
  const GraphIndex& index_;
  const PrunePolicy& policy_;
  const StopCheck& stop_;
  Erasure& erasure_;
  const std::optional<TimeNs> cutoff_;
  LayerSet layers_;
  bool is_all_mesh_ = false;
  std::vector<Solid> solids_;
  std::set<BlockIndex> blocks_;
};

template <typename T, typename KeyOf>
void SortUnique(std::vector<T>* items, const KeyOf& key_of) {
  std::sort(items->begin(), items->end(),
            [&](const T& a, const T& b) { return key_of(a) < key_of(b); });
  items->erase(std::unique(items->begin(), items->end(),
                           [&](const T& a, const T& b) { return key_of(a) == key_of(b); }),
               items->end());
}

}  // namespace

absl::StatusOr<HistoryCut> FindHistoryCut(MapReader* reader, Revision newest,
                                          const PrunePolicy& policy, int64_t wall_now_ns,
                                          const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const Revision oldest, reader->OldestRevision());
  HistoryCut cut;
  cut.keep_from = newest;
  if (const auto* before = std::get_if<PrunePolicy::HistoryBefore>(&policy.what)) {
    // Returns the error for a future revision.
    if (before->revision > newest) DSG_RETURN_IF_ERROR(reader->At(before->revision).status());
    cut.keep_from = std::min(before->revision, newest);
  } else {
    const auto& age = std::get<PrunePolicy::HistoryOlderThan>(policy.what);
    AgeOfRevisions ages(wall_now_ns);
    DSG_RETURN_IF_ERROR(ForEachBefore(reader, newest + 1, stop, [&](const RevisionInfo& info) {
      if (info.revision < oldest || ages.Next(info) > age.age_ns) return false;
      cut.keep_from = info.revision;
      return true;
    }));
    cut.note = ages.Note();
  }
  // Compacted revisions do not come back.
  cut.keep_from = std::max(cut.keep_from, oldest);
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, reader->Tags());
  std::set<Revision> tagged;
  for (const Tag& tag : tags) tagged.insert(tag.revision);
  DSG_RETURN_IF_ERROR(ForEachBefore(reader, cut.keep_from, stop, [&](const RevisionInfo& info) {
    if (info.revision < oldest) return false;
    if (!tagged.contains(info.revision)) ++cut.revision_count;
    return true;
  }));
  return cut;
}

absl::StatusOr<std::vector<Revision>> ReadableRevisions(MapReader* reader, Revision newest,
                                                        const StopCheck& stop) {
  std::vector<Revision> revisions;
  DSG_RETURN_IF_ERROR(ForEachBefore(reader, newest + 1, stop, [&](const RevisionInfo& info) {
    revisions.push_back(info.revision);
    return true;
  }));
  std::reverse(revisions.begin(), revisions.end());
  return revisions;
}

void AddPresent(const GraphIndex& index, const Measured& measured, Erasure* erasure) {
  for (size_t i = 0; i < index.nodes().size(); ++i) {
    if (measured.selection.is_gone[i]) erasure->nodes.push_back(index.nodes()[i].id);
  }
  for (const auto* blocks : {&measured.mesh.removed, &measured.mesh.cut}) {
    erasure->mesh_blocks.insert(erasure->mesh_blocks.end(), blocks->begin(), blocks->end());
  }
  for (const TrackPlan& track : measured.tracks) {
    for (const Interval& span : track.forgotten) {
      erasure->tracks.push_back({track.agent, span.from_ns, span.to_ns});
    }
    if (track.thinned_ns.empty()) continue;
    erasure->tracks.push_back({track.agent, track.thinned_ns.front(), track.thinned_ns.back() + 1});
  }
  erasure->assets = true;
}

absl::Status AddPast(MapReader* reader, const Snapshot& map, const GraphIndex& index,
                     const PrunePolicy& policy, const StopCheck& stop, Erasure* erasure) {
  return PastSearch(reader, map, index, policy, stop, erasure).Run();
}

absl::StatusOr<bool> WasEverThere(MapReader* reader, const Snapshot& map, const PrunePolicy& policy,
                                  const StopCheck& stop) {
  const auto* branch = std::get_if<PrunePolicy::Branch>(&policy.what);
  if (branch == nullptr) return false;
  DSG_ASSIGN_OR_RETURN(const auto revisions, ReadableRevisions(reader, map.revision(), stop));
  for (auto it = revisions.rbegin(); it != revisions.rend(); ++it) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> then, reader->At(*it));
    const auto found = then->ResolveNode(branch->id_or_name);
    if (found.ok()) return true;
    if (ReasonOf(found.status()) != Reason::kNodeUnknown) return found.status();
  }
  return false;
}

void Join(const Erasure& other, Erasure* erasure) {
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  append(other.nodes, &erasure->nodes);
  append(other.edges, &erasure->edges);
  append(other.mesh_blocks, &erasure->mesh_blocks);
  append(other.tracks, &erasure->tracks);
  erasure->assets = erasure->assets || other.assets;
  Normalize(erasure);
}

bool IsEmpty(const Erasure& erasure) {
  return erasure.nodes.empty() && erasure.edges.empty() && erasure.mesh_blocks.empty() &&
         erasure.tracks.empty();
}

void Normalize(Erasure* erasure) {
  SortUnique(&erasure->nodes, [](NodeId id) { return id; });
  SortUnique(&erasure->edges, [](const EdgeKey& key) { return key; });
  SortUnique(&erasure->mesh_blocks, [](const BlockIndex& index) { return index; });
  SortUnique(&erasure->tracks, [](const TrackSpan& span) {
    return std::make_tuple(span.agent, span.from_ns, span.to_ns);
  });
}

}  // namespace dsg
