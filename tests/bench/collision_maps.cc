// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/collision_maps.h"

#include <utility>

#include "query/engine/collision/shapes.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/w2_graph.h"

namespace dsg::bench {
namespace {

constexpr size_t kCommitSize = 100'000;

absl::Status CommitTo(GraphStore* store, const std::string& map, GraphDelta graph) {
  MapSpec spec;
  spec.name = map;
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(map));
  graph.map = map;
  graph.session_id = "collision_bench";
  graph.sequence = 1;
  for (GraphDelta& part : SplitDelta(std::move(graph), kCommitSize)) {
    DSG_RETURN_IF_ERROR(writer->Commit(std::move(part)).status());
  }
  return absl::OkStatus();
}

// The sides of all objects, two triangles each.
GraphDelta SidesOfObjects(const GraphDelta& graph, double block_size_m) {
  static constexpr int kSides[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
  MeshBlock whole;
  for (const Node& node : graph.nodes) {
    if (node.layer != layers::kObjects) continue;
    const query::Convex box = query::MakeBox(node.map_T_node, node.box_node);
    const auto first = static_cast<uint32_t>(whole.positions_map.size());
    for (const Eigen::Vector3d& corner : box.corners) {
      whole.positions_map.push_back(corner.cast<float>());
    }
    for (const auto& side : kSides) {
      const auto at = [&](int i) { return first + static_cast<uint32_t>(side[i]); };
      whole.faces.push_back({at(0), at(1), at(2)});
      whole.faces.push_back({at(0), at(2), at(3)});
    }
  }
  GraphDelta delta;
  delta.mesh_blocks = SplitIntoBlocks(whole, block_size_m);
  return delta;
}

}  // namespace

absl::Status MakeCollisionMaps(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, options));
  GraphDelta graph = W2Graph();
  DSG_RETURN_IF_ERROR(
      CommitTo(store.get(), kW2MeshMap, SidesOfObjects(graph, MapSpec().mesh_block_size_m)));
  return CommitTo(store.get(), kW2Map, std::move(graph));
}

}  // namespace dsg::bench
