// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/cli/example_content.h"

#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::test {
namespace {

Box3d BoxAround(double x_m, double y_m, double z_m) {
  const Eigen::Vector3d half = 0.5 * Eigen::Vector3d(x_m, y_m, z_m);
  return Box3d(-half, half);
}

}  // namespace

MeshBlock FlatBlock(int32_t x) {
  MeshBlock block;
  block.index = {x, 0, 0};
  const float low = 2.0f * static_cast<float>(x);
  block.positions_map = {
      {low, 0.0f, 0.0f}, {low + 2.0f, 0.0f, 0.0f}, {low + 2.0f, 4.0f, 0.0f}, {low, 4.0f, 0.0f}};
  block.labels.assign(4, 3);
  block.instance_ids.assign(4, 9);
  block.faces = {{0, 1, 2}, {0, 2, 3}};
  return block;
}

cli::MapContent ExampleContent() {
  cli::MapContent content;
  content.spec.name = "example";
  content.revision = 5;
  content.layers = DefaultLayers();
  Node room = MakeNode(NodeId('R', 1), kinds::kRoom, "Küche \"Süd\"", {2, 2, 1.5});
  room.class_name = "kitchen";
  room.region = RegionInfo{{{0, 0}, {4, 0}, {4, 4}, {0, 4}}, 0.0, 3.0, {}};
  Node hall = MakeNode(NodeId('R', 2), kinds::kRoom, "hall", {6, 2, 1.5});
  hall.box_node = BoxAround(4, 4, 3);
  Node chair = MakeNode(NodeId('O', 1), kinds::kObject, "chair\n1", {1, 1, 0.5});
  chair.class_id = 3;
  chair.class_name = "chair";
  chair.box_node = BoxAround(0.5, 1.0, 1.0);
  chair.map_T_node.orientation = Eigen::AngleAxisd(M_PI / 6.0, Eigen::Vector3d::UnitZ());
  Node wall = MakeNode(NodeId('W', 1), kinds::kStructure, "", {4, 2, 1.5});
  wall.structure = StructureInfo{"wall", Eigen::Vector3d::UnitX(), -4.0, 0};
  wall.box_node = BoxAround(0.0, 4, 3);
  content.nodes = {MakeNode(NodeId('H', 1), kinds::kHuman, "ada", {0, 0, 0}),
                   chair,
                   room,
                   hall,
                   wall,
                   MakeNode(NodeId('p', 1), kinds::kPlace, "", {2, 3, 1}),
                   MakeNode(NodeId('p', 2), kinds::kPlace, "", {6, 3, 1})};
  content.edges = {
      MakeEdge(NodeId('R', 1), relations::kContains, NodeId('p', 1)),
      MakeEdge(NodeId('p', 1), relations::kTraversable, NodeId('p', 2)),
  };
  content.tracks = {{NodeId('H', 1), {{{1, 3, 1}, {2, 3, 1}, {3, 3, 1}}, {{6, 3, 1}, {7, 3, 1}}}}};
  content.mesh = {FlatBlock(0), FlatBlock(1)};
  return content;
}

}  // namespace dsg::test
