// SPDX-License-Identifier: Apache-2.0
#include "schema/store/memory/memory_writer.h"

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/base/time.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/tags.h"
#include "schema/store/track_rules.h"

namespace dsg::memory {
namespace {

// The head of the map, for the commit protocol.
class HeadSource : public CommitSource {
 public:
  explicit HeadSource(const MapRows* rows) : rows_(*rows) {}

  const MapSpec& spec() const override { return rows_.spec; }
  const MapSpec* FindSpec() const override { return &rows_.spec; }
  absl::StatusOr<SessionState> ReadSession(const std::string& session_id) const override {
    const auto found = rows_.sessions.find(session_id);
    return found == rows_.sessions.end() ? SessionState() : found->second.state;
  }
  absl::StatusOr<std::optional<CommittedDelta>> FindCommitted(const std::string& session_id,
                                                              int64_t sequence) const override {
    for (const auto& [revision, commit] : rows_.commits) {
      const RevisionInfo& info = commit.record.info;
      if (info.session_id == session_id && info.sequence == sequence) {
        return std::optional<CommittedDelta>({revision, commit.delta_checksum});
      }
    }
    // The revision may be compacted away; the session's last one holds the delta as well.
    const auto found = rows_.sessions.find(session_id);
    if (found == rows_.sessions.end() || found->second.state.last_sequence < sequence) {
      return std::optional<CommittedDelta>();
    }
    CommittedDelta committed{found->second.state.last_revision, std::nullopt};
    if (found->second.state.last_sequence == sequence) {
      committed.checksum = found->second.last_checksum;
    }
    return std::optional<CommittedDelta>(committed);
  }
  absl::StatusOr<std::optional<Node>> ReadNode(NodeId id) const override {
    return rows_.NodeAt(id, kNow);
  }
  absl::StatusOr<std::optional<Edge>> ReadEdge(const EdgeKey& key) const override {
    const auto* const version = rows_.edges.Current(key);
    if (version == nullptr) return std::optional<Edge>();
    return std::optional<Edge>(version->value.edge);
  }
  absl::StatusOr<std::vector<Layer>> ReadLayers() const override { return rows_.LayersAt(kNow); }

  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override {
    const auto node = rows_.NodeAt(id, kNow);
    if (!node.has_value()) return std::optional<NodeFacts>();
    return std::optional<NodeFacts>(NodeFacts{node->layer, IsAgentKind(node->kind), node->valid,
                                              node->box_node.isEmpty() ? Box3d() : node->BoxMap(),
                                              node->map_T_node.position, node->first_observed_ns,
                                              node->last_observed_ns});
  }
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override {
    for (const auto& [from, layer] : rows_.layers) {
      if (layer.id == id) return std::optional<Layer>(layer);
    }
    return std::optional<Layer>();
  }
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override {
    std::vector<NodeId> parents;
    rows_.edges.ForEachAt(kNow, [&](const EdgeKey& key, const auto&) {
      if (key.target == id && key.relation == relations::kContains) parents.push_back(key.source);
    });
    return parents;
  }
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override {
    std::vector<NodeId> children;
    rows_.edges.ForEachAt(kNow, [&](const EdgeKey& key, const auto&) {
      if (key.source == id && key.relation == relations::kContains) children.push_back(key.target);
    });
    return children;
  }
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const override {
    const auto track = rows_.tracks.find(agent);
    if (track == rows_.tracks.end()) return std::optional<TimeNs>();
    const auto span = MapRows::SpanOf(track->second, kNow);
    return span.has_value() ? std::optional<TimeNs>(span->to_ns) : std::nullopt;
  }
  absl::StatusOr<bool> HasAsset(const Sha256& sha256) const override {
    return rows_.assets.contains(sha256);
  }
  absl::StatusOr<std::optional<Interval>> FindSpan() const override {
    return rows_.SpanOfAll(kNow);
  }

 private:
  static constexpr Revision kNow = kRevisionMax - 1;
  const MapRows& rows_;
};

// The parts of one commit; see ApplyInOrder.
class CommitParts {
 public:
  CommitParts(MapRows* rows, RevisionRecord next)
      : record(std::move(next)), rows_(*rows), now_(record.info.revision) {}

  RevisionRecord record;
  TouchedKeys touched;
  bool are_ends_doubtful = false;

  absl::Status WriteAssets(const std::vector<Asset>& assets) {
    for (const Asset& asset : assets) {
      const auto [it, is_new] = rows_.assets.try_emplace(
          asset.sha256, StoredAsset{now_, asset.media_type, asset.content});
      if (is_new) record.sums.Add(AssetRow{now_, BytesOf(asset.sha256)});
    }
    return absl::OkStatus();
  }

  absl::Status EndAgent(NodeId id) {
    if (rows_.tracks.contains(id)) DSG_RETURN_IF_ERROR(Correct({id, kTimeMin, kTimeMax, {}}));
    std::vector<StayKey> keys;
    rows_.stays.ForEach([&](const StayKey& key, const auto& stay) {
      if (key.agent == id && stay.is_current()) keys.push_back(key);
    });
    DSG_RETURN_IF_ERROR(EndStays(keys));
    DSG_RETURN_IF_ERROR(EndFactors({id}));
    return EndShapes({id});
  }

  absl::Status WriteLayers(const std::vector<Layer>& layers) {
    for (const Layer& layer : layers) {
      const bool is_known = std::any_of(rows_.layers.begin(), rows_.layers.end(),
                                        [&](const auto& one) { return one.second.id == layer.id; });
      if (is_known) continue;
      rows_.layers.emplace_back(now_, layer);
      record.sums.Add(LayerRow{layer.id, layer.rank, now_, layer.name});
      touched.layers_or_labels = true;
    }
    return absl::OkStatus();
  }

  absl::Status WriteLabels(const std::vector<SemanticLabel>& labels) {
    for (const SemanticLabel& label : labels) {
      const auto known = std::find_if(rows_.labels.rbegin(), rows_.labels.rend(),
                                      [&](const auto& one) { return one.second.id == label.id; });
      if (known != rows_.labels.rend() && known->second == label) continue;
      rows_.labels.emplace_back(now_, label);
      record.sums.Add(LabelRow{label.id, now_, label.name});
      touched.layers_or_labels = true;
    }
    return absl::OkStatus();
  }

  absl::Status WriteNodes(const std::vector<Node>& nodes) {
    for (const Node& node : nodes) DSG_RETURN_IF_ERROR(WriteNode(node));
    return absl::OkStatus();
  }

  absl::Status EndEdges(const std::vector<EdgeKey>& keys) {
    for (const EdgeKey& key : keys) EndEdge(key);
    return absl::OkStatus();
  }

  absl::Status Retire(const Retirement& item) {
    const auto* const current = rows_.nodes.Current(item.id);
    if (item.valid_to_ns.has_value()) {
      Node node = current->value.node;
      node.valid.to_ns = *item.valid_to_ns;
      return WriteNode(node);
    }
    EndNode(item.id);
    std::vector<EdgeKey> keys;
    rows_.edges.ForEach([&](const EdgeKey& key, const auto& edge) {
      const bool is_at_node = key.source == item.id || key.target == item.id;
      if (is_at_node && edge.is_current()) keys.push_back(key);
    });
    return EndEdges(keys);
  }

  absl::Status WriteEdges(const std::vector<Edge>& edges) {
    for (const Edge& edge : edges) {
      const int64_t next = std::ssize(rows_.relations) + 1;
      const int64_t relation = rows_.relations.try_emplace(edge.relation, next).first->second;
      std::string payload = EncodeEdgePayload(edge);
      const auto* const current = rows_.edges.Current(edge.key());
      if (current != nullptr && current->value.payload == payload &&
          std::bit_cast<uint64_t>(current->value.edge.weight) ==
              std::bit_cast<uint64_t>(edge.weight)) {
        continue;
      }
      EndEdge(edge.key());
      Edge stored = edge;
      stored.revision = now_;
      if (!payload.empty() && !DecodeEdgePayload(payload, &stored)) return Undecodable("an edge");
      rows_.edges.Put(edge.key(), now_, {std::move(stored), relation, std::move(payload)});
      record.sums.Add(RowOf(*rows_.edges.Current(edge.key())));
      touched.edges.push_back({edge.source, relation, edge.target});
    }
    return absl::OkStatus();
  }

  absl::Status Correct(const TrajectoryCorrection& item) {
    Track& track = rows_.tracks[item.agent];
    std::vector<StoredPose> replaced;
    track.ForEach([&](TimeNs time_ns, const Track::Version& pose) {
      const bool is_in = item.from_ns <= time_ns && time_ns < item.to_ns;
      if (is_in && pose.is_current()) replaced.push_back(pose.value);
    });
    for (const StoredPose& pose : replaced) {
      record.sums.RemovePose(PoseIdentity(item.agent, pose, rows_.spec.codec, &scratch_));
      track.End(pose.time_ns, now_);
    }
    PutPoses(item.agent, item.poses, &track);
    are_ends_doubtful = true;
    return absl::OkStatus();
  }

  absl::Status Append(const TrajectoryAppend& item) {
    PutPoses(item.agent, item.poses, &rows_.tracks[item.agent]);
    const TimeNs first_ns = item.poses.front().time_ns;
    const TimeNs last_ns = item.poses.back().time_ns;
    record.first_pose_ns = std::min(record.first_pose_ns.value_or(first_ns), first_ns);
    record.last_pose_ns = std::max(record.last_pose_ns.value_or(last_ns), last_ns);
    return absl::OkStatus();
  }

  absl::Status EndFactors(const TrackSpan& span) {
    for (const auto& [id, batch] : BatchesTouching(rows_.factors, span)) {
      std::vector<PoseFactor> factors;
      if (!DecodeFactors(batch.value.payload, &factors)) return Undecodable("factors");
      const bool goes_whole = Covers(span, batch.value.t0, batch.value.t1);
      const auto goes = [&](const PoseFactor& factor) { return Touches(factor, span); };
      if (goes_whole) {
        factors.clear();
      } else if (std::erase_if(factors, goes) == 0) {
        continue;
      }
      record.sums.Remove(BatchRowOf<FactorRow>(batch));
      rows_.factors.End(id, now_);
      DSG_RETURN_IF_ERROR(WriteFactors({{span.agent, std::move(factors)}}));
    }
    return absl::OkStatus();
  }

  absl::Status WriteFactors(const std::vector<FactorAppend>& factors) {
    for (const FactorAppend& item : factors) {
      if (item.factors.empty()) continue;
      const BatchTimes times = TimesOf(item.factors);
      PutBatch<FactorRow>({item.agent, times.t0, times.t1, EncodeFactors(item.factors)},
                          &rows_.factors);
    }
    return absl::OkStatus();
  }

  absl::Status EndShapes(const TrackSpan& span) {
    for (const auto& [id, batch] : BatchesTouching(rows_.shapes, span)) {
      DecodedShapes decoded;
      if (!DecodeShapes(batch.value.payload, /*with_vertices=*/true, &decoded)) {
        return Undecodable("shapes");
      }
      ShapeAppend rest{span.agent, decoded.topology, {}};
      if (!Covers(span, batch.value.t0, batch.value.t1)) {
        DSG_ASSIGN_OR_RETURN(const std::set<TimeNs> hidden, TimesHiding(id, batch));
        bool is_touched = false;
        for (BodyShape& shape : decoded.shapes) {
          const bool goes = Holds(span, shape.time_ns);
          is_touched |= goes;
          if (!goes && !hidden.contains(shape.time_ns)) rest.shapes.push_back(std::move(shape));
        }
        if (!is_touched) continue;
      }
      record.sums.Remove(BatchRowOf<ShapeRow>(batch));
      rows_.shapes.End(id, now_);
      DSG_RETURN_IF_ERROR(WriteShapes({rest}));
    }
    return absl::OkStatus();
  }

  absl::Status WriteShapes(const std::vector<ShapeAppend>& shapes) {
    for (const ShapeAppend& item : shapes) {
      for (size_t first = 0; first < item.shapes.size();) {
        const ShapeAppend batch = CutBatch(item, first);
        first += batch.shapes.size();
        PutBatch<ShapeRow>({batch.agent, batch.shapes.front().time_ns, batch.shapes.back().time_ns,
                            EncodeShapes(batch, rows_.spec.codec)},
                           &rows_.shapes);
      }
    }
    return absl::OkStatus();
  }

  absl::Status EndStays(const std::vector<StayKey>& keys) {
    for (const StayKey& key : keys) {
      const auto* const current = rows_.stays.Current(key);
      if (current == nullptr) continue;
      record.sums.Remove(RowOf(*current));
      rows_.stays.End(key, now_);
    }
    return absl::OkStatus();
  }

  absl::Status WriteStays(const std::vector<Stay>& stays) {
    for (const Stay& stay : stays) {
      const StayKey key{stay.agent, stay.enter_ns};
      const auto* const current = rows_.stays.Current(key);
      if (current != nullptr && current->value == stay) continue;
      DSG_RETURN_IF_ERROR(EndStays({key}));
      rows_.stays.Put(key, now_, stay);
      record.sums.Add(RowOf(*rows_.stays.Current(key)));
    }
    return absl::OkStatus();
  }

  absl::Status EndMeshBlocks(const std::vector<BlockIndex>& indices) {
    for (const BlockIndex& index : indices) {
      const auto* const current = rows_.mesh_blocks.Current(index);
      if (current == nullptr) continue;
      record.sums.Remove(RowOf(index, *current));
      rows_.mesh_blocks.End(index, now_);
      touched.mesh_blocks.push_back(index);
    }
    return absl::OkStatus();
  }

  absl::Status WriteMeshBlocks(const std::vector<MeshBlock>& blocks) {
    for (const MeshBlock& block : blocks) {
      std::string payload = EncodeMeshBlock(block);
      const auto* const current = rows_.mesh_blocks.Current(block.index);
      if (current != nullptr && current->value == payload) continue;
      DSG_RETURN_IF_ERROR(EndMeshBlocks({block.index}));
      rows_.mesh_blocks.Put(block.index, now_, std::move(payload));
      record.sums.Add(RowOf(block.index, *rows_.mesh_blocks.Current(block.index)));
      touched.mesh_blocks.push_back(block.index);
    }
    return absl::OkStatus();
  }

 private:
  absl::Status Undecodable(const char* what) const {
    return absl::InternalError(absl::StrCat("map \"", rows_.spec.name, "\": cannot decode ", what,
                                            " that was just encoded; report this"));
  }

  void EndNode(NodeId id) {
    const auto* const current = rows_.nodes.Current(id);
    if (current == nullptr) return;
    record.sums.Remove(RowOf(*current));
    rows_.nodes.End(id, now_);
    touched.nodes.push_back(id);
  }

  absl::Status WriteNode(const Node& node) {
    std::string payload = EncodeNodePayload(node);
    const auto* const current = rows_.nodes.Current(node.id);
    if (current != nullptr && current->value.node.layer == node.layer &&
        current->value.payload == payload) {
      return absl::OkStatus();
    }
    Node stored;
    if (!DecodeNodePayload(payload, &stored)) return Undecodable("a node");
    stored.id = node.id;
    stored.layer = node.layer;
    stored.revision = now_;
    EndNode(node.id);
    rows_.nodes.Put(node.id, now_, {std::move(stored), std::move(payload)});
    record.sums.Add(RowOf(*rows_.nodes.Current(node.id)));
    touched.nodes.push_back(node.id);
    return absl::OkStatus();
  }

  void EndEdge(const EdgeKey& key) {
    const auto* const current = rows_.edges.Current(key);
    if (current == nullptr) return;
    record.sums.Remove(RowOf(*current));
    touched.edges.push_back({key.source, current->value.relation, key.target});
    rows_.edges.End(key, now_);
  }

  void PutPoses(NodeId agent, const std::vector<TimedPose>& poses, Track* track) {
    for (const TimedPose& pose : poses) {
      const StoredPose stored = ToStored(pose, rows_.spec.codec);
      record.sums.AddPose(PoseIdentity(agent, stored, rows_.spec.codec, &scratch_));
      track->Put(pose.time_ns, now_, stored);
    }
    touched.tracks.push_back(agent);
  }

  // Current ones of the span's agent.
  static std::vector<std::pair<int64_t, Batches::Version>> BatchesTouching(const Batches& batches,
                                                                           const TrackSpan& span) {
    std::vector<std::pair<int64_t, Batches::Version>> touching;
    batches.ForEach([&](int64_t id, const Batches::Version& batch) {
      if (batch.is_current() && batch.value.agent == span.agent &&
          MayTouch(span, batch.value.t0, batch.value.t1)) {
        touching.emplace_back(id, batch);
      }
    });
    return touching;
  }

  // Times of shapes that hide those of a batch: written anew, it must not come out on top of them.
  absl::StatusOr<std::set<TimeNs>> TimesHiding(int64_t id, const Batches::Version& batch) const {
    const StoredBatch& old = batch.value;
    const TrackSpan span{old.agent, old.t0, old.t1 == kTimeMax ? kTimeMax : old.t1 + 1};
    std::set<TimeNs> hidden;
    std::vector<TimeNs> times;
    for (const auto& [other_id, other] : BatchesTouching(rows_.shapes, span)) {
      const bool is_newer = other.from != batch.from ? other.from > batch.from : other_id > id;
      if (!is_newer) continue;
      if (!DecodeShapeTimes(other.value.payload, &times)) return Undecodable("shapes");
      hidden.insert(times.begin(), times.end());
    }
    return hidden;
  }

  template <typename Row>
  void PutBatch(StoredBatch batch, Batches* batches) {
    const int64_t id = ++rows_.last_batch;
    batches->Put(id, now_, std::move(batch));
    record.sums.Add(BatchRowOf<Row>(*batches->Current(id)));
  }

  MapRows& rows_;
  const Revision now_;
  std::string scratch_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MemoryWriter>> MemoryWriter::Open(std::shared_ptr<MapRows> rows,
                                                                 const std::string& program) {
  const std::lock_guard lock(rows->mutex);
  if (!rows->writer.empty()) {
    return MakeError(Reason::kWriterLocked,
                     absl::StrCat("map \"", rows->spec.name, "\" is being written by ",
                                  rows->writer, "; a map has one writer at a time: close it first"),
                     {{"map", rows->spec.name}, {"holder", rows->writer}});
  }
  rows->writer = program.empty() ? "this process" : program;
  return std::unique_ptr<MemoryWriter>(new MemoryWriter(rows));
}

MemoryWriter::~MemoryWriter() {
  const std::lock_guard lock(rows_->mutex);
  rows_->writer.clear();
}

absl::StatusOr<CommitResult> MemoryWriter::Commit(GraphDelta delta) {
  DSG_RETURN_IF_ERROR(CheckForgetting(delta));
  const std::lock_guard lock(rows_->mutex);
  const DeltaIdentity identity = IdentityOfDelta(delta);
  const RevisionRecord head = rows_->Head();
  DSG_ASSIGN_OR_RETURN(const auto replay, PrepareCommit(HeadSource(rows_.get()), identity,
                                                        head.info.revision, &delta));
  if (replay.has_value()) return *replay;
  CommitParts parts(rows_.get(), NextRecord(head, delta, WallClockNs()));
  DSG_RETURN_IF_ERROR(ApplyInOrder(delta, &parts));
  const Revision revision = parts.record.info.revision;
  if (parts.are_ends_doubtful) {
    const auto span = rows_->SpanOfAll(revision);
    parts.record.first_pose_ns = parts.record.last_pose_ns = std::nullopt;
    if (span.has_value()) parts.record.first_pose_ns = span->from_ns;
    if (span.has_value()) parts.record.last_pose_ns = span->to_ns;
  }
  Seal(head.info.digest, &parts.record);
  parts.touched.Normalize();
  rows_->commits[revision] = {parts.record, head.info.digest, identity.checksum, parts.touched};
  const auto [session, is_new] = rows_->sessions.try_emplace(identity.session_id);
  if (is_new) session->second.state.first_revision = revision;
  session->second.state.last_sequence = identity.sequence;
  session->second.state.last_revision = revision;
  session->second.last_checksum = identity.checksum;
  return CommitResult{revision, false};
}

absl::StatusOr<SessionState> MemoryWriter::GetSession(const std::string& session_id) {
  const std::lock_guard lock(rows_->mutex);
  return HeadSource(rows_.get()).ReadSession(session_id);
}

absl::StatusOr<Tag> MemoryWriter::SetTag(const std::string& name, Revision revision,
                                         const std::string& note) {
  const std::lock_guard lock(rows_->mutex);
  const Tag tag{name, revision, WallClockNs(), note};
  DSG_RETURN_IF_ERROR(CheckTag(tag));
  DSG_RETURN_IF_ERROR(
      CheckReadable(rows_->spec.name, revision, rows_->newest(), rows_->ReadableNow()));
  int64_t count = 0;
  int64_t note_bytes = 0;
  for (const auto& [other_name, other] : rows_->tags) {
    if (other_name == name) continue;
    ++count;
    note_bytes += std::ssize(other.note);
  }
  DSG_RETURN_IF_ERROR(CheckTagBounds(rows_->spec.name, tag, count, note_bytes));
  rows_->tags[name] = tag;
  return tag;
}

absl::Status MemoryWriter::RemoveTag(const std::string& name) {
  const std::lock_guard lock(rows_->mutex);
  if (rows_->tags.erase(name) > 0) return absl::OkStatus();
  std::vector<Tag> tags;
  for (const auto& [known, tag] : rows_->tags) tags.push_back(tag);
  return UnknownTag(rows_->spec.name, name, tags);
}

absl::StatusOr<CompactReport> MemoryWriter::Compact(Revision keep_from, const StopCheck& stop,
                                                    const Progress& progress) {
  const std::lock_guard lock(rows_->mutex);
  const Readable readable = rows_->ReadableNow();
  DSG_RETURN_IF_ERROR(CheckReadable(rows_->spec.name, keep_from, rows_->newest(), readable));
  DSG_RETURN_IF_ERROR(AskStop(stop));
  // A tagged revision can be read, but what lies after it may be gone: nothing comes back.
  const CompactReport report = CompactRows(std::max(keep_from, readable.oldest), rows_.get());
  if (progress) progress(1.0);
  return report;
}

absl::Status MemoryWriter::NoteErasure(const Erasure& erasure, Revision planned_at) {
  const std::lock_guard lock(rows_->mutex);
  DSG_ASSIGN_OR_RETURN(EraseList list, ListOf(erasure, [&](const std::string& name) {
                         return rows_->FindRelation(name);
                       }));
  if (list.size() == 0) return absl::OkStatus();
  rows_->is_erasing = true;
  rows_->noted_erasures.push_back({planned_at, std::move(list)});
  return absl::OkStatus();
}

absl::StatusOr<EraseReport> MemoryWriter::Erase(const Erasure& erasure, const StopCheck& stop,
                                                const Progress& progress) {
  const std::lock_guard lock(rows_->mutex);
  DSG_ASSIGN_OR_RETURN(const EraseReport report, EraseRows(erasure, stop, rows_.get()));
  if (progress) progress(1.0);
  return report;
}

}  // namespace dsg::memory
