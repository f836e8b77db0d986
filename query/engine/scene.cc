// SPDX-License-Identifier: Apache-2.0
// Answers GetScene: nodes and edges as packed columns. Memory holds the rows of the scene, a few
// words a node, and about one message.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/scene.pb.h"
#include "query/engine/columns.h"
#include "query/engine/engine.h"
#include "query/engine/scene_rows.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
// So many rows are always in a message, and asked for at once where the store has to be read.
constexpr size_t kRowsAtOnce = 1024;

// Texts as small numbers, in the order in which they come.
class Words {
 public:
  explicit Words(const SymbolTable& symbols) : symbols_(symbols) {}

  uint16_t IndexOf(Symbol symbol) {
    const auto [known, is_new] =
        indices_.try_emplace(symbol, static_cast<uint16_t>(indices_.size()));
    if (is_new) order_.push_back(symbol);
    return known->second;
  }
  // A message has fewer rows than there are indices.
  template <typename Field>
  void Fill(Field* field) const {
    for (const Symbol symbol : order_) field->Add(std::string(symbols_.Text(symbol)));
  }

 private:
  const SymbolTable& symbols_;
  absl::flat_hash_map<Symbol, uint16_t> indices_;
  std::vector<Symbol> order_;
};

// Columns of bounded texts or lists: where each row's part ends in one column of all.
template <typename Count>
class PartColumn {
 public:
  void EndRow(Count end) {
    if (end != 0) is_used_ = true;
    Append(end, &ends_);
  }
  size_t size_bytes() const { return ends_.size(); }
  std::string Take() { return is_used_ ? std::move(ends_) : std::string(); }

 private:
  bool is_used_ = false;
  std::string ends_;
};

std::array<float, 6> BoxOf(const ViewNode& node) {
  if (node.box_node.isEmpty()) return {kNone, kNone, kNone, kNone, kNone, kNone};
  const Eigen::Vector3f min = node.box_node.min().cast<float>();
  const Eigen::Vector3f max = node.box_node.max().cast<float>();
  return {min.x(), min.y(), min.z(), max.x(), max.y(), max.z()};
}

// The columns of one SceneNodes.
class NodeColumns {
 public:
  NodeColumns(const SceneRows& rows, const Eigen::Vector3d& origin_map)
      : rows_(rows),
        origin_map_(origin_map),
        kinds_(rows.graph().symbols()),
        classes_(rows.graph().symbols()) {}

  void Add(const ViewNode& node, const RegionInfo* region) {
    ++row_count_;
    Append(node.id.value, &ids_);
    const NodeId parent = rows_.graph().Parent(node.id);
    Append(parent.empty() ? SceneRows::kNoRow : rows_.RowOf(parent), &parents_);
    AddPose(rows_.PoseOf(node));
    boxes_.Add(BoxOf(node));
    kind_indices_.Add(kinds_.IndexOf(node.kind));
    class_indices_.Add(classes_.IndexOf(node.class_name));
    colors_.Add(node.color.value_or(Color{}));
    valid_from_.Add(node.valid.from_ns);
    valid_to_.Add(node.valid.to_ns);
    names_ += rows_.graph().symbols().Text(node.name);
    name_ends_.EndRow(static_cast<uint32_t>(names_.size()));
    clearances_.Add(static_cast<float>(node.clearance_m));
    AddRegion(region);
  }

  int row_count() const { return row_count_; }
  size_t size_bytes() const {
    // What is the same in every row is not sent, but bounds the message all the same.
    return static_cast<size_t>(row_count_) * 28 + orientations_.size_bytes() + names_.size() +
           outlines_.size();
  }

  void Fill(v1::SceneNodes* out) {
    out->set_row_count(row_count_);
    *out->mutable_ids() = std::move(ids_);
    *out->mutable_parents() = std::move(parents_);
    *out->mutable_positions() = std::move(positions_);
    *out->mutable_orientations() = orientations_.Take();
    *out->mutable_boxes() = boxes_.Take();
    kinds_.Fill(out->mutable_kinds());
    *out->mutable_kind_indices() = kind_indices_.Take();
    classes_.Fill(out->mutable_classes());
    *out->mutable_class_indices() = class_indices_.Take();
    *out->mutable_colors() = colors_.Take();
    *out->mutable_valid_from_ns() = valid_from_.Take();
    *out->mutable_valid_to_ns() = valid_to_.Take();
    *out->mutable_name_ends() = name_ends_.Take();
    *out->mutable_names() = std::move(names_);
    *out->mutable_clearances() = clearances_.Take();
    *out->mutable_outline_ends() = outline_ends_.Take();
    *out->mutable_outlines() = std::move(outlines_);
    *out->mutable_heights() = heights_.Take();
  }

 private:
  void AddPose(const std::optional<Pose3d>& map_T_node) {
    if (!map_T_node.has_value()) {
      AppendRow<float>(Eigen::Vector3f::Constant(kNone), &positions_);
      orientations_.Add({0, 0, 0, 1});
      return;
    }
    AppendRow<float>(map_T_node->position - origin_map_, &positions_);
    const Eigen::Vector4f q = map_T_node->orientation.coeffs().cast<float>();
    orientations_.Add({q.x(), q.y(), q.z(), q.w()});
  }

  void AddRegion(const RegionInfo* region) {
    if (region != nullptr) {
      for (const Eigen::Vector2d& corner : region->footprint_map) {
        AppendRow<float>(corner - origin_map_.head<2>(), &outlines_);
      }
    }
    outline_ends_.EndRow(static_cast<uint32_t>(outlines_.size() / (2 * sizeof(float))));
    const bool has_heights = region != nullptr && !region->footprint_map.empty();
    const double below = has_heights ? region->z_min_m - origin_map_.z() : 0.0;
    const double above = has_heights ? region->z_max_m - origin_map_.z() : 0.0;
    heights_.Add({static_cast<float>(below), static_cast<float>(above)});
  }

  const SceneRows& rows_;
  const Eigen::Vector3d origin_map_;
  int row_count_ = 0;
  std::string ids_;
  std::string parents_;
  std::string positions_;
  RareColumn<std::array<float, 4>> orientations_{{0, 0, 0, 1}};
  RareColumn<std::array<float, 6>> boxes_{{kNone, kNone, kNone, kNone, kNone, kNone}};
  Words kinds_;
  RareColumn<uint16_t> kind_indices_{0};
  Words classes_;
  RareColumn<uint16_t> class_indices_{0};
  RareColumn<Color> colors_{Color{}};
  RareColumn<TimeNs> valid_from_{kTimeMin};
  RareColumn<TimeNs> valid_to_{kTimeMax};
  PartColumn<uint32_t> name_ends_;
  std::string names_;
  RareColumn<float> clearances_{0.0F};
  PartColumn<uint32_t> outline_ends_;
  std::string outlines_;
  RareColumn<std::array<float, 2>> heights_{{0, 0}};
};

// The columns of edges of one relation that wait for a message.
class EdgeColumns {
 public:
  void Add(uint32_t source, uint32_t target, const ViewEdge& edge) {
    ++row_count_;
    Append(source, &sources_);
    Append(target, &targets_);
    weights_.Add(static_cast<float>(edge.weight));
    valid_from_.Add(edge.valid.from_ns);
    valid_to_.Add(edge.valid.to_ns);
  }

  size_t size_bytes() const { return static_cast<size_t>(row_count_) * 12; }

  void Fill(v1::SceneEdges* out) {
    out->set_row_count(row_count_);
    *out->mutable_sources() = std::move(sources_);
    *out->mutable_targets() = std::move(targets_);
    *out->mutable_weights() = weights_.Take();
    *out->mutable_valid_from_ns() = valid_from_.Take();
    *out->mutable_valid_to_ns() = valid_to_.Take();
  }

 private:
  int row_count_ = 0;
  std::string sources_;
  std::string targets_;
  RareColumn<float> weights_{1.0F};
  RareColumn<TimeNs> valid_from_{kTimeMin};
  RareColumn<TimeNs> valid_to_{kTimeMax};
};

// In whole metres, so that what was round in the map is round in the columns.
Eigen::Vector3d OriginOf(const Box3d& bounds_map) {
  if (bounds_map.isEmpty()) return Eigen::Vector3d::Zero();
  return bounds_map.center().array().round();
}

// Layers from rooms on have regions, which are in the store only.
int32_t RankOfRegions(const GraphView& graph) {
  for (const Layer& layer : graph.layers()) {
    if (layer.id == layers::kRooms) return layer.rank;
  }
  return std::numeric_limits<int32_t>::max();
}

class SceneCursor final : public EngineCursor<v1::GetSceneResponse> {
 public:
  SceneCursor(const ReadView& view, SceneRows rows, const v1::GetSceneRequest& request)
      : view_(view),
        rows_(std::move(rows)),
        relations_(request.relations().begin(), request.relations().end()),
        at_ns_(request.has_at_ns() ? std::optional(request.at_ns()) : std::nullopt),
        origin_map_(OriginOf(rows_.bounds_map())),
        rank_of_regions_(RankOfRegions(rows_.graph())),
        edge_row_(request.without_edges() ? rows_.nodes().size() : 0) {}

  bool done() const override {
    return node_row_ == rows_.nodes().size() && edge_row_ == rows_.nodes().size() &&
           waiting_.empty();
  }

 private:
  absl::Status Fill(const CallContext& call, v1::GetSceneResponse* reply) override {
    if (is_first_) {
      view_.FillHeader(reply->mutable_header());
      FillHead(reply->mutable_head());
      is_first_ = false;
    }
    if (node_row_ < rows_.nodes().size()) return FillNodes(call, reply->mutable_nodes());
    return FillEdges(call, reply);
  }

  void FillHead(v1::SceneHead* head) const {
    for (const SceneRows::LayerRows& layer : rows_.layers()) {
      v1::SceneLayer* out = head->add_layers();
      out->mutable_layer()->set_id(layer.layer.id);
      out->mutable_layer()->set_name(layer.layer.name);
      out->mutable_layer()->set_rank(layer.layer.rank);
      out->set_node_count(layer.node_count);
      out->set_sent_count(static_cast<int64_t>(layer.end - layer.begin));
    }
    ToProto(origin_map_, head->mutable_origin_map());
    if (!rows_.bounds_map().isEmpty()) ToProto(rows_.bounds_map(), head->mutable_bounds_map());
    head->set_edge_count_max(rows_.graph().edge_count());
  }

  absl::Status FillNodes(const CallContext& call, v1::SceneNodes* out) {
    while (rows_.layers()[layer_].end <= node_row_) ++layer_;
    const SceneRows::LayerRows& layer = rows_.layers()[layer_];
    out->set_layer(layer.layer.name);
    out->set_first_row(static_cast<int64_t>(node_row_));
    NodeColumns columns(rows_, origin_map_);
    while (node_row_ < layer.end && columns.size_bytes() < kPageBytesSoftMax) {
      DSG_RETURN_IF_ERROR(call.Check());
      const size_t end = std::min(layer.end, node_row_ + kRowsAtOnce);
      DSG_ASSIGN_OR_RETURN(const auto stored, RegionsOf(layer.layer, end, call.stop()));
      for (size_t i = 0; node_row_ < end; ++node_row_, ++i) {
        const bool has_region =
            i < stored.size() && stored[i].has_value() && stored[i]->region.has_value();
        columns.Add(*rows_.nodes()[node_row_], has_region ? &*stored[i]->region : nullptr);
      }
    }
    columns.Fill(out);
    return absl::OkStatus();
  }

  // The nodes of the rows up to `end` as the store has them; none of layers without regions.
  absl::StatusOr<std::vector<std::optional<Node>>> RegionsOf(const Layer& layer, size_t end,
                                                             const StopCheck& stop) const {
    if (layer.rank < rank_of_regions_) return std::vector<std::optional<Node>>();
    std::vector<NodeId> ids;
    for (size_t row = node_row_; row < end; ++row) ids.push_back(rows_.nodes()[row]->id);
    return view_.snapshot().FindNodes(ids, stop);
  }

  absl::Status FillEdges(const CallContext& call, v1::GetSceneResponse* reply) {
    for (; edge_row_ < rows_.nodes().size(); ++edge_row_) {
      if (edge_row_ % kRowsAtOnce == 0) DSG_RETURN_IF_ERROR(call.Check());
      if (waiting_bytes_ >= kPageBytesSoftMax) break;
      rows_.graph().ForEachEdgeFrom(rows_.nodes()[edge_row_]->id, [&](const ViewEdge& edge) {
        if (IsWanted(edge)) Add(edge);
        return true;
      });
    }
    if (waiting_.empty()) return absl::OkStatus();
    // The largest part makes the message.
    const auto largest = std::max_element(
        waiting_.begin(), waiting_.end(),
        [](const auto& a, const auto& b) { return a.second.size_bytes() < b.second.size_bytes(); });
    v1::SceneEdges* out = reply->mutable_edges();
    out->set_relation(rows_.graph().symbols().Text(largest->first));
    waiting_bytes_ -= largest->second.size_bytes();
    largest->second.Fill(out);
    waiting_.erase(largest);
    return absl::OkStatus();
  }

  bool IsWanted(const ViewEdge& edge) const {
    if (at_ns_.has_value() && !edge.valid.Contains(*at_ns_)) return false;
    return relations_.empty() || relations_.contains(rows_.graph().symbols().Text(edge.relation));
  }

  void Add(const ViewEdge& edge) {
    const uint32_t target = rows_.RowOf(edge.target);
    if (target == SceneRows::kNoRow) return;
    EdgeColumns& columns = waiting_[edge.relation];
    const size_t before = columns.size_bytes();
    columns.Add(static_cast<uint32_t>(edge_row_), target, edge);
    waiting_bytes_ += columns.size_bytes() - before;
  }

  const ReadView view_;
  const SceneRows rows_;
  const std::set<std::string> relations_;
  const std::optional<TimeNs> at_ns_;
  const Eigen::Vector3d origin_map_;
  const int32_t rank_of_regions_;
  bool is_first_ = true;
  size_t layer_ = 0;
  size_t node_row_ = 0;
  // The first row whose edges have not been taken yet.
  size_t edge_row_;
  std::map<Symbol, EdgeColumns> waiting_;
  size_t waiting_bytes_ = 0;
};

}  // namespace

CursorOr<v1::GetSceneResponse> GetScene(Engine* engine, const CallContext& call,
                                        const v1::GetSceneRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const GraphView> graph, view.Graph(call.stop()));
  DSG_ASSIGN_OR_RETURN(SceneRows rows,
                       SceneRows::Choose(view, std::move(graph), request, call.stop()));
  return std::make_unique<SceneCursor>(view, std::move(rows), request);
}

}  // namespace dsg::query
