// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/objects.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg::evaluation {
namespace {

Pose3d StandingAt(double x, double y, double yaw = 0.0) {
  return {{x, y, 0.4}, Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
}

TrueObject Chair(double x, double y) {
  TrueObject object;
  object.class_name = "chair";
  object.map_T_object = StandingAt(x, y);
  object.size = {0.5, 0.5, 0.8};
  return object;
}

TrueObject Couch(double x, double y, double yaw) {
  TrueObject object = Chair(x, y);
  object.class_name = "couch";
  object.map_T_object = StandingAt(x, y, yaw);
  object.size = {2.0, 1.0, 0.8};
  object.has_cad = true;
  return object;
}

EstimatedObject NodeOf(const TrueObject& object) {
  EstimatedObject node;
  node.class_name = object.class_name;
  node.position_map = object.map_T_object.position;
  node.box_map = TransformBox(object.map_T_object, Box3d(-0.5 * object.size, 0.5 * object.size));
  if (object.has_cad) {
    node.map_T_model = object.map_T_object;
    node.map_T_model->position.z() -= 0.5 * object.size.z();
  }
  return node;
}

std::vector<TrueObject> ObjectTruth() {
  return {Chair(0, 0), Chair(0.8, 0), Chair(5, 5), Couch(3, 0, 0.5), Couch(3, 4, 2.0)};
}

std::vector<EstimatedObject> PerfectObjects() {
  std::vector<EstimatedObject> nodes;
  for (const TrueObject& object : ObjectTruth()) nodes.push_back(NodeOf(object));
  return nodes;
}

ObjectResult ScoreObjects(const std::vector<EstimatedObject>& nodes) {
  return EvaluateObjects(nodes, ObjectTruth(), {});
}

TEST(ObjectMetric, IsPerfectForTheTruthItself) {
  const ObjectResult result = ScoreObjects(PerfectObjects());
  for (const ObjectScore& score : {result.unknown, result.known}) {
    EXPECT_NEAR(*score.mean_error_m, 0.0, 1e-12);
    EXPECT_DOUBLE_EQ(*score.found_ratio, 1.0);
    EXPECT_DOUBLE_EQ(*score.precision, 1.0);
    EXPECT_DOUBLE_EQ(*score.f1, 1.0);
  }
  EXPECT_NEAR(*result.known.mean_yaw_deg, 0.0, 1e-6);
  EXPECT_DOUBLE_EQ(*result.merge_rate, 0.0);
  EXPECT_DOUBLE_EQ(*result.split_rate, 0.0);
  EXPECT_EQ(result.truth_of, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(ObjectMetric, HidesNothingBehindTheGate) {
  std::vector<EstimatedObject> nodes = PerfectObjects();
  nodes[2].position_map.x() += 6.0;
  const ObjectScore unknown = ScoreObjects(nodes).unknown;
  EXPECT_NEAR(*unknown.mean_error_m, 0.0, 1e-12);
  EXPECT_NEAR(*unknown.found_ratio, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(*unknown.mean_ungated_m, 2.0, 1e-9);
  EXPECT_DOUBLE_EQ(*unknown.found_ratio_ungated, 1.0);
}

TEST(ObjectMetric, MeasuresAShiftAndATurn) {
  std::vector<EstimatedObject> nodes = PerfectObjects();
  for (EstimatedObject& node : nodes) {
    node.position_map.x() += 0.3;
    if (!node.map_T_model.has_value()) continue;
    node.map_T_model->position.y() += 0.2;
    node.map_T_model->orientation =
        Eigen::AngleAxisd(M_PI / 18.0, Eigen::Vector3d::UnitZ()) * node.map_T_model->orientation;
  }
  const ObjectResult result = ScoreObjects(nodes);
  EXPECT_NEAR(*result.unknown.mean_error_m, 0.3, 1e-9);
  EXPECT_NEAR(*result.known.mean_error_m, 0.2, 1e-9);
  EXPECT_NEAR(*result.known.mean_yaw_deg, 10.0, 1e-6);
}

TEST(ObjectMetric, ForgivesATurnThatNobodyCanSee) {
  TrueObject table = Couch(0, 0, 0.2);
  EstimatedObject node = NodeOf(table);
  node.map_T_model->orientation =
      Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()) * node.map_T_model->orientation;
  EXPECT_NEAR(*EvaluateObjects({node}, {table}, {}).known.mean_yaw_deg, 180.0, 1e-6);
  table.symmetry_order = 2;
  EXPECT_NEAR(*EvaluateObjects({node}, {table}, {}).known.mean_yaw_deg, 0.0, 1e-6);
}

TEST(ObjectMetric, HoldsTheModelsOriginToTheMiddleOfTheFloorFace) {
  std::vector<EstimatedObject> nodes = PerfectObjects();
  for (EstimatedObject& node : nodes) {
    if (node.map_T_model.has_value()) node.map_T_model->position.z() += 0.4;
  }
  EXPECT_NEAR(*ScoreObjects(nodes).known.mean_error_m, 0.4, 1e-9);
}

TEST(ObjectMetric, FindsNothingOfAWrongClass) {
  std::vector<EstimatedObject> nodes = PerfectObjects();
  for (EstimatedObject& node : nodes) node.class_name = "plant";
  const ObjectResult result = ScoreObjects(nodes);
  EXPECT_DOUBLE_EQ(*result.unknown.found_ratio, 0.0);
  EXPECT_DOUBLE_EQ(*result.unknown.f1, 0.0);
  EXPECT_DOUBLE_EQ(*result.known.found_ratio, 0.0);
  EXPECT_FALSE(result.unknown.mean_error_m.has_value());
}

TEST(ObjectMetric, SeesTwoChairsMergedToOne) {
  std::vector<EstimatedObject> nodes = PerfectObjects();
  nodes[0].position_map = {0.4, 0, 0.4};
  nodes[0].box_map.extend(nodes[1].box_map);
  nodes.erase(nodes.begin() + 1);
  const ObjectResult result = ScoreObjects(nodes);
  EXPECT_NEAR(*result.unknown.found_ratio, 2.0 / 3.0, 1e-12);
  EXPECT_DOUBLE_EQ(*result.unknown.precision, 1.0);
  EXPECT_DOUBLE_EQ(*result.merge_rate, 0.2);
  EXPECT_DOUBLE_EQ(*result.split_rate, 0.0);
}

TEST(ObjectMetric, SeesAChairSplitInTwo) {
  std::vector<EstimatedObject> nodes = PerfectObjects();
  nodes.push_back(nodes[2]);
  nodes.back().position_map.x() += 0.2;
  const ObjectResult result = ScoreObjects(nodes);
  EXPECT_DOUBLE_EQ(*result.unknown.found_ratio, 1.0);
  EXPECT_DOUBLE_EQ(*result.unknown.precision, 0.75);
  EXPECT_DOUBLE_EQ(*result.split_rate, 0.2);
}

TEST(ObjectMetric, NeitherAsksForNorPunishesWhatWasHardlySeen) {
  std::vector<TrueObject> truth = ObjectTruth();
  truth[2].observed = 0.1;
  std::vector<EstimatedObject> nodes = PerfectObjects();
  EXPECT_DOUBLE_EQ(*EvaluateObjects(nodes, truth, {}).unknown.precision, 1.0);
  nodes.erase(nodes.begin() + 2);
  EXPECT_DOUBLE_EQ(*EvaluateObjects(nodes, truth, {}).unknown.found_ratio, 1.0);
}

TEST(ObjectMetric, TakesACarriedObjectWhereItStoodBeforeOrAfter) {
  std::vector<TrueObject> truth = ObjectTruth();
  truth[2].later_map_T_object = {StandingAt(9, 9)};
  std::vector<EstimatedObject> nodes = PerfectObjects();
  nodes[2].position_map = {9, 9, 0.4};
  EXPECT_NEAR(*EvaluateObjects(nodes, truth, {}).unknown.mean_error_m, 0.0, 1e-12);
  // One node for each is no mistake either.
  nodes.push_back(PerfectObjects()[2]);
  EXPECT_DOUBLE_EQ(*EvaluateObjects(nodes, truth, {}).unknown.f1, 1.0);
}

TEST(ObjectMetric, LeavesKnownShapesEmptyWhenNoModelWasFitted) {
  std::vector<EstimatedObject> nodes = PerfectObjects();
  for (EstimatedObject& node : nodes) node.map_T_model.reset();
  const ObjectResult result = ScoreObjects(nodes);
  EXPECT_FALSE(result.known.found_ratio.has_value());
  EXPECT_DOUBLE_EQ(*result.unknown.f1, 1.0);
  EXPECT_FALSE(ScoreObjects({}).unknown.found_ratio.has_value());
}

}  // namespace
}  // namespace dsg::evaluation
