// SPDX-License-Identifier: Apache-2.0
#include "query/engine/diff.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "schema/base/status.h"

namespace dsg::query {

bool SameContent(const Node& a, const Node& b) {
  // One row, seen from both ends.
  if (a.revision == b.revision) return true;
  return a.layer == b.layer && EncodeNodePayload(a) == EncodeNodePayload(b);
}

bool SameContent(const Edge& a, const Edge& b) {
  if (a.revision == b.revision) return true;
  return std::bit_cast<uint64_t>(a.weight) == std::bit_cast<uint64_t>(b.weight) &&
         EncodeEdgePayload(a) == EncodeEdgePayload(b);
}

bool SameContent(const MeshBlock& a, const MeshBlock& b) {
  return EncodeMeshBlock(a) == EncodeMeshBlock(b);
}

bool IsSamePose(const TimedPose& a, const TimedPose& b) {
  if ((a.covariance == nullptr) != (b.covariance == nullptr)) return false;
  const Eigen::Vector4d& q = a.map_T_agent.orientation.coeffs();
  const Eigen::Vector4d& r = b.map_T_agent.orientation.coeffs();
  return a.time_ns == b.time_ns && a.flags == b.flags &&
         a.map_T_agent.position == b.map_T_agent.position && (q == r || q == -r) &&
         (a.covariance == nullptr || *a.covariance == *b.covariance);
}

namespace {

constexpr size_t kPoseChunkSize = 4096;

// At most `size_max` poses of [from_ns, to_ns); none for an agent that is not there.
absl::StatusOr<std::vector<TimedPose>> ReadChunk(const Snapshot& snapshot, NodeId agent,
                                                 TimeNs from_ns, TimeNs to_ns, size_t size_max,
                                                 const StopCheck& stop) {
  std::vector<TimedPose> poses;
  const absl::Status read =
      snapshot.ReadPoses(agent, from_ns, to_ns, stop, [&](const TimedPose& pose) {
        poses.push_back(pose);
        return poses.size() < size_max;
      });
  if (!absl::IsNotFound(read)) DSG_RETURN_IF_ERROR(read);
  return poses;
}

// Whether poses that `earlier` has are others, or gone, in `later`. An agent that a snapshot does
// not know has no poses there. Cost: the poses up to the first difference, a few thousand at a
// time.
absl::StatusOr<bool> PosesWereCorrected(const Snapshot& earlier, const Snapshot& later,
                                        NodeId agent, const StopCheck& stop) {
  for (TimeNs from_ns = kTimeMin;;) {
    DSG_ASSIGN_OR_RETURN(const std::vector<TimedPose> told,
                         ReadChunk(earlier, agent, from_ns, kTimeMax, kPoseChunkSize, stop));
    if (told.empty()) return false;
    const TimeNs to_ns = told.back().time_ns + 1;
    // One more than were told shows that there are others in between.
    DSG_ASSIGN_OR_RETURN(const std::vector<TimedPose> now,
                         ReadChunk(later, agent, from_ns, to_ns, told.size() + 1, stop));
    if (!std::equal(told.begin(), told.end(), now.begin(), now.end(), IsSamePose)) return true;
    if (told.size() < kPoseChunkSize) return false;
    from_ns = to_ns;
  }
}

// Keys looked at between two questions to the call.
constexpr int kCheckPeriod = 64;
constexpr size_t kReadBatchMax = 64;

/// The two states that are compared, and what of them is shown.
struct Ends {
  const Snapshot& before;
  const Snapshot& after;
  const Touched& touched;
  const LayerTable& layers;
  std::optional<LayerId> layer;
  int view = 0;
};

// The value, or nothing where the snapshot has no such thing.
template <typename T>
absl::StatusOr<std::optional<T>> IfFound(absl::StatusOr<T> value) {
  if (value.ok()) return std::optional<T>(*std::move(value));
  if (absl::IsNotFound(value.status())) return std::optional<T>();
  return value.status();
}

// Nothing if both are absent or equal.
template <typename T>
std::optional<v1::ChangeType> Compare(const std::optional<T>& before,
                                      const std::optional<T>& after) {
  if (!before.has_value() && !after.has_value()) return {};
  if (!before.has_value()) return v1::ADDED;
  if (!after.has_value()) return v1::REMOVED;
  if (SameContent(*before, *after)) return {};
  return v1::CHANGED;
}

bool IsInLayer(const std::optional<Node>& node, const Ends& ends) {
  return node.has_value() && node->layer == *ends.layer;
}

absl::StatusOr<bool> TouchesLayer(const std::optional<Edge>& edge, const Snapshot& snapshot,
                                  const Ends& ends) {
  if (!edge.has_value()) return false;
  for (const NodeId end : {edge->source, edge->target}) {
    DSG_ASSIGN_OR_RETURN(const auto node, IfFound(snapshot.GetNode(end)));
    if (IsInLayer(node, ends)) return true;
  }
  return false;
}

absl::StatusOr<std::optional<v1::NodeChange>> ChangeOf(const std::optional<Node>& before,
                                                       const std::optional<Node>& after,
                                                       const Ends& ends) {
  const auto type = Compare(before, after);
  const bool shown = !ends.layer.has_value() || IsInLayer(before, ends) || IsInLayer(after, ends);
  if (!type.has_value() || !shown) return std::optional<v1::NodeChange>();
  v1::NodeChange change;
  change.set_type(*type);
  if (before.has_value()) FillNode(*before, ends.layers, ends.view, change.mutable_before());
  if (after.has_value()) FillNode(*after, ends.layers, ends.view, change.mutable_after());
  return std::optional<v1::NodeChange>(std::move(change));
}

void FillEdge(const Edge& edge, int view, v1::Edge* out) {
  if (view != v1::NODE_VIEW_ID) return ToProto(edge, out);
  out->set_source(ToString(edge.source));
  out->set_relation(edge.relation);
  out->set_target(ToString(edge.target));
}

absl::StatusOr<std::optional<v1::EdgeChange>> ChangeOf(const std::optional<Edge>& before,
                                                       const std::optional<Edge>& after,
                                                       const Ends& ends) {
  const auto type = Compare(before, after);
  if (!type.has_value()) return std::optional<v1::EdgeChange>();
  if (ends.layer.has_value()) {
    DSG_ASSIGN_OR_RETURN(const bool touched_before, TouchesLayer(before, ends.before, ends));
    DSG_ASSIGN_OR_RETURN(const bool touches_after, TouchesLayer(after, ends.after, ends));
    if (!touched_before && !touches_after) return std::optional<v1::EdgeChange>();
  }
  v1::EdgeChange change;
  change.set_type(*type);
  if (before.has_value()) FillEdge(*before, ends.view, change.mutable_before());
  if (after.has_value()) FillEdge(*after, ends.view, change.mutable_after());
  return std::optional<v1::EdgeChange>(std::move(change));
}

// The changes of keys in turn, both states of many read at once.
template <typename Key>
class PairReader {
 public:
  // No more at once than a page can show and the one after.
  PairReader(const Ends& ends, int page_size, const StopCheck& stop)
      : ends_(ends),
        stop_(stop),
        batch_max_(std::min(kReadBatchMax, static_cast<size_t>(page_size) + 1)) {}

  void Expect(std::span<const Key> keys) {
    before_ = InTurn<Key>(keys, batch_max_);
    after_ = InTurn<Key>(keys, batch_max_);
  }

  using Change = std::conditional_t<std::is_same_v<Key, NodeId>, v1::NodeChange, v1::EdgeChange>;
  absl::StatusOr<std::optional<Change>> NextChange() {
    DSG_ASSIGN_OR_RETURN(const auto before, before_.Next(ends_.before, stop_));
    DSG_ASSIGN_OR_RETURN(const auto after, after_.Next(ends_.after, stop_));
    return ChangeOf(before, after, ends_);
  }

 private:
  const Ends& ends_;
  const StopCheck& stop_;
  const size_t batch_max_;
  InTurn<Key> before_;
  InTurn<Key> after_;
};

absl::StatusOr<std::optional<v1::TrackChange>> TrackChangeOf(NodeId agent, const Ends& ends,
                                                             const StopCheck& stop) {
  using Change = std::optional<v1::TrackChange>;
  if (ends.layer.has_value()) {
    DSG_ASSIGN_OR_RETURN(const auto before, IfFound(ends.before.GetNode(agent)));
    DSG_ASSIGN_OR_RETURN(const auto after, IfFound(ends.after.GetNode(agent)));
    if (!IsInLayer(before, ends) && !IsInLayer(after, ends)) return Change();
  }
  DSG_ASSIGN_OR_RETURN(const auto track_before, IfFound(ends.before.GetTrack(agent)));
  DSG_ASSIGN_OR_RETURN(const auto track_after, IfFound(ends.after.GetTrack(agent)));
  const TrackInfo before = track_before.value_or(TrackInfo());
  const TrackInfo after = track_after.value_or(TrackInfo());
  const std::vector<NodeId>& rewritten = ends.touched.corrected_tracks;
  bool corrected = false;
  if (std::binary_search(rewritten.begin(), rewritten.end(), agent)) {
    const bool forward = ends.before.revision() <= ends.after.revision();
    const Snapshot& earlier = forward ? ends.before : ends.after;
    const Snapshot& later = forward ? ends.after : ends.before;
    DSG_ASSIGN_OR_RETURN(corrected, PosesWereCorrected(earlier, later, agent, stop));
  }
  if (!corrected && before.pose_count == after.pose_count && before.last_ns == after.last_ns) {
    return Change();
  }
  v1::TrackChange change;
  change.set_agent_id(ToString(agent));
  change.set_pose_count_before(before.pose_count);
  change.set_pose_count_after(after.pose_count);
  change.set_last_pose_ns_before(before.pose_count > 0 ? before.last_ns : 0);
  change.set_last_pose_ns_after(after.pose_count > 0 ? after.last_ns : 0);
  change.set_corrected(corrected);
  return Change(std::move(change));
}

absl::StatusOr<std::optional<v1::MeshChange>> ChangeOf(const BlockIndex& index, const Ends& ends) {
  DSG_ASSIGN_OR_RETURN(const auto before, IfFound(ends.before.ReadMeshBlock(index)));
  DSG_ASSIGN_OR_RETURN(const auto after, IfFound(ends.after.ReadMeshBlock(index)));
  const auto type = Compare(before, after);
  if (!type.has_value()) return std::optional<v1::MeshChange>();
  v1::MeshChange change;
  change.set_type(*type);
  change.mutable_index()->set_x(index.x);
  change.mutable_index()->set_y(index.y);
  change.mutable_index()->set_z(index.z);
  return std::optional<v1::MeshChange>(std::move(change));
}

/// A page that is being filled. Kinds of changes follow one another as in kKinds; each has a
/// letter, which begins a position.
class ChangePage {
 public:
  static constexpr std::string_view kKinds = "NETM";

  ChangePage(std::string_view position, int size, const CallContext& call)
      : position_(position), size_(size), call_(call) {}

  /// Adds what `change_of` makes of the keys that follow the position, as far as there is room.
  /// `expect` is told which keys come next; `change_of` is then asked for them, one by one.
  template <typename Key, typename Expect, typename Make, typename Changes>
  absl::Status Add(char kind, const std::vector<Key>& keys, const Expect& expect,
                   const Make& change_of, Changes* changes) {
    auto next = keys.begin();
    if (!position_.empty()) {
      if (kKinds.find(kind) < kKinds.find(position_.front())) return absl::OkStatus();
      Key last{};
      if (kind == position_.front()) {
        if (!ReadKey(position_.substr(1), &last)) return PageTokenError();
        next = std::upper_bound(keys.begin(), keys.end(), last);
      }
    }
    if (has_more_) return absl::OkStatus();
    expect(std::span<const Key>(next, keys.end()));
    for (; next != keys.end() && !has_more_; ++next) {
      if (seen_count_++ % kCheckPeriod == 0) DSG_RETURN_IF_ERROR(call_.Check());
      DSG_ASSIGN_OR_RETURN(auto change, change_of(*next));
      if (!change.has_value()) continue;
      // Only a change that has no room shows that the page before it was not the last.
      has_more_ = count_ == size_ || bytes_ > kPageBytesSoftMax;
      if (has_more_) break;
      ++count_;
      bytes_ += change->ByteSizeLong();
      last_ = kind + KeyPosition(*next);
      *changes->Add() = *std::move(change);
    }
    return absl::OkStatus();
  }

  std::string next_position() const { return has_more_ ? last_ : std::string(); }

 private:
  const std::string_view position_;
  const int size_;
  const CallContext& call_;
  int seen_count_ = 0;
  int count_ = 0;
  size_t bytes_ = 0;
  bool has_more_ = false;
  std::string last_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Difference>> Difference::Open(std::shared_ptr<MapReader> map,
                                                             Revision before, Revision after,
                                                             const DifferenceOptions& options,
                                                             const StopCheck& stop) {
  std::unique_ptr<Difference> made(new Difference());
  DSG_ASSIGN_OR_RETURN(made->before_, map->At(before));
  DSG_ASSIGN_OR_RETURN(made->after_, map->At(after));
  const Snapshot& later = before <= after ? *made->after_ : *made->before_;
  DSG_ASSIGN_OR_RETURN(made->layers_, LayersOf(later));
  if (!options.layer.empty()) {
    DSG_ASSIGN_OR_RETURN(const Layer layer, later.FindLayer(options.layer));
    made->layer_ = layer.id;
  }
  const auto [first, last] = std::minmax(before, after);
  DSG_ASSIGN_OR_RETURN(made->touched_, map->TouchedBetween(first, last, stop));
  made->view_ = options.view;
  return made;
}

absl::StatusOr<std::string> Difference::AddPage(std::string_view position, int size,
                                                const CallContext& call,
                                                v1::DiffRevisionsResponse* reply) const {
  if (!position.empty() && ChangePage::kKinds.find(position.front()) == std::string_view::npos) {
    return PageTokenError();
  }
  const Ends ends{*before_, *after_, touched_, layers_, layer_, view_};
  ChangePage page(position, size, call);
  const StopCheck stop = call.stop();
  const auto expect_nothing = [](const auto&) {};
  PairReader<NodeId> nodes(ends, size, stop);
  DSG_RETURN_IF_ERROR(page.Add(
      'N', touched_.nodes, [&](std::span<const NodeId> ids) { nodes.Expect(ids); },
      [&](NodeId) { return nodes.NextChange(); }, reply->mutable_nodes()));
  PairReader<EdgeKey> edges(ends, size, stop);
  DSG_RETURN_IF_ERROR(page.Add(
      'E', touched_.edges, [&](std::span<const EdgeKey> keys) { edges.Expect(keys); },
      [&](const EdgeKey&) { return edges.NextChange(); }, reply->mutable_edges()));
  DSG_RETURN_IF_ERROR(page.Add(
      'T', touched_.tracks, expect_nothing,
      [&](NodeId agent) { return TrackChangeOf(agent, ends, stop); }, reply->mutable_tracks()));
  // The mesh is a layer of the map, though its blocks are no nodes.
  if (!layer_.has_value() || *layer_ == layers::kMesh) {
    DSG_RETURN_IF_ERROR(page.Add(
        'M', touched_.mesh_blocks, expect_nothing,
        [&](const BlockIndex& index) { return ChangeOf(index, ends); },
        reply->mutable_mesh_blocks()));
  }
  return page.next_position();
}

namespace {

absl::Status CheckRevision(std::string_view field, Revision revision) {
  if (revision >= 0) return absl::OkStatus();
  return FieldError(field, absl::StrCat(revision), "revisions count from 0, the empty map");
}

// Where a page begins, and the revision that was the newest on the first one.
absl::StatusOr<PageToken> StartOf(MapReader* map, const v1::DiffRevisionsRequest& request,
                                  uint64_t question) {
  PageToken start;
  if (!request.page_token().empty()) {
    DSG_ASSIGN_OR_RETURN(start, DecodePageToken(request.page_token(), question));
    DSG_RETURN_IF_ERROR(CheckToken(start, *map));
    return start;
  }
  start.incarnation = DigestOf(*map);
  start.revision = request.to_revision();
  if (request.has_to_revision()) return start;
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
  start.revision = head.revision;
  return start;
}

uint64_t QuestionOf(const v1::DiffRevisionsRequest& request) {
  v1::DiffRevisionsRequest question = request;
  question.clear_page_size();
  question.clear_page_token();
  return QuestionDigest("DiffRevisions", question);
}

}  // namespace

absl::Status DiffRevisions(Engine* engine, const CallContext& call,
                           const v1::DiffRevisionsRequest& request,
                           v1::DiffRevisionsResponse* reply) {
  DSG_RETURN_IF_ERROR(CheckRevision("from_revision", request.from_revision()));
  DSG_RETURN_IF_ERROR(CheckRevision("to_revision", request.to_revision()));
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  DSG_ASSIGN_OR_RETURN(const int size, CheckPageSize(request.page_size()));
  const uint64_t question = QuestionOf(request);
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(const PageToken start, StartOf(map.get(), request, question));
  const Revision from = request.from_revision();
  const Revision to = start.revision;

  DSG_ASSIGN_OR_RETURN(const ReadView view,
                       ReadView::OpenAt(&engine->maps, map, std::max(from, to)));
  DSG_ASSIGN_OR_RETURN(
      const auto difference,
      Difference::Open(map, from, to, {request.layer(), request.view()}, call.stop()));
  view.FillHeader(reply->mutable_header());
  reply->set_from_revision(from);
  reply->set_to_revision(to);
  DSG_ASSIGN_OR_RETURN(std::string next, difference->AddPage(start.position, size, call, reply));
  if (!next.empty()) {
    reply->set_next_page_token(EncodePageToken({start.incarnation, to, std::move(next)}, question));
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
