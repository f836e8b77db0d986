// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_to_delta.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/file_error.h"
#include "schema/interop/graph_rest.h"
#include "schema/interop/mesh_numbering.h"
#include "schema/interop/own_parts.h"
#include "schema/interop/spark_agents.h"
#include "schema/interop/spark_layers.h"
#include "schema/interop/spark_nodes.h"
#include "schema/interop/spark_rest.h"
#include "schema/model/delta_check.h"

namespace dsg {
namespace {

constexpr char kOdometry[] = "ODOMETRY";
// Pose times this far from the ends of 64 bits leave room for sums with gaps and stays.
constexpr TimeNs kStampMaxNs = kTimeMax / 2;

class SparkDeltaBuilder {
 public:
  SparkDeltaBuilder(const SparkGraph& graph, const std::string& file, double mesh_block_size_m)
      : graph_(graph), file_(file), mesh_block_size_m_(mesh_block_size_m), layers_(graph) {}

  absl::StatusOr<ImportedGraph> Build() {
    result_.format = "spark-dsg";
    result_.notes = graph_.notes;
    DSG_RETURN_IF_ERROR(AddNodes());
    DSG_RETURN_IF_ERROR(AddEdges());
    result_.delta.layers = layers_.custom_layers();
    AddLabels();
    AddSparkAgents(graph_, &result_.delta, &result_.notes);
    DSG_RETURN_IF_ERROR(AddMesh());
    FitBoxesToChildren(&result_.delta);
    DSG_RETURN_IF_ERROR(TakeOwnParts(graph_, layers_, file_, &result_.delta));
    KeepRests();
    FindFirstTime();
    return std::move(result_);
  }

 private:
  struct End {
    const SparkNode* node = nullptr;
    LayerId layer = 0;
    bool is_pose = false;
  };

  absl::Status AddNodes() {
    SparkNodeConverter converter(graph_, file_);
    for (const SparkNode& node : graph_.nodes) {
      const std::string where = absl::StrCat("node ", ToString(NodeId(node.id)));
      DSG_ASSIGN_OR_RETURN(const SparkPlacement placement, layers_.Place(node, file_));
      DSG_ASSIGN_OR_RETURN(Node converted, converter.Convert(node, placement));
      const bool is_pose = node.type == SparkClass::kAgent;
      if (!ends_.try_emplace(node.id, End{&node, placement.layer.id, is_pose}).second) {
        return FileError(file_, where, "appears twice");
      }
      const TimeNs stamp_ns = node.stamp_ns.value_or(0);
      if (stamp_ns > kStampMaxNs || stamp_ns < -kStampMaxNs) {
        return FileError(file_, where, absl::StrCat("timestamp ", stamp_ns, " is absurd"));
      }
      result_.pose_count += is_pose ? 1 : 0;
      result_.delta.nodes.push_back(std::move(converted));
    }
    result_.node_count = static_cast<int64_t>(graph_.nodes.size());
    for (std::string& note : converter.notes()) result_.notes.push_back(std::move(note));
    return absl::OkStatus();
  }

  absl::StatusOr<End> FindEnd(uint64_t id, const std::string& where) const {
    const auto found = ends_.find(id);
    if (found != ends_.end()) return found->second;
    return FileError(file_, where,
                     absl::StrCat("node ", id, " (", ToString(NodeId(id)), ") is not in the file"));
  }

  absl::Status AddEdges() {
    std::set<std::pair<uint64_t, uint64_t>> seen;
    for (const SparkEdge& in : graph_.edges) {
      const std::string where =
          absl::StrCat("edge ", ToString(NodeId(in.source)), " to ", ToString(NodeId(in.target)));
      DSG_ASSIGN_OR_RETURN(const End source, FindEnd(in.source, where));
      DSG_ASSIGN_OR_RETURN(const End target, FindEnd(in.target, where));
      if (in.source == in.target) return FileError(file_, where, "ends where it begins");
      if (!seen.insert(std::minmax(in.source, in.target)).second) {
        return FileError(file_, where, "appears twice");
      }
      if (!std::isfinite(in.weight)) return FileError(file_, where, "weight is not finite");
      Edge edge = Relate(source, target);
      edge.weight = in.weight;
      if (in.weighted) edge.attributes["weighted"] = true;
      if (in.metadata.size() > kAttributeLengthMax) {
        return FileError(file_, where, "metadata is longer than 64 KiB");
      }
      if (!in.metadata.empty()) edge.attributes["metadata"] = in.metadata;
      result_.delta.edges.push_back(std::move(edge));
    }
    result_.edge_count = static_cast<int64_t>(graph_.edges.size());
    return absl::OkStatus();
  }

  // The file's edges have neither direction nor name; both follow from the layers of their ends.
  static Edge Relate(const End& a, const End& b) {
    const int64_t layer_a = a.node->key.layer;
    const int64_t layer_b = b.node->key.layer;
    if (layer_a != layer_b) {
      const End& parent = layer_a > layer_b ? a : b;
      const End& child = layer_a > layer_b ? b : a;
      if (!child.is_pose) return MakeEdge(parent, relations::kContains, child);
      // A pose is an instant of an agent, not a part of the place.
      return MakeEdge(child, parent.layer == layers::kPlaces ? relations::kNearestPlace : kPoseIn,
                      parent);
    }
    const End& low = a.node->id < b.node->id ? a : b;
    const End& high = a.node->id < b.node->id ? b : a;
    return MakeEdge(low, SiblingRelation(a, b), high);
  }

  static const char* SiblingRelation(const End& a, const End& b) {
    if (a.is_pose && b.is_pose) return kOdometry;
    if (a.node->key != b.node->key) return relations::kNear;
    if (a.layer == layers::kPlaces) return relations::kTraversable;
    if (a.layer == layers::kRooms) return relations::kAdjacent;
    return relations::kNear;
  }

  static Edge MakeEdge(const End& source, const char* relation, const End& target) {
    Edge edge;
    edge.source = NodeId(source.node->id);
    edge.relation = relation;
    edge.target = NodeId(target.node->id);
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
    for (const SparkNode& read : graph_.nodes) {
      const auto node = nodes.find(NodeId(read.id));
      // An export says itself what the attributes were.
      if (node == nodes.end() || read.own.is_object()) continue;
      const bool keep_key = !layers_.own_layers().contains(read.key);
      const bool is_kept = numbering.is_needed()
                               ? KeepRest(numbering.Renumber(read), keep_key, node->second)
                               : KeepRest(read, keep_key, node->second);
      if (!is_kept) ++lost_count;
    }
    if (!KeepGraphRest(graph_, &result_.delta)) ++lost_count;
    if (lost_count > 0) {
      result_.notes.push_back(absl::StrCat(
          lost_count, " nodes say more than a node of a map can keep; an export lacks it"));
    }
  }

  absl::Status AddMesh() {
    if (!graph_.mesh.has_value()) return absl::OkStatus();
    MeshBlock mesh = *graph_.mesh;
    const size_t count = mesh.positions_map.size();
    for (size_t i = 0; i < count; ++i) {
      const auto& position = mesh.positions_map[i];
      if (position.allFinite() && position.cwiseAbs().maxCoeff() <= kCoordinateMaxM) continue;
      return FileError(file_, absl::StrCat("mesh vertex ", i),
                       absl::StrCat("is not finite or beyond ", kCoordinateMaxM, " m"));
    }
    for (size_t i = 0; i < mesh.faces.size(); ++i) {
      const uint32_t highest = *std::max_element(mesh.faces[i].begin(), mesh.faces[i].end());
      if (highest < count) continue;
      return FileError(file_, absl::StrCat("mesh face ", i),
                       absl::StrCat("has vertex ", highest, "; there are ", count));
    }
    DropUneven(count, "colors", &mesh.colors);
    DropUneven(count, "labels", &mesh.labels);
    DropUneven(count, "stamps", &mesh.last_seen_ns);
    DropUneven(count, "first_seen_stamps", &mesh.first_seen_ns);
    result_.mesh_vertex_count = static_cast<int64_t>(count);
    result_.mesh_face_count = static_cast<int64_t>(mesh.faces.size());
    result_.delta.mesh_blocks = SplitIntoBlocks(mesh, mesh_block_size_m_);
    return absl::OkStatus();
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

  const SparkGraph& graph_;
  const std::string& file_;
  double mesh_block_size_m_;
  SparkLayers layers_;
  std::unordered_map<uint64_t, End> ends_;
  ImportedGraph result_;
};

}  // namespace

absl::StatusOr<ImportedGraph> SparkToDelta(const SparkGraph& graph, const std::string& file,
                                           double mesh_block_size_m) {
  return SparkDeltaBuilder(graph, file, mesh_block_size_m).Build();
}

}  // namespace dsg
