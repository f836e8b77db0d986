// SPDX-License-Identifier: Apache-2.0
// Compaction and erasure. What the records of revisions say afterwards is counted anew from the
// rows that are left.
#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/memory/memory_writer.h"
#include "schema/store/track_rules.h"

namespace dsg::memory {
namespace {

constexpr Revision kNow = kRevisionMax - 1;

// Records of revisions that go leave their digest and their touched keys to the next one that
// stays. Of the first that stays nothing before can be asked, so it needs no list.
int64_t DropCommits(const Readable& kept, MapRows* rows) {
  int64_t count = 0;
  bool has_kept = false;
  bool is_after_gap = false;
  TouchedKeys touched;
  Sha256 digest{};
  for (auto it = rows->commits.begin(); it != rows->commits.end() && it->first <= kept.oldest;) {
    Commit& commit = it->second;
    if (!kept.Holds(it->first)) {
      digest = commit.record.info.digest;
      if (commit.touched.has_value()) touched.Add(*commit.touched);
      is_after_gap = true;
      ++count;
      it = rows->commits.erase(it);
      continue;
    }
    if (is_after_gap) {
      commit.parent = digest;
      if (commit.touched.has_value()) touched.Add(*commit.touched);
      touched.Normalize();
      commit.touched = has_kept ? std::optional<TouchedKeys>(touched) : std::nullopt;
    }
    touched = {};
    is_after_gap = false;
    has_kept = true;
    ++it;
  }
  return count;
}

template <typename Key, typename Value>
int64_t DropUnshown(const Readable& kept, Versions<Key, Value>* versions) {
  return versions->EraseIf(
      [&](const Key&, const auto& version) { return !kept.HoldsAnyOf(version.from, version.to); });
}

class Eraser {
 public:
  Eraser(const StopCheck& stop, MapRows* rows, EraseReport* report)
      : stop_(stop), rows_(*rows), report_(*report) {}

  absl::Status Run(const Erasure& erasure) {
    for (const NodeId id : erasure.nodes) {
      if (IsAgentThatIsThere(id)) return AgentIsThereError(rows_.spec.name, id);
    }
    DSG_RETURN_IF_ERROR(Begin(erasure));
    DSG_RETURN_IF_ERROR(AskStop(stop_));
    for (const NodeId id : list_.keys.nodes) DSG_RETURN_IF_ERROR(EraseNode(id));
    for (const EdgeRowKey& key : list_.keys.edges) EraseEdge(key);
    for (const BlockIndex& index : list_.keys.mesh_blocks) EraseMeshBlock(index);
    for (const TrackSpan& span : list_.spans) DSG_RETURN_IF_ERROR(EraseSpan(span));
    if (list_.assets) EraseAssets();
    MakeRecordsRight();
    rows_.pending_erasure = {};
    if (!report_.is_pending) rows_.is_erasing = false;
    return absl::OkStatus();
  }

 private:
  bool IsAgentThatIsThere(NodeId id) const {
    const auto node = rows_.NodeAt(id, kNow);
    return node.has_value() && IsAgentKind(node->kind);
  }

  // What is believed as it was when an erasure was noted.
  BelievedSince BelievedIn(Revision planned_at) const {
    const auto is_old = [planned_at](const auto* version) -> absl::StatusOr<bool> {
      return version != nullptr && version->from <= planned_at;
    };
    return {
        [this, is_old](NodeId id) { return is_old(rows_.nodes.Current(id)); },
        [this, is_old](const EdgeRowKey& key) { return is_old(CurrentEdge(key)); },
        [this, is_old](const BlockIndex& index) {
          return is_old(rows_.mesh_blocks.Current(index));
        },
        [this, planned_at](const TrackSpan& span) -> absl::StatusOr<bool> {
          const auto track = rows_.tracks.find(span.agent);
          bool is_believed = false;
          if (track == rows_.tracks.end()) return false;
          track->second.ForEachAt(kNow, [&](TimeNs time_ns, const Track::Version& pose) {
            is_believed |= Holds(span, time_ns) && pose.from <= planned_at;
          });
          return is_believed;
        },
    };
  }

  absl::Status Begin(const Erasure& erasure) {
    report_.was_pending = rows_.is_erasing;
    DSG_ASSIGN_OR_RETURN(
        list_, ListOf(erasure, [&](const std::string& name) { return rows_.FindRelation(name); }));
    EraseList earlier = rows_.pending_erasure;
    std::vector<NotedErasure> left;
    for (const NotedErasure& noted : rows_.noted_erasures) {
      DSG_ASSIGN_OR_RETURN(const RipeAndRest sorted,
                           SortByRipeness(noted.list, list_, BelievedIn(noted.planned_at)));
      earlier.Add(sorted.ripe);
      if (sorted.rest.size() > 0) left.push_back({noted.planned_at, sorted.rest});
    }
    report_.is_pending = !left.empty();
    rows_.noted_erasures = std::move(left);
    list_.Add(earlier);
    if (list_.size() > 0) {
      rows_.is_erasing = true;
      rows_.pending_erasure = list_;
      // What was erased must not be told from its checksum.
      for (auto& [revision, commit] : rows_.commits) commit.delta_checksum = std::nullopt;
      for (auto& [id, session] : rows_.sessions) session.last_checksum = std::nullopt;
    }
    // Since the earlier erasures began.
    for (const NodeId id : earlier.keys.nodes) {
      if (IsAgentThatIsThere(id)) report_.left_agents.push_back(id);
    }
    std::erase_if(list_.keys.nodes, [&](NodeId id) {
      return std::binary_search(report_.left_agents.begin(), report_.left_agents.end(), id);
    });
    return absl::OkStatus();
  }

  const Versions<EdgeKey, StoredEdge>::Version* CurrentEdge(const EdgeRowKey& key) const {
    for (const auto& [name, number] : rows_.relations) {
      if (number == key.relation) return rows_.edges.Current({key.source, name, key.target});
    }
    return nullptr;
  }

  // Takes out the past versions of which `goes` is true.
  template <typename Key, typename Value, typename Goes>
  void ErasePast(Versions<Key, Value>* versions, const Goes& goes) {
    const int64_t count = versions->EraseIf([&](const Key& key, const auto& version) {
      return !version.is_current() && goes(key, version);
    });
    report_.row_count += count;
    is_changed_ |= count > 0;
  }

  absl::Status EraseNode(NodeId id) {
    ErasePast(&rows_.nodes, [&](NodeId key, const auto& version) {
      if (key != id) return false;
      for (const Sha256& asset : AssetsOf(version.value.node)) doubtful_.insert(asset);
      return true;
    });
    const auto* const current = rows_.nodes.Current(id);
    const Revision since = current == nullptr ? 0 : current->from;
    forgotten_.ForgetNode(id, since);
    ErasePast(&rows_.edges, [&](const EdgeKey& key, const auto&) {
      return key.source == id || key.target == id;
    });
    ErasePast(&rows_.stays, [&](const StayKey&, const auto& stay) {
      return stay.value.room == id || stay.value.place == id;
    });
    if (since == 0) return EraseGoneAgent(id);
    // Edges that stay were believed when the node was another: they begin with what it is now.
    rows_.edges.Change([&](const EdgeKey& key, auto& edge) {
      if (!edge.is_current() || (key.source != id && key.target != id)) return;
      if (edge.from < since) {
        edge.from = edge.value.edge.revision = since;
        is_changed_ = true;
      }
      forgotten_.ForgetEdge({key.source, edge.value.relation, key.target}, edge.from);
    });
    return absl::OkStatus();
  }

  absl::Status EraseGoneAgent(NodeId agent) {
    ErasePast(&rows_.stays, [&](const StayKey& key, const auto&) { return key.agent == agent; });
    const auto of_agent = [&](int64_t, const Batches::Version& batch) {
      return batch.value.agent == agent;
    };
    rows_.shapes.ForEach([&](int64_t id, const Batches::Version& batch) {
      if (of_agent(id, batch)) CollectTopology(batch);
    });
    int64_t count = rows_.factors.EraseIf(of_agent) + rows_.shapes.EraseIf(of_agent);
    const auto track = rows_.tracks.find(agent);
    if (track != rows_.tracks.end()) {
      track->second.ForEach([&](TimeNs, const auto&) { ++report_.pose_count; });
      forgotten_.ForgetTrack(agent);
      rows_.tracks.erase(track);
      ++count;
    }
    report_.row_count += count;
    is_changed_ |= count > 0;
    return absl::OkStatus();
  }

  void EraseEdge(const EdgeRowKey& key) {
    ErasePast(&rows_.edges, [&](const EdgeKey& other, const auto& edge) {
      return other.source == key.source && other.target == key.target &&
             edge.value.relation == key.relation;
    });
    const auto* const current = CurrentEdge(key);
    forgotten_.ForgetEdge(key, current == nullptr ? 0 : current->from);
  }

  void EraseMeshBlock(const BlockIndex& index) {
    ErasePast(&rows_.mesh_blocks,
              [&](const BlockIndex& other, const auto&) { return other == index; });
    const auto* const current = rows_.mesh_blocks.Current(index);
    forgotten_.ForgetMeshBlock(index, current == nullptr ? 0 : current->from);
  }

  absl::Status EraseSpan(const TrackSpan& span) {
    ErasePast(&rows_.stays, [&](const StayKey& key, const auto& stay) {
      return key.agent == span.agent && key.enter_ns < span.to_ns &&
             (key.enter_ns >= span.from_ns || BelievedExit(stay) > span.from_ns);
    });
    DSG_RETURN_IF_ERROR(CutShapes(span));
    DSG_RETURN_IF_ERROR(CutFactors(span));
    const auto track = rows_.tracks.find(span.agent);
    if (track == rows_.tracks.end()) return absl::OkStatus();
    const int64_t before = report_.row_count;
    ErasePast(&track->second, [&](TimeNs time_ns, const auto&) { return Holds(span, time_ns); });
    report_.pose_count += report_.row_count - before;
    return absl::OkStatus();
  }

  // A stay that was open reached as far as the track when it was believed.
  TimeNs BelievedExit(const Versions<StayKey, Stay>::Version& stay) const {
    const auto track = rows_.tracks.find(stay.value.agent);
    if (track == rows_.tracks.end()) return stay.value.exit_ns;
    const auto span = MapRows::SpanOf(track->second, stay.to - 1);
    return span.has_value() ? std::min(stay.value.exit_ns, span->to_ns + 1) : stay.value.exit_ns;
  }

  void CollectTopology(const Batches::Version& batch) {
    std::optional<Sha256> topology;
    if (DecodeShapeTopology(batch.value.payload, &topology) && topology.has_value()) {
      doubtful_.insert(*topology);
    }
  }

  // A batch of which a part goes is written anew in its place, at the same revisions.
  void Replace(int64_t id, const StoredBatch& rest, Batches* batches) {
    batches->Change([&](int64_t other, Batches::Version& batch) {
      if (other == id) batch.value = rest;
    });
    if (rest.payload.empty())
      batches->EraseIf([&](int64_t other, const auto&) { return other == id; });
    ++report_.row_count;
    is_changed_ = true;
  }

  static std::vector<std::pair<int64_t, Batches::Version>> PastBatches(const Batches& batches,
                                                                       const TrackSpan& span) {
    std::vector<std::pair<int64_t, Batches::Version>> past;
    batches.ForEach([&](int64_t id, const Batches::Version& batch) {
      const bool is_near =
          batch.value.agent == span.agent && MayTouch(span, batch.value.t0, batch.value.t1);
      if (is_near && !batch.is_current()) past.emplace_back(id, batch);
    });
    return past;
  }

  absl::Status CutShapes(const TrackSpan& span) {
    for (const auto& [id, batch] : PastBatches(rows_.shapes, span)) {
      DecodedShapes decoded;
      if (!DecodeShapes(batch.value.payload, /*with_vertices=*/true, &decoded)) {
        return absl::InternalError("cannot decode shapes in memory; report this");
      }
      ShapeAppend rest{span.agent, decoded.topology, std::move(decoded.shapes)};
      const auto gone = std::erase_if(
          rest.shapes, [&](const BodyShape& shape) { return Holds(span, shape.time_ns); });
      if (gone == 0) continue;
      CollectTopology(batch);
      StoredBatch left{span.agent, 0, 0, ""};
      if (!rest.shapes.empty()) {
        left = {span.agent, rest.shapes.front().time_ns, rest.shapes.back().time_ns,
                EncodeShapes(rest, rows_.spec.codec)};
      }
      Replace(id, left, &rows_.shapes);
    }
    return absl::OkStatus();
  }

  absl::Status CutFactors(const TrackSpan& span) {
    for (const auto& [id, batch] : PastBatches(rows_.factors, span)) {
      std::vector<PoseFactor> factors;
      if (!DecodeFactors(batch.value.payload, &factors)) {
        return absl::InternalError("cannot decode factors in memory; report this");
      }
      const auto gone =
          std::erase_if(factors, [&](const PoseFactor& factor) { return Touches(factor, span); });
      if (gone == 0) continue;
      const BatchTimes times = TimesOf(factors);
      StoredBatch left{span.agent, times.t0, times.t1, ""};
      if (!factors.empty()) left.payload = EncodeFactors(factors);
      Replace(id, left, &rows_.factors);
    }
    return absl::OkStatus();
  }

  // Those that rows referred to which are gone now, and none that is left; and old ones to which
  // nothing refers. A new one may be about to be referred to.
  void EraseAssets() {
    const std::set<Sha256> used = ReferredAssets(rows_);
    std::erase_if(rows_.assets, [&](const auto& asset) {
      const bool is_old = asset.second.from < rows_.oldest || doubtful_.contains(asset.first);
      if (!is_old || used.contains(asset.first)) return false;
      ++report_.asset_count;
      return is_changed_ = true;
    });
  }

  void MakeRecordsRight() {
    Revision before = 0;
    for (auto& [revision, commit] : rows_.commits) {
      if (commit.touched.has_value()) {
        is_changed_ |= forgotten_.Edit(before, revision, &*commit.touched);
      }
      before = revision;
    }
    // Readers need not begin again when there was nothing to forget.
    if (!is_changed_) return;
    ++rows_.generation;
    const std::map<Revision, RowSums> changes = rows_.SumChanges();
    auto change = changes.begin();
    RowSums sums;
    before = 0;
    Sha256 parent{};
    for (auto& [revision, commit] : rows_.commits) {
      for (; change != changes.end() && change->first <= revision; ++change) sums += change->second;
      RevisionRecord& record = commit.record;
      record.sums = sums;
      const auto span = rows_.SpanOfAll(revision);
      record.first_pose_ns = record.last_pose_ns = std::nullopt;
      if (span.has_value()) record.first_pose_ns = span->from_ns;
      if (span.has_value()) record.last_pose_ns = span->to_ns;
      // Over a gap the digest of the revision before is the one that compaction left.
      if (revision == before + 1) commit.parent = parent;
      Seal(commit.parent, &record);
      parent = record.info.digest;
      before = revision;
    }
  }

  const StopCheck& stop_;
  MapRows& rows_;
  EraseReport& report_;
  /// What is named, and what earlier erasures left.
  EraseList list_;
  ForgottenKeys forgotten_;
  /// Assets to which rows referred that are gone.
  std::set<Sha256> doubtful_;
  bool is_changed_ = false;
};

}  // namespace

std::set<Sha256> ReferredAssets(const MapRows& rows) {
  std::set<Sha256> assets;
  rows.nodes.ForEach([&](NodeId, const auto& version) {
    for (const Sha256& asset : AssetsOf(version.value.node)) assets.insert(asset);
  });
  rows.shapes.ForEach([&](int64_t, const Batches::Version& batch) {
    std::optional<Sha256> topology;
    if (DecodeShapeTopology(batch.value.payload, &topology) && topology.has_value()) {
      assets.insert(*topology);
    }
  });
  return assets;
}

CompactReport CompactRows(Revision keep_from, MapRows* rows) {
  CompactReport report;
  report.oldest = rows->oldest = keep_from;
  const Readable kept = rows->ReadableNow();
  report.revision_count = DropCommits(kept, rows);
  report.row_count = DropUnshown(kept, &rows->nodes) + DropUnshown(kept, &rows->edges) +
                     DropUnshown(kept, &rows->stays) + DropUnshown(kept, &rows->mesh_blocks) +
                     DropUnshown(kept, &rows->factors) + DropUnshown(kept, &rows->shapes);
  for (auto& [agent, track] : rows->tracks) report.row_count += DropUnshown(kept, &track);
  // Those that nothing refers to any more; one of the newest revisions may be about to be referred
  // to. They go on counting in the digests of the revisions that are kept.
  const std::set<Sha256> used = ReferredAssets(*rows);
  std::erase_if(rows->assets, [&](const auto& asset) {
    if (asset.second.from >= keep_from || used.contains(asset.first)) return false;
    rows->dropped_assets.emplace(asset.second.from, asset.first);
    ++report.asset_count;
    return true;
  });
  return report;
}

absl::StatusOr<EraseReport> EraseRows(const Erasure& erasure, const StopCheck& stop,
                                      MapRows* rows) {
  EraseReport report;
  DSG_RETURN_IF_ERROR(Eraser(stop, rows, &report).Run(erasure));
  return report;
}

}  // namespace dsg::memory
