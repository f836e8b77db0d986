// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/layers_stage.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/pipeline/map_things.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

bool IsRegion(const Node& node) {
  return node.layer == layers::kRooms || node.layer == layers::kPlaces;
}

std::vector<SemanticLabel> LabelsOf(const LogInfo& info) {
  return info.channel_counts.contains("label0") ? info.labels : std::vector<SemanticLabel>();
}

}  // namespace

MappingOptions WithClasses(MappingOptions options, const LogInfo& info) {
  if (options.depth.dynamic_classes.empty()) {
    options.depth.dynamic_classes = DynamicClasses(LabelsOf(info));
  }
  options.depth.range_m = options.volume.range_m;
  return options;
}

absl::StatusOr<NodeNumbering> NumberLayers(const MapView& map, const std::string& session_id) {
  NodeNumbering numbering{session_id, 0};
  for (const LayerId layer : {layers::kBuildings, layers::kRooms, layers::kPlaces,
                              layers::kStructures, layers::kObjects}) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Node> nodes, map.NodesOfLayer(layer));
    for (const Node& node : nodes) {
      const auto number = static_cast<int64_t>(node.id.index() / NodeNumbering::kPerSession);
      const auto session = node.attributes.find(kSessionAttribute);
      if (layer == layers::kBuildings && session != node.attributes.end() &&
          session->second == AttributeValue(session_id)) {
        numbering.session_number = number;
        return numbering;
      }
      numbering.session_number = std::max(numbering.session_number, number + 1);
    }
  }
  return numbering;
}

LayersStage::LayersStage(const LogInfo& info, const MappingOptions& options,
                         const NodeNumbering& numbering, double mesh_block_size_m, bool is_on)
    : labels_(LabelsOf(info)),
      mesh_block_size_m_(mesh_block_size_m),
      is_on_(is_on),
      layers_(options, labels_, numbering),
      mesh_told_(options.mesh_wait_max_ns, options.layers.mesh_wait_min_ns) {}

absl::Status LayersStage::See(const DepthFrame& frame) { return layers_.Integrate(frame); }

void LayersStage::Tell(Findings* findings, GraphDelta* delta) {
  findings->has_new_layers =
      is_on_ && (is_closed_ || findings->is_moved || layers_.IsUpdateDue(findings->now_ns));
  if (!is_on_) return;
  TellMesh(*findings, delta);
  if (findings->has_new_layers) TellLayers(findings, delta);
  findings->status.Update(layers_.status());
}

void LayersStage::TellMesh(const Findings& findings, GraphDelta* delta) {
  for (const BlockIndex& index : layers_.UpdateMesh(mesh_block_size_m_)) {
    mesh_told_.Note(index, layers_.FindBlock(index) != nullptr, findings.now_ns);
  }
  MeshTold::Due due = mesh_told_.TakeDue(findings.now_ns, findings.is_last || findings.is_moved);
  delta->mesh_removals = std::move(due.removed);
  for (const BlockIndex& index : due.written) {
    delta->mesh_blocks.push_back(*layers_.FindBlock(index));
  }
}

void LayersStage::TellLayers(Findings* findings, GraphDelta* delta) {
  LayerGraph graph = layers_.Update(findings->now_ns, is_closed_);
  findings->regions = {};
  findings->sight = layers_.Sight();
  findings->floors_m = layers_.floors_m();
  bool has_levels = false;
  for (const Node& node : graph.nodes) {
    has_levels = has_levels || node.layer == kLevelLayer;
    if (IsRegion(node)) findings->regions.nodes.push_back(node);
  }
  for (const Edge& edge : graph.edges) {
    if (edge.relation == relations::kContains) findings->regions.edges.push_back(edge);
  }
  graph_ = graph;
  GraphDelta change = told_.Tell(std::move(graph));
  change.assets = layers_.TakeAssets();
  if (!is_begun_ && !change.empty()) {
    is_begun_ = true;
    change.labels = NamesOf(labels_);
  }
  if (has_levels) change.layers.push_back(LevelLayer());
  change.mesh_blocks = std::move(delta->mesh_blocks);
  change.mesh_removals = std::move(delta->mesh_removals);
  *delta = std::move(change);
}

void LayersStage::Summarize(IngestSummary* summary) const {
  if (!is_on_) return;
  MappingSummary& mapping = summary->mapping.emplace();
  mapping.volume = layers_.counts();
  mapping.stages = layers_.clock().times();
  const int64_t number = layers_.numbering().session_number;
  if (number == 0) return;
  mapping.note = absl::StrCat(
      "the map held layers of another log, or of this one with other options: this one's nodes "
      "stand beside them, numbered from ",
      number * static_cast<int64_t>(NodeNumbering::kPerSession),
      ", and its mesh takes the place of theirs where both have a block (earlier revisions keep "
      "it); name another --map to keep them apart");
}

}  // namespace dsg::ingest
