// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_to_delta.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/spark_agents.h"
#include "schema/interop/spark_layers.h"
#include "schema/interop/spark_mesh.h"
#include "schema/interop/spark_nodes.h"
#include "schema/interop/spark_own.h"
#include "schema/interop/spark_rest.h"
#include "schema/model/delta_check.h"

namespace dsg {
namespace {

constexpr char kOdometry[] = "ODOMETRY";
// Pose times this far from the ends of 64 bits leave room for sums with gaps and stays.
constexpr TimeNs kStampMaxNs = kTimeMax / 2;
// One a letter.
constexpr size_t kRobotCountMax = 52;

class SparkDeltaBuilder {
 public:
  SparkDeltaBuilder(SparkGraph graph, const std::string& file, double mesh_block_size_m)
      : graph_(std::move(graph)),
        file_(file),
        mesh_block_size_m_(mesh_block_size_m),
        layers_(graph_) {}

  absl::StatusOr<ImportedGraph> Build() {
    result_.format = "spark-dsg";
    result_.notes = graph_.notes;
    AddNodes();
    AddEdges();
    result_.delta.layers = layers_.custom_layers();
    AddLabels();
    AddSparkAgents(graph_, &result_.delta, &result_.notes);
    AddMesh();
    FitBoxesToChildren(&result_.delta);
    DSG_RETURN_IF_ERROR(TakeOwnParts(graph_, layers_, file_, &graph_.skips, &result_.delta));
    KeepRests();
    FindFirstTime();
    result_.skipped = graph_.skips.all();
    return std::move(result_);
  }

 private:
  struct End {
    uint64_t id = 0;
    SparkLayerKey key;
    LayerId layer = 0;
    bool is_pose = false;
  };

  static std::string NameOfNode(uint64_t id) { return absl::StrCat("node ", ToString(NodeId(id))); }

  // Before anything is concluded from the times of the poses.
  void DropAbsurdStamps() {
    DropStampsOutside({-kStampMaxNs, kStampMaxNs}, "is absurd");
    std::vector<TimeNs> stamps;
    for (const SparkNode& node : graph_.nodes) {
      if (node.stamp_ns.has_value()) stamps.push_back(*node.stamp_ns);
    }
    if (stamps.empty()) return;
    const auto middle = stamps.begin() + static_cast<std::ptrdiff_t>(stamps.size() / 2);
    std::nth_element(stamps.begin(), middle, stamps.end());
    // So near to each other that a map holds all of them.
    constexpr TimeNs kReachNs = kObservedFarMaxNs / 2;
    DropStampsOutside({*middle - kReachNs, *middle + kReachNs},
                      "is more than 5 years from that of most poses");
  }

  // Of an interval both ends of which count.
  void DropStampsOutside(const Interval& times, const char* what) {
    for (SparkNode& node : graph_.nodes) {
      const TimeNs stamp_ns = node.stamp_ns.value_or(times.from_ns);
      if (times.from_ns <= stamp_ns && stamp_ns <= times.to_ns) continue;
      graph_.skips.Add(SkipKind::kNodeField, NameOfNode(node.id),
                       absl::StrCat("timestamp ", stamp_ns, " ns ", what));
      node.stamp_ns.reset();
    }
  }

  // Afterwards the graph holds the nodes that the delta has, and in the same order.
  void AddNodes() {
    DropAbsurdStamps();
    SparkNodeConverter converter(graph_, &graph_.skips);
    result_.delta.nodes.reserve(graph_.nodes.size() + kRobotCountMax);
    std::erase_if(graph_.nodes, [&](SparkNode& node) { return !AddNode(node, &converter); });
    result_.node_count = static_cast<int64_t>(graph_.nodes.size());
    for (std::string& note : converter.notes()) result_.notes.push_back(std::move(note));
  }

  bool AddNode(SparkNode& node, SparkNodeConverter* converter) {
    if (ends_.contains(node.id)) {
      graph_.skips.Add(SkipKind::kRepeatedNode, NameOfNode(node.id), "appears twice");
      return false;
    }
    const auto placement = layers_.Place(node, &graph_.skips);
    if (!placement.has_value()) return false;
    auto converted = converter->Convert(node, *placement);
    if (!converted.has_value()) return false;
    const bool is_pose = node.type == SparkClass::kAgent;
    ends_.try_emplace(node.id, End{node.id, node.key, placement->layer.id, is_pose});
    result_.pose_count += is_pose ? 1 : 0;
    result_.delta.nodes.push_back(*std::move(converted));
    // They are the converted node's now.
    node.attributes.clear();
    node.boundary = {};
    return true;
  }

  void AddEdges() {
    result_.delta.edges.reserve(graph_.edges.size());
    std::erase_if(graph_.edges, [&](SparkEdge& edge) { return !AddEdge(edge); });
    ends_.clear();
    SortEdges();
    DropRepeatedEdges();
    result_.edge_count = static_cast<int64_t>(result_.delta.edges.size());
    // Of the others all has been said.
    std::erase_if(graph_.edges, [](const SparkEdge& edge) { return !edge.own.is_array(); });
    graph_.edges.shrink_to_fit();
  }

  // Source by source, as a store keeps them: an import is then checked and written in the order of
  // its rows, and not all over the map.
  void SortEdges() {
    std::vector<Edge>& edges = result_.delta.edges;
    std::vector<std::tuple<int64_t, int64_t, uint32_t>> order;
    order.reserve(edges.size());
    for (uint32_t i = 0; i < edges.size(); ++i) {
      order.emplace_back(KeyOf(edges[i].source), KeyOf(edges[i].target), i);
    }
    std::sort(order.begin(), order.end());
    // Round by round of the permutation, so that each edge, which is large, moves once.
    for (uint32_t i = 0; i < edges.size(); ++i) {
      if (std::get<2>(order[i]) == i) continue;
      Edge first = std::move(edges[i]);
      uint32_t to = i;
      for (uint32_t from = std::get<2>(order[to]); from != i; from = std::get<2>(order[to])) {
        edges[to] = std::move(edges[from]);
        std::get<2>(order[to]) = to;
        to = from;
      }
      edges[to] = std::move(first);
      std::get<2>(order[to]) = to;
    }
  }

  // Two edges between the same nodes have the same direction, and so stand together now; the first
  // of the file comes first.
  void DropRepeatedEdges() {
    std::vector<Edge>& edges = result_.delta.edges;
    const auto same = [this](const Edge& first, const Edge& next) {
      if (first.source != next.source || first.target != next.target) return false;
      const SparkEdge named = {next.source.value, next.target.value, false, 1.0, ""};
      SkipEdge(SkipKind::kRepeatedEdge, named, "appears twice");
      return true;
    };
    edges.erase(std::unique(edges.begin(), edges.end(), same), edges.end());
  }

  // False, and counted, if the edge cannot be kept.
  bool AddEdge(SparkEdge& in) {
    const auto source = ends_.find(in.source);
    const auto target = ends_.find(in.target);
    if (source == ends_.end() || target == ends_.end()) {
      const uint64_t missing = source == ends_.end() ? in.source : in.target;
      return SkipEdge(
          SkipKind::kDanglingEdge, in,
          absl::StrCat("node ", missing, " (", ToString(NodeId(missing)), ") is not in the file"));
    }
    if (in.source == in.target) return SkipEdge(SkipKind::kLoopEdge, in, "ends where it begins");
    if (!std::isfinite(in.weight)) {
      SkipEdge(SkipKind::kEdgeField, in, "weight is not finite; 1 stands in its stead");
      in.weight = 1.0;
    }
    if (in.metadata.size() > kAttributeLengthMax) {
      SkipEdge(SkipKind::kEdgeField, in, "metadata is longer than 64 KiB");
      in.metadata.clear();
    }
    Edge edge = Relate(source->second, target->second);
    edge.weight = in.weight;
    if (in.weighted) edge.attributes["weighted"] = true;
    if (!in.metadata.empty()) edge.attributes["metadata"] = std::move(in.metadata);
    result_.delta.edges.push_back(std::move(edge));
    return true;
  }

  bool SkipEdge(SkipKind kind, const SparkEdge& edge, const std::string& what) {
    graph_.skips.Add(
        kind,
        absl::StrCat("edge ", ToString(NodeId(edge.source)), " to ", ToString(NodeId(edge.target))),
        what);
    return false;
  }

  // The file's edges have neither direction nor name; both follow from the layers of their ends.
  static Edge Relate(const End& a, const End& b) {
    const int64_t layer_a = a.key.layer;
    const int64_t layer_b = b.key.layer;
    if (layer_a != layer_b) {
      const End& parent = layer_a > layer_b ? a : b;
      const End& child = layer_a > layer_b ? b : a;
      if (!child.is_pose) return MakeEdge(parent, relations::kContains, child);
      // A pose is an instant of an agent, not a part of the place.
      return MakeEdge(child, parent.layer == layers::kPlaces ? relations::kNearestPlace : kPoseIn,
                      parent);
    }
    const End& low = a.id < b.id ? a : b;
    const End& high = a.id < b.id ? b : a;
    return MakeEdge(low, RelationWithin(a, b), high);
  }

  static const char* RelationWithin(const End& a, const End& b) {
    if (a.is_pose && b.is_pose) return kOdometry;
    return a.key == b.key ? SiblingRelation(a.layer) : relations::kNear;
  }

  static Edge MakeEdge(const End& source, const char* relation, const End& target) {
    Edge edge;
    edge.source = NodeId(source.id);
    edge.relation = relation;
    edge.target = NodeId(target.id);
    return edge;
  }

  // The file has a label space for each layer, a map has one: the first layer's name stands.
  void AddLabels() {
    std::map<int32_t, std::string> names;
    int64_t conflict_count = 0;
    for (const auto& [key, labels] : graph_.label_spaces) {
      for (const SemanticLabel& label : labels) {
        const auto [it, added] = names.try_emplace(label.id, label.name);
        if (!added && it->second != label.name) ++conflict_count;
      }
    }
    for (const auto& [id, name] : names) result_.delta.labels.push_back({id, name});
    if (conflict_count > 0) {
      result_.notes.push_back(
          absl::StrCat(conflict_count,
                       " labels have another name in another layer; the map's list has the "
                       "lowest layer's, each node has its own"));
    }
  }

  // What nodes, edges and graph say beyond what a map has fields for, so that an export is whole.
  void KeepRests() {
    const MeshNumbering numbering(graph_, mesh_block_size_m_);
    std::unordered_map<NodeId, Node*> nodes;
    for (Node& node : result_.delta.nodes) nodes[node.id] = &node;
    int64_t lost_count = 0;
    for (SparkNode& read : graph_.nodes) {
      const auto node = nodes.find(NodeId(read.id));
      // An export says itself what the attributes were.
      if (node == nodes.end() || read.own.is_object()) continue;
      const bool keep_key = !layers_.own_layers().contains(read.key);
      nlohmann::json fields = SparseFieldsOf(read);
      if (numbering.is_needed()) numbering.Renumber(&fields);
      if (!KeepRest(read, fields, keep_key, node->second)) ++lost_count;
      // Each node is kept once: what was read of it goes as what is kept of it comes.
      read.packed_fields = {};
    }
    if (!KeepGraphRest(graph_, &result_.delta)) ++lost_count;
    if (lost_count > 0) {
      result_.notes.push_back(absl::StrCat(
          lost_count, " nodes say more than a node of a map can keep; an export lacks it"));
    }
  }

  void AddMesh() {
    if (!graph_.mesh.has_value()) return;
    MeshBlock mesh = *graph_.mesh;
    const size_t count = mesh.positions_map.size();
    DropUneven(count, "colors", &mesh.colors);
    DropUneven(count, "labels", &mesh.labels);
    DropUneven(count, "stamps", &mesh.last_seen_ns);
    DropUneven(count, "first_seen_stamps", &mesh.first_seen_ns);
    DropUnsound(&graph_.skips, &mesh);
    result_.mesh_vertex_count = static_cast<int64_t>(mesh.positions_map.size());
    result_.mesh_face_count = static_cast<int64_t>(mesh.faces.size());
    result_.delta.mesh_blocks = SplitIntoBlocks(mesh, mesh_block_size_m_);
  }

  template <typename T>
  void DropUneven(size_t count, const char* name, std::vector<T>* channel) {
    if (channel->empty() || channel->size() == count) return;
    result_.notes.push_back(absl::StrCat("mesh ", name, " were left out: ", channel->size(),
                                         " for ", count, " vertices"));
    channel->clear();
  }

  void FindFirstTime() {
    std::optional<TimeNs> first_ns;
    const auto consider = [&](std::optional<TimeNs> time_ns) {
      if (time_ns.has_value() && (!first_ns.has_value() || *time_ns < *first_ns)) {
        first_ns = time_ns;
      }
    };
    for (const Node& node : result_.delta.nodes) {
      consider(node.first_observed_ns);
      consider(node.last_observed_ns);
    }
    result_.first_ns = first_ns.value_or(0);
  }

  SparkGraph graph_;
  const std::string& file_;
  double mesh_block_size_m_;
  SparkLayers layers_;
  std::unordered_map<uint64_t, End> ends_;
  ImportedGraph result_;
};

}  // namespace

absl::StatusOr<ImportedGraph> SparkToDelta(SparkGraph graph, const std::string& file,
                                           double mesh_block_size_m) {
  return SparkDeltaBuilder(std::move(graph), file, mesh_block_size_m).Build();
}

}  // namespace dsg
