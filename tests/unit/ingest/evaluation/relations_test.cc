// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/relations.h"

#include <gtest/gtest.h>

#include <utility>

namespace dsg::evaluation {
namespace {

TrueObject Thing(double x, double y, double base_m, const Eigen::Vector3d& size) {
  TrueObject object;
  object.class_name = "thing";
  object.map_T_object.position = {x, y, base_m + 0.5 * size.z()};
  object.size = size;
  return object;
}

// A table with a cup on it; a chair 0.3 m beside the table; a picture on a wall, far away.
enum { kTable, kCup, kChair, kPicture };
std::vector<TrueObject> Things() {
  return {Thing(0, 0, 0, {1, 1, 0.7}), Thing(0.2, 0.2, 0.7, {0.1, 0.1, 0.1}),
          Thing(1.05, 0, 0, {0.5, 0.5, 0.9}), Thing(5, 5, 1.4, {0.8, 0.03, 0.6})};
}

std::vector<EstimatedRelation> WhatIsSo() {
  return {{relations::kOn, kCup, kTable},           {relations::kNear, kTable, kCup},
          {relations::kNear, kChair, kTable},       {relations::kLargerThan, kTable, kCup},
          {relations::kLargerThan, kTable, kChair}, {relations::kAttachedTo, kPicture, -1}};
}

std::vector<EstimatedObject> Nodes() {
  std::vector<EstimatedObject> nodes;
  for (const TrueObject& thing : Things()) {
    nodes.push_back({thing.class_name, thing.map_T_object.position});
  }
  return nodes;
}

RelationResult Score(const std::vector<EstimatedRelation>& estimate) {
  return EvaluateRelations(estimate, Nodes(), {0, 1, 2, 3}, Things(), {}, {});
}

TEST(RelationMetric, IsPerfectForTheTruthItself) {
  const RelationResult result = Score(WhatIsSo());
  for (const char* relation :
       {relations::kOn, relations::kNear, relations::kLargerThan, relations::kAttachedTo}) {
    const RelationScore& score = result.at(relation);
    EXPECT_DOUBLE_EQ(score.precision.value_or(-1.0), 1.0) << relation;
    EXPECT_DOUBLE_EQ(score.recall.value_or(-1.0), 1.0) << relation;
  }
  EXPECT_EQ(result.at(relations::kNear).truth_count, 2);
  EXPECT_FALSE(result.at(relations::kIn).precision.has_value());
  EXPECT_FALSE(result.at(relations::kIn).recall.has_value());
}

TEST(RelationMetric, CountsWhatIsWrongAndWhatIsMissing) {
  const RelationResult result = Score({{relations::kOn, kCup, kTable},
                                       {relations::kOn, kTable, kCup},
                                       {relations::kIn, kCup, kTable},
                                       {relations::kNear, kTable, kPicture},
                                       {relations::kLargerThan, kCup, kTable},
                                       {relations::kAttachedTo, kChair, -1}});
  EXPECT_DOUBLE_EQ(*result.at(relations::kOn).precision, 0.5);
  EXPECT_DOUBLE_EQ(*result.at(relations::kOn).recall, 1.0);
  EXPECT_DOUBLE_EQ(*result.at(relations::kIn).precision, 0.0);
  EXPECT_DOUBLE_EQ(*result.at(relations::kNear).precision, 0.0);
  EXPECT_DOUBLE_EQ(*result.at(relations::kNear).recall, 0.0);
  EXPECT_DOUBLE_EQ(*result.at(relations::kLargerThan).precision, 0.0);
  EXPECT_DOUBLE_EQ(*result.at(relations::kAttachedTo).precision, 0.0);
  EXPECT_DOUBLE_EQ(*result.at(relations::kAttachedTo).recall, 0.0);
}

TEST(RelationMetric, TakesEdgesThatHoldBothWaysOnce) {
  const RelationResult result =
      Score({{relations::kNear, kTable, kCup}, {relations::kNear, kCup, kTable}});
  EXPECT_EQ(result.at(relations::kNear).estimate_count, 1);
  EXPECT_DOUBLE_EQ(*result.at(relations::kNear).precision, 1.0);
}

TEST(RelationMetric, DoesNotJudgeWhatNobodyKnows) {
  // The chair is no match of anything, nor a piece of it.
  std::vector<EstimatedObject> nodes = Nodes();
  nodes[kChair].class_name = "stool";
  const RelationResult result =
      EvaluateRelations(WhatIsSo(), nodes, {0, 1, -1, 3}, Things(), {}, {});
  EXPECT_EQ(result.at(relations::kNear).estimate_count, 1);
  EXPECT_EQ(result.at(relations::kNear).truth_count, 2);
  EXPECT_EQ(result.at(relations::kNear).between_found_count, 1);
  EXPECT_DOUBLE_EQ(*result.at(relations::kNear).recall, 0.5);
  EXPECT_DOUBLE_EQ(*result.at(relations::kNear).recall_between_found, 1.0);
}

TEST(RelationMetric, TakesAPieceOfAThingForTheThing) {
  std::vector<EstimatedObject> nodes = Nodes();
  nodes.push_back({"thing", {-0.4, -0.4, 0.35}});
  constexpr int kHalf = 4;
  const RelationResult result =
      EvaluateRelations({{relations::kOn, kCup, kHalf}, {relations::kNear, kTable, kHalf}}, nodes,
                        {0, 1, 2, 3, -1}, Things(), {}, {});
  EXPECT_DOUBLE_EQ(*result.at(relations::kOn).recall, 1.0);
  EXPECT_EQ(result.at(relations::kNear).estimate_count, 0);
}

TEST(RelationMetric, NeitherAsksForNorJudgesWhatWasHardlySeenOrCarriedAbout) {
  std::vector<TrueObject> things = Things();
  things[kCup].later_map_T_object.push_back(things[kChair].map_T_object);
  things[kPicture].observed = 0.1;
  const RelationResult result =
      EvaluateRelations(WhatIsSo(), Nodes(), {0, 1, 2, 3}, things, {}, {});
  EXPECT_EQ(result.at(relations::kOn).truth_count, 0);
  EXPECT_EQ(result.at(relations::kOn).estimate_count, 0);
  EXPECT_EQ(result.at(relations::kNear).truth_count, 1);
  EXPECT_EQ(result.at(relations::kAttachedTo).estimate_count, 0);
}

TEST(RelationMetric, IsEmptyForAMapWithoutRelations) { EXPECT_TRUE(Score({}).empty()); }

}  // namespace
}  // namespace dsg::evaluation
