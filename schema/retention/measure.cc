// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/measure.h"

#include <algorithm>

#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg {
namespace {

// One pass over the edges for all selections.
absl::Status MeasureEdges(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                          std::vector<Measured>* all) {
  std::vector<uint32_t> position(index.nodes().size());
  for (uint32_t i = 0; i < index.bottom_up().size(); ++i) position[index.bottom_up()[i]] = i;
  for (Measured& one : *all) one.edge_counts.assign(index.nodes().size(), 0);
  // One that a commit replaces meanwhile may be shown twice; the counts are for reports and sizes.
  return map.ReadAllEdges(stop, [&](const Edge& edge) {
    const int64_t source = index.Find(edge.source);
    const int64_t target = index.Find(edge.target);
    if (source < 0 || target < 0) return;
    for (Measured& one : *all) {
      const bool source_goes = one.selection.is_gone[static_cast<size_t>(source)];
      const bool target_goes = one.selection.is_gone[static_cast<size_t>(target)];
      if (!source_goes && !target_goes) continue;
      uint32_t first = position[static_cast<size_t>(source_goes ? source : target)];
      if (source_goes && target_goes) {
        first = std::min(first, position[static_cast<size_t>(target)]);
      }
      ++one.edge_counts[first];
      ++one.amount.edge_count;
      one.amount.byte_count += static_cast<int64_t>(EncodeEdgePayload(edge).size());
    }
  });
}

void MeasureNodes(const GraphIndex& index, Measured* measured) {
  for (size_t i = 0; i < index.nodes().size(); ++i) {
    if (!measured->selection.is_gone[i]) continue;
    ++measured->amount.node_count;
    measured->amount.byte_count += index.nodes()[i].byte_count;
  }
}

absl::Status MeasureMesh(const Snapshot& map, const StopCheck& stop, Measured* measured) {
  const Selection& selection = measured->selection;
  if (!selection.all_mesh && selection.solids.empty()) return absl::OkStatus();
  measured->mesh.solids = selection.solids;
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> blocks, map.MeshBlocks());
  for (const BlockIndex& index : blocks) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const MeshBlock block, map.ReadMeshBlock(index));
    if (!selection.all_mesh && !MayTouch(block, selection.solids)) continue;
    bool is_cut = true;
    MeshBlock rest;
    if (!selection.all_mesh) rest = CutMesh(block, selection.solids, &is_cut);
    if (!is_cut) continue;
    ++measured->amount.mesh_block_count;
    auto byte_count = static_cast<int64_t>(EncodeMeshBlock(block).size());
    if (rest.positions_map.empty()) {
      measured->mesh.removed.push_back(index);
    } else {
      measured->mesh.cut.push_back(index);
      byte_count -= static_cast<int64_t>(EncodeMeshBlock(rest).size());
    }
    measured->amount.byte_count += std::max<int64_t>(byte_count, 0);
  }
  return absl::OkStatus();
}

// Topologies of shapes that stay.
absl::Status DropKeptTopologies(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                                const Measured& measured, std::set<Sha256>* assets) {
  for (const TrackInfo& track : index.tracks()) {
    const auto plan = std::find_if(measured.tracks.begin(), measured.tracks.end(),
                                   [&](const TrackPlan& one) { return one.agent == track.agent; });
    const auto goes = [&](TimeNs time_ns) {
      return plan != measured.tracks.end() &&
             std::any_of(plan->forgotten.begin(), plan->forgotten.end(),
                         [&](const Interval& span) { return span.Contains(time_ns); });
    };
    DSG_RETURN_IF_ERROR(map.ReadShapes(track.agent, kTimeMin, kTimeMax, /*with_vertices=*/false,
                                       stop, [&](const ShownShape& shown) {
                                         if (shown.topology.has_value() &&
                                             !goes(shown.shape.time_ns)) {
                                           assets->erase(*shown.topology);
                                         }
                                         return !assets->empty();
                                       }));
  }
  return absl::OkStatus();
}

// Assets to which only what goes refers.
absl::Status MeasureAssets(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                           std::set<Sha256> assets, Measured* measured) {
  const bool has_topologies = !assets.empty();
  const auto& is_gone = measured->selection.is_gone;
  const auto asset_of = [&](size_t i) {
    return index.assets()[static_cast<size_t>(index.nodes()[i].asset)];
  };
  for (size_t i = 0; i < is_gone.size(); ++i) {
    if (is_gone[i] && index.nodes()[i].asset >= 0) assets.insert(asset_of(i));
  }
  if (assets.empty()) return absl::OkStatus();
  for (size_t i = 0; i < is_gone.size(); ++i) {
    if (!is_gone[i] && index.nodes()[i].asset >= 0) assets.erase(asset_of(i));
  }
  if (has_topologies) {
    DSG_RETURN_IF_ERROR(DropKeptTopologies(map, index, stop, *measured, &assets));
  }
  for (const Sha256& sha256 : assets) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const Asset asset, map.ReadAsset(sha256));
    ++measured->amount.asset_count;
    measured->amount.byte_count += static_cast<int64_t>(asset.content.size());
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Measure(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                     std::vector<Measured>* all) {
  DSG_RETURN_IF_ERROR(MeasureEdges(map, index, stop, all));
  for (Measured& one : *all) {
    MeasureNodes(index, &one);
    std::set<Sha256> topologies;
    DSG_RETURN_IF_ERROR(MeasureTracks(map, index, stop, &one, &topologies));
    DSG_RETURN_IF_ERROR(MeasureStays(map, index, stop, &one));
    DSG_RETURN_IF_ERROR(MeasureMesh(map, stop, &one));
    DSG_RETURN_IF_ERROR(MeasureAssets(map, index, stop, std::move(topologies), &one));
  }
  return absl::OkStatus();
}

}  // namespace dsg
