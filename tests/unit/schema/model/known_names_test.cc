// SPDX-License-Identifier: Apache-2.0
// Stores write kinds and names of attributes as numbers: none may move.
#include "schema/model/known_names.h"

#include <gtest/gtest.h>

#include <iterator>
#include <set>

namespace dsg {
namespace {

TEST(KnownNames, KindsKeepTheirPlaces) {
  ASSERT_EQ(std::size(kinds::kAll), 9u);
  EXPECT_EQ(kinds::Find("object"), &kinds::kAll[0]);
  EXPECT_EQ(kinds::Find("place"), &kinds::kAll[3]);
  EXPECT_EQ(kinds::Find("building"), &kinds::kAll[6]);
  EXPECT_EQ(kinds::Find(kAgentPoseKind), nullptr);
  EXPECT_EQ(kinds::Find("animal"), &kinds::kAll[8]);
  EXPECT_TRUE(IsAgentKind("human"));
  EXPECT_TRUE(IsAgentKind("vehicle"));
  EXPECT_FALSE(IsAgentKind("room"));
  EXPECT_EQ(LayerOfKind("structure"), layers::kStructures);
  EXPECT_FALSE(LayerOfKind("lamp").has_value());
}

TEST(KnownNames, AttributesKeepTheirNumbers) {
  EXPECT_EQ(attributes::NumberOf("spark_dsg"), 0);
  EXPECT_EQ(attributes::NumberOf("bounding_box"), 34);
  EXPECT_EQ(attributes::NumberOf("orientation"), 56);
  EXPECT_EQ(attributes::NumberOf("node_id"), 96);
  EXPECT_EQ(attributes::NameOf(97), "");
  EXPECT_FALSE(attributes::NumberOf("of my own").has_value());
  std::set<std::string_view> names;
  for (uint8_t i = 0; !attributes::NameOf(i).empty(); ++i) {
    EXPECT_TRUE(names.insert(attributes::NameOf(i)).second);
  }
}

TEST(KnownNames, RelationsAreFoundByName) {
  for (const relations::Relation& relation : relations::kAll) {
    EXPECT_EQ(relations::Find(relation.name), &relation);
  }
  EXPECT_EQ(relations::Find("NEAR")->ends, relations::Ends::kEither);
  EXPECT_EQ(relations::Find("near"), nullptr);
}

}  // namespace
}  // namespace dsg
