// SPDX-License-Identifier: Apache-2.0
// Nodes and edges from hand-made parts.
#include "ingest/pipeline/layer_graph.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace dsg::ingest {
namespace {

const std::vector<SemanticLabel> kLayerLabels = {{7, "couch"}, {8, "cup"}};

TrackedObject MakeTracked(int64_t id, int32_t class_id, double x, double z) {
  TrackedObject object;
  object.id = id;
  object.cluster.class_id = class_id;
  object.cluster.map_T_box.position = {x, 1.0, z};
  object.cluster.center_map = object.cluster.map_T_box.position;
  object.cluster.size = {2.0, 0.8, 0.8};
  object.first_observed_ns = 100;
  object.last_observed_ns = 200;
  return object;
}

Place MakePlaceAt(int64_t id, double x, double floor_z) {
  Place place;
  place.id = id;
  place.position_map = {x, 0.0, floor_z};
  place.floor_z_m = floor_z;
  place.clearance_m = 0.5;
  return place;
}

FoundRoom MakeRoomAt(int64_t id, double x0, double x1, std::vector<int> places) {
  FoundRoom room;
  room.id = id;
  room.places = std::move(places);
  room.footprint_map = {{x0, -2.0}, {x1, -2.0}, {x1, 2.0}, {x0, 2.0}};
  room.z_max_m = 2.5;
  return room;
}

// Two rooms, a place in each, a couch in the first.
LayerParts TwoRoomParts() {
  LayerParts parts;
  parts.objects = {MakeTracked(4, 7, 1.0, 0.4)};
  parts.places.places = {MakePlaceAt(10, 1.0, 0.0), MakePlaceAt(11, 5.0, 0.0)};
  parts.places.links = {{0, 1, 0.4}};
  parts.place_of_object = {0};
  parts.rooms = {{MakeRoomAt(0, 0.0, 3.0, {0}), 0, RoomMethod::kCeiling, {{"lounge", 0.9}}},
                 {MakeRoomAt(1, 3.0, 6.0, {1}), 0, RoomMethod::kCeiling, {}}};
  parts.room_of_place = {0, 1};
  parts.adjacent = {{0, 1}};
  parts.storeys = {{0.0, 2.5, true, {0, 1}}};
  return parts;
}

const Node* Find(const LayerGraph& graph, NodeId id) {
  for (const Node& node : graph.nodes) {
    if (node.id == id) return &node;
  }
  return nullptr;
}

const Edge* Find(const LayerGraph& graph, NodeId source, const char* relation, NodeId target) {
  for (const Edge& edge : graph.edges) {
    if (edge.source == source && edge.relation == relation && edge.target == target) return &edge;
  }
  return nullptr;
}

TEST(LayerGraph, HangsObjectsUnderPlacesUnderRoomsUnderTheBuilding) {
  const std::vector<CadModel> no_models;
  const LayerGraph graph = LayerGraphMaker({"s", 0}, kLayerLabels, no_models).Make(TwoRoomParts());
  EXPECT_NE(Find(graph, NodeId('B', 0), relations::kContains, NodeId('R', 0)), nullptr);
  EXPECT_NE(Find(graph, NodeId('R', 0), relations::kContains, NodeId('p', 10)), nullptr);
  EXPECT_NE(Find(graph, NodeId('p', 10), relations::kContains, NodeId('O', 4)), nullptr);
  EXPECT_NE(Find(graph, NodeId('R', 0), relations::kAdjacent, NodeId('R', 1)), nullptr);
  const Edge* way = Find(graph, NodeId('p', 10), relations::kTraversable, NodeId('p', 11));
  ASSERT_NE(way, nullptr);
  EXPECT_DOUBLE_EQ(way->weight, 0.4);
  EXPECT_EQ(Find(graph, NodeId('O', 4))->class_name, "couch");
  EXPECT_EQ(Find(graph, NodeId('R', 0))->class_name, "lounge");
}

TEST(LayerGraph, BoxesHoldTheirChildren) {
  const std::vector<CadModel> no_models;
  LayerParts parts = TwoRoomParts();
  // Reaches out of its room.
  parts.objects[0].cluster.map_T_box.position.x() = -3.0;
  const LayerGraph graph = LayerGraphMaker({"s", 0}, kLayerLabels, no_models).Make(parts);
  for (const Edge& edge : graph.edges) {
    if (edge.relation != relations::kContains) continue;
    const Box3d parent = Find(graph, edge.source)->BoxMap();
    const Box3d child = Find(graph, edge.target)->BoxMap();
    EXPECT_TRUE(parent.contains(child)) << ToString(edge.source) << " " << ToString(edge.target);
  }
}

TEST(LayerGraph, TwoStoreysGetLevels) {
  const std::vector<CadModel> no_models;
  LayerParts parts = TwoRoomParts();
  parts.places.places[1].floor_z_m = 3.0;
  parts.rooms[1].storey = 1;
  parts.storeys = {{0.0, 2.5, true, {0}}, {3.0, 5.5, true, {1}}};
  const LayerGraph graph = LayerGraphMaker({"s", 0}, kLayerLabels, no_models).Make(parts);
  EXPECT_NE(Find(graph, NodeId('B', 0), relations::kContains, NodeId('L', 1)), nullptr);
  EXPECT_NE(Find(graph, NodeId('L', 1), relations::kContains, NodeId('R', 1)), nullptr);
  EXPECT_EQ(Find(graph, NodeId('B', 0), relations::kContains, NodeId('R', 1)), nullptr);
  EXPECT_EQ(Find(graph, NodeId('L', 0))->layer, kLevelLayer);
}

TEST(LayerGraph, StairsJoinTheRoomsOfTwoStoreys) {
  const std::vector<CadModel> no_models;
  LayerParts parts = TwoRoomParts();
  parts.adjacent.clear();
  parts.rooms[1].storey = 1;
  parts.storeys = {{0.0, 2.5, true, {0}}, {3.0, 5.5, true, {1}}};
  parts.places.places[1].kind = PlaceKind::kStairs;
  const LayerGraphMaker maker({"s", 0}, kLayerLabels, no_models);
  LayerGraph graph = maker.Make(parts);
  EXPECT_NE(Find(graph, NodeId('R', 0), relations::kAdjacent, NodeId('R', 1)), nullptr);
  EXPECT_EQ(Find(graph, NodeId('p', 11))->class_name, "stairs");
  EXPECT_EQ(Find(graph, NodeId('p', 10))->class_name, "");
  // Of one storey walls say who is whose neighbour.
  parts.rooms[1].storey = 0;
  graph = maker.Make(parts);
  EXPECT_EQ(Find(graph, NodeId('R', 0), relations::kAdjacent, NodeId('R', 1)), nullptr);
}

TEST(LayerGraph, WhatLeftTheWorldStaysWithItsEnd) {
  const std::vector<CadModel> no_models;
  LayerParts parts = TwoRoomParts();
  parts.gone = {{MakeTracked(5, 8, 1.5, 0.9), std::nullopt, 300}};
  parts.place_of_object = {0, 0};
  const LayerGraph graph = LayerGraphMaker({"s", 0}, kLayerLabels, no_models).Make(parts);
  const Node* cup = Find(graph, NodeId('O', 5));
  ASSERT_NE(cup, nullptr);
  EXPECT_EQ(cup->valid.from_ns, 100);
  EXPECT_EQ(cup->valid.to_ns, 300);
  const Edge* contains = Find(graph, NodeId('p', 10), relations::kContains, NodeId('O', 5));
  ASSERT_NE(contains, nullptr);
  EXPECT_EQ(contains->valid.to_ns, 300);
}

TEST(LayerGraph, AKnownShapeBringsItsModelAndItsWholeBox) {
  CadModel model;
  model.name = "couch_2";
  model.vertices = {{-1.0, -0.5, 0.0}, {1.0, 0.5, 0.9}};
  model.asset.sha256.fill(7);
  const std::vector<CadModel> models = {model};
  LayerParts parts = TwoRoomParts();
  ShapeFit fit;
  fit.model = 0;
  fit.map_T_model.position = {2.0, 1.0, 0.1};
  fit.inlier_share = 0.8;
  parts.fits.emplace(4, fit);
  const LayerGraph graph = LayerGraphMaker({"s", 0}, kLayerLabels, models).Make(parts);
  const Node* couch = Find(graph, NodeId('O', 4));
  ASSERT_TRUE(couch->object->model.has_value());
  EXPECT_EQ((*couch->object->model)[0], 7);
  EXPECT_NEAR(couch->map_T_node.position.z(), 0.1 + 0.45, 1e-12);
  EXPECT_TRUE(couch->object->size.isApprox(Eigen::Vector3d(2.0, 1.0, 0.9)));
  EXPECT_DOUBLE_EQ(*couch->confidence, 0.8);
}

TEST(LayerGraph, SessionsKeepApart) {
  const std::vector<CadModel> no_models;
  const LayerGraph graph = LayerGraphMaker({"s", 3}, kLayerLabels, no_models).Make(TwoRoomParts());
  EXPECT_NE(Find(graph, NodeId('O', 3'000'004)), nullptr);
  const Node* building = Find(graph, NodeId('B', 3'000'000));
  ASSERT_NE(building, nullptr);
  EXPECT_EQ(building->attributes.at(kSessionAttribute), AttributeValue(std::string("s")));
}

TEST(LayerGraph, IsEmptyWithoutParts) {
  const std::vector<CadModel> no_models;
  const LayerGraph graph = LayerGraphMaker({"s", 0}, kLayerLabels, no_models).Make(LayerParts());
  EXPECT_TRUE(graph.nodes.empty());
  EXPECT_TRUE(graph.edges.empty());
}

}  // namespace
}  // namespace dsg::ingest
