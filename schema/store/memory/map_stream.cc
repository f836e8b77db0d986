// SPDX-License-Identifier: Apache-2.0
#include "schema/store/memory/map_stream.h"

#include <algorithm>
#include <array>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/track_pieces.h"

namespace dsg::memory {
namespace {

// Of one map, family by family.
class Streamer {
 public:
  Streamer(const MapRows& rows, const StopCheck& stop, const RowSink& sink)
      : rows_(rows), stop_(stop), sink_(sink) {
    for (const auto& [revision, commit] : rows.commits) records_.push_back(revision);
  }

  absl::Status Run() {
    DSG_RETURN_IF_ERROR(sink_({row_kinds::kOldest, {rows_.oldest}, {}}));
    DSG_RETURN_IF_ERROR(ShowNames());
    DSG_RETURN_IF_ERROR(ShowCommits());
    DSG_RETURN_IF_ERROR(ShowAssets());
    DSG_RETURN_IF_ERROR(ShowVersions(rows_.nodes, {0, 1}, [](NodeId, const auto& node) {
      return StreamRowOf(RowOf(node), node.to);
    }));
    DSG_RETURN_IF_ERROR(ShowVersions(rows_.edges, {0, 1, 2, 3}, [](const EdgeKey&, const auto& e) {
      return StreamRowOf(RowOf(e), e.to);
    }));
    DSG_RETURN_IF_ERROR(ShowVersions(rows_.stays, {0, 1, 5}, [](const StayKey&, const auto& stay) {
      return StreamRowOf(RowOf(stay), stay.to);
    }));
    DSG_RETURN_IF_ERROR(ShowTracks());
    // In the order in which they were written.
    DSG_RETURN_IF_ERROR(ShowVersions(rows_.factors, {}, [](int64_t, const auto& batch) {
      return StreamRowOf(BatchRowOf<FactorRow>(batch), batch.to);
    }));
    DSG_RETURN_IF_ERROR(ShowVersions(rows_.shapes, {}, [](int64_t, const auto& batch) {
      return StreamRowOf(BatchRowOf<ShapeRow>(batch), batch.to);
    }));
    return ShowVersions(rows_.mesh_blocks, {0, 1, 2, 3}, [](BlockIndex index, const auto& block) {
      return StreamRowOf(RowOf(index, block), block.to);
    });
  }

 private:
  absl::Status ShowNames() {
    auto layers = rows_.layers;
    std::sort(layers.begin(), layers.end(),
              [](const auto& a, const auto& b) { return a.second.id < b.second.id; });
    for (const auto& [from, layer] : layers) {
      DSG_RETURN_IF_ERROR(sink_({row_kinds::kLayer, {layer.id, layer.rank, from}, {layer.name}}));
    }
    auto labels = rows_.labels;
    std::sort(labels.begin(), labels.end(), [](const auto& a, const auto& b) {
      return std::make_pair(a.second.id, a.first) < std::make_pair(b.second.id, b.first);
    });
    for (const auto& [from, label] : labels) {
      DSG_RETURN_IF_ERROR(sink_({row_kinds::kLabel, {label.id, from}, {label.name}}));
    }
    std::map<int64_t, std::string> relations;
    for (const auto& [name, number] : rows_.relations) relations[number] = name;
    for (const auto& [number, name] : relations) {
      DSG_RETURN_IF_ERROR(sink_({row_kinds::kRelation, {number}, {name}}));
    }
    return absl::OkStatus();
  }

  absl::Status ShowCommits() {
    Revision last = 0;
    for (const auto& [revision, commit] : rows_.commits) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      StreamedRevision streamed{commit.record, std::nullopt, commit.delta_checksum, commit.touched};
      if (revision != last + 1) streamed.parent = commit.parent;
      DSG_RETURN_IF_ERROR(sink_(RowOfRevision(streamed)));
      last = revision;
    }
    for (const auto& [id, session] : rows_.sessions) {
      const SessionState& state = session.state;
      DSG_RETURN_IF_ERROR(
          sink_({row_kinds::kSession,
                 {state.last_sequence, state.last_revision, state.first_revision,
                  session.last_checksum.has_value() ? 1 : 0, session.last_checksum.value_or(0)},
                 {id}}));
    }
    for (const auto& [name, tag] : rows_.tags) {
      DSG_RETURN_IF_ERROR(
          sink_({row_kinds::kTag, {tag.revision, tag.created_ns}, {name, tag.note}}));
    }
    return absl::OkStatus();
  }

  absl::Status ShowAssets() {
    for (const auto& [sha256, asset] : rows_.assets) {
      DSG_RETURN_IF_ERROR(sink_(
          {row_kinds::kAsset, {asset.from}, {std::string(BytesOf(sha256)), asset.media_type}}));
      for (size_t part = 0; part == 0 || part * kAssetPartBytes < asset.content.size(); ++part) {
        DSG_RETURN_IF_ERROR(AskStop(stop_));
        DSG_RETURN_IF_ERROR(
            sink_({row_kinds::kAssetPart,
                   {static_cast<int64_t>(part)},
                   {asset.content.substr(part * kAssetPartBytes, kAssetPartBytes)}}));
      }
    }
    for (const auto& [from, sha256] : rows_.dropped_assets) {
      DSG_RETURN_IF_ERROR(
          sink_({row_kinds::kDroppedAsset, {from}, {std::string(BytesOf(sha256))}}));
    }
    return absl::OkStatus();
  }

  // Ascending by the numbers of the columns `order`; without any as they are.
  template <typename Key, typename Value, typename MakeRow>
  absl::Status ShowVersions(const Versions<Key, Value>& versions, std::vector<size_t> order,
                            const MakeRow& row_of) {
    using Version = typename Versions<Key, Value>::Version;
    std::vector<std::pair<std::vector<int64_t>, std::pair<Key, const Version*>>> sorted;
    versions.ForEach([&](const Key& key, const Version& version) {
      const StreamRow row = row_of(key, version);
      std::vector<int64_t> columns;
      for (const size_t column : order) columns.push_back(row.numbers[column]);
      sorted.emplace_back(std::move(columns), std::make_pair(key, &version));
    });
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [columns, item] : sorted) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      DSG_RETURN_IF_ERROR(sink_(row_of(item.first, *item.second)));
    }
    return absl::OkStatus();
  }

  absl::Status ShowTracks() {
    std::vector<std::pair<int64_t, const Track*>> tracks;
    for (const auto& [agent, track] : rows_.tracks) tracks.emplace_back(KeyOf(agent), &track);
    std::sort(tracks.begin(), tracks.end());
    for (const auto& [key, track] : tracks) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      const std::vector<TrackEnd> ends = EndsAtRecords(EndsOf(*track), records_);
      TrackStreamer streamer(&rows_.spec, IdOf(key), &ends, &sink_);
      absl::Status status = streamer.ShowEnds();
      track->ForEach([&](TimeNs, const Track::Version& pose) {
        if (!status.ok()) return;
        status = streamer.Add(
            {FirstFrom(records_, pose.from), FirstFrom(records_, pose.to), pose.value});
      });
      DSG_RETURN_IF_ERROR(status);
      DSG_RETURN_IF_ERROR(streamer.Finish());
    }
    return absl::OkStatus();
  }

  static std::vector<TrackEnd> EndsOf(const Track& track) {
    struct Change {
      std::vector<TimeNs> begins;
      std::vector<TimeNs> ends;
    };
    std::map<Revision, Change> changes;
    track.ForEach([&](TimeNs time_ns, const Track::Version& pose) {
      changes[pose.from].begins.push_back(time_ns);
      if (!pose.is_current()) changes[pose.to].ends.push_back(time_ns);
    });
    std::multiset<TimeNs> shown;
    std::vector<TrackEnd> ends;
    for (const auto& [revision, change] : changes) {
      shown.insert(change.begins.begin(), change.begins.end());
      for (const TimeNs time_ns : change.ends) shown.erase(shown.find(time_ns));
      ends.push_back({revision, shown.empty() ? kTimeMin : *shown.rbegin(), std::ssize(shown)});
    }
    return ends;
  }

  const MapRows& rows_;
  const StopCheck& stop_;
  const RowSink& sink_;
  /// Revisions with a record.
  std::vector<Revision> records_;
};

// Takes rows one by one.
class Collector {
 public:
  explicit Collector(MapRows* rows) : rows_(*rows) { rows_.layers.clear(); }

  absl::Status Take(const StreamRow& row) {
    const std::vector<int64_t>& n = row.numbers;
    const std::vector<std::string>& t = row.texts;
    switch (row.kind) {
      case row_kinds::kOldest:
        rows_.oldest = n[0];
        return absl::OkStatus();
      case row_kinds::kLayer:
        rows_.layers.emplace_back(
            n[2], Layer{static_cast<LayerId>(n[0]), t[0], static_cast<int32_t>(n[1])});
        return absl::OkStatus();
      case row_kinds::kLabel:
        rows_.labels.emplace_back(n[1], SemanticLabel{static_cast<int32_t>(n[0]), t[0]});
        return absl::OkStatus();
      case row_kinds::kRelation:
        rows_.relations[t[0]] = n[0];
        relation_names_[n[0]] = t[0];
        return absl::OkStatus();
      case row_kinds::kRevision:
        return TakeRevision(row);
      case row_kinds::kSession:
        rows_.sessions[t[0]] = {{n[0], n[1], n[2]},
                                n[3] != 0 ? std::optional<int64_t>(n[4]) : std::nullopt};
        return absl::OkStatus();
      case row_kinds::kTag:
        rows_.tags[t[0]] = {t[0], n[0], n[1], t[1]};
        return absl::OkStatus();
      case row_kinds::kNode:
        return TakeNode(row);
      case row_kinds::kEdge:
        return TakeEdge(row);
      case row_kinds::kStay:
        return Insert(row, {IdOf(n[0]), n[1]}, n[5],
                      Stay{IdOf(n[0]), IdOf(n[3]), IdOf(n[4]), n[1], n[2]}, &rows_.stays);
      case row_kinds::kTrackEnd:
        if (IdOf(n[0]) != agent_) ends_.clear();
        agent_ = IdOf(n[0]);
        ends_.push_back({n[1], n[2], n[3]});
        return absl::OkStatus();
      case row_kinds::kPoses:
        return TakePoses(row);
      case row_kinds::kFactors:
      case row_kinds::kShapes:
        return Insert(row, ++rows_.last_batch, n[1], StoredBatch{IdOf(n[0]), n[2], n[3], t[0]},
                      row.kind == row_kinds::kFactors ? &rows_.factors : &rows_.shapes);
      case row_kinds::kMeshBlock:
        return Insert(
            row,
            {static_cast<int32_t>(n[0]), static_cast<int32_t>(n[1]), static_cast<int32_t>(n[2])},
            n[3], t[0], &rows_.mesh_blocks);
      default:
        return TakeAsset(row);
    }
  }

 private:
  template <typename Key, typename Value>
  absl::Status Insert(const StreamRow& row, const Key& key, Revision from, Value value,
                      Versions<Key, Value>* versions) {
    if (versions->Insert(key, {from, row.rev_to(), std::move(value)})) return absl::OkStatus();
    return BadRowError(rows_.spec.name, row, "is believed together with another");
  }

  absl::Status TakeRevision(const StreamRow& row) {
    DSG_ASSIGN_OR_RETURN(StreamedRevision revision, RevisionOfRow(rows_.spec.name, row));
    const Revision number = revision.record.info.revision;
    const RevisionRecord head = rows_.Head();
    const bool is_next = number == head.info.revision + 1;
    if (number <= head.info.revision || (!is_next && !revision.parent.has_value())) {
      return BadRowError(rows_.spec.name, row, "does not follow the revision before");
    }
    if (revision.touched.has_value()) {
      // Also of agents whose poses have all gone since.
      for (const NodeId agent : revision.touched->tracks) rows_.tracks[agent];
    }
    rows_.commits[number] = {revision.record, revision.parent.value_or(head.info.digest),
                             revision.delta_checksum, std::move(revision.touched)};
    return absl::OkStatus();
  }

  absl::Status TakeAsset(const StreamRow& row) {
    const auto sha256 =
        row.kind == row_kinds::kAssetPart ? asset_ : DigestOfText(row.texts.front());
    if (!sha256.has_value()) return BadRowError(rows_.spec.name, row, "names no asset");
    if (row.kind == row_kinds::kDroppedAsset) {
      rows_.dropped_assets.emplace(row.numbers[0], *sha256);
    } else if (row.kind == row_kinds::kAsset) {
      asset_ = sha256;
      rows_.assets[*sha256] = {row.numbers[0], row.texts[1], ""};
    } else {
      rows_.assets[*sha256].content += row.texts[0];
    }
    return absl::OkStatus();
  }

  absl::Status TakeNode(const StreamRow& row) {
    DSG_ASSIGN_OR_RETURN(Node node, NodeOfRow(rows_.spec.name, row));
    const NodeId id = node.id;
    return Insert(row, id, row.numbers[1], StoredNode{std::move(node), row.texts[0]}, &rows_.nodes);
  }

  absl::Status TakeEdge(const StreamRow& row) {
    const std::vector<int64_t>& n = row.numbers;
    Edge edge;
    const auto relation = relation_names_.find(n[1]);
    if (relation == relation_names_.end() ||
        (!row.texts[0].empty() && !DecodeEdgePayload(row.texts[0], &edge))) {
      return BadRowError(rows_.spec.name, row, "is no edge");
    }
    edge.source = IdOf(n[0]);
    edge.relation = relation->second;
    edge.target = IdOf(n[2]);
    edge.revision = n[3];
    edge.weight = std::bit_cast<double>(n[4]);
    const EdgeKey key = edge.key();
    return Insert(row, key, n[3], StoredEdge{std::move(edge), n[1], row.texts[0]}, &rows_.edges);
  }

  absl::Status TakePoses(const StreamRow& row) {
    const NodeId agent = IdOf(row.numbers[0]);
    if (agent != agent_) ends_.clear();
    agent_ = agent;
    DSG_ASSIGN_OR_RETURN(const std::vector<StoredPose> poses, PosesOfPiece(rows_.spec, row));
    PieceClock clock(&ends_, row.numbers[1]);
    for (const StoredPose& pose : poses) {
      DSG_RETURN_IF_ERROR(
          Insert(row, pose.time_ns, clock.At(pose.time_ns), pose, &rows_.tracks[agent]));
    }
    return absl::OkStatus();
  }

  MapRows& rows_;
  std::map<int64_t, std::string> relation_names_;
  /// Whose parts come.
  std::optional<Sha256> asset_;
  /// Whose ends and pieces come.
  NodeId agent_;
  std::vector<TrackEnd> ends_;
};

}  // namespace

absl::Status StreamRows(const MapRows& rows, const StopCheck& stop, const RowSink& sink) {
  const PendingErasure left = rows.CountPending();
  if (left.node_count + left.edge_count + left.mesh_block_count + left.span_count > 0) {
    return ErasurePendingError(rows.spec.name);
  }
  return Streamer(rows, stop, sink).Run();
}

absl::StatusOr<std::shared_ptr<MapRows>> CollectRows(const MapSpec& spec, const RowSource& source,
                                                     const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(spec.Validate());
  auto rows = std::make_shared<MapRows>(spec);
  Collector collector(rows.get());
  StreamRow row;
  for (;;) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const bool has_row, source(&row));
    if (!has_row) break;
    DSG_RETURN_IF_ERROR(collector.Take(row));
  }
  // Lookups take the last name of a label.
  const auto is_older = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::stable_sort(rows->labels.begin(), rows->labels.end(), is_older);
  std::stable_sort(rows->layers.begin(), rows->layers.end(), is_older);
  return rows;
}

}  // namespace dsg::memory
