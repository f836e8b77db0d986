// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "query/engine/search/vocabulary.h"
#include "query/engine/search/words.h"

namespace dsg::query {
namespace {

TEST(ColorName, IsWhatPeopleCallTheColor) {
  const std::map<std::string, Color> examples = {
      {"red", {200, 20, 20, 255}},     {"orange", {255, 140, 0, 255}},
      {"yellow", {250, 230, 30, 255}}, {"green", {30, 160, 40, 255}},
      {"cyan", {0, 200, 220, 255}},    {"blue", {30, 60, 200, 255}},
      {"purple", {130, 30, 180, 255}}, {"pink", {255, 150, 180, 255}},
      {"brown", {120, 70, 30, 255}},   {"black", {15, 15, 20, 255}},
      {"grey", {128, 128, 128, 255}},  {"white", {245, 245, 240, 255}}};
  for (const auto& [name, color] : examples) EXPECT_EQ(NameOfColor(color), name);
  EXPECT_EQ(examples.size(), ColorNames().size());
}

TEST(ColorName, EveryColorHasOne) {
  const std::set<std::string> names(ColorNames().begin(), ColorNames().end());
  for (int red = 0; red < 256; red += 15) {
    for (int green = 0; green < 256; green += 15) {
      for (int blue = 0; blue < 256; blue += 15) {
        const Color color{static_cast<uint8_t>(red), static_cast<uint8_t>(green),
                          static_cast<uint8_t>(blue), 255};
        EXPECT_TRUE(names.contains(std::string(NameOfColor(color))));
      }
    }
  }
}

TEST(ColorName, KnowsOtherSpellings) {
  EXPECT_EQ(CanonicalColor("Gray"), "grey");
  EXPECT_EQ(CanonicalColor("VIOLET"), "purple");
  EXPECT_EQ(CanonicalColor("reddish"), "");
}

TEST(NameMatcher, KnowsStarsAndIgnoresCase) {
  EXPECT_TRUE(NameMatcher("mug*").Matches("Mug 2"));
  EXPECT_TRUE(NameMatcher("*").Matches("anything"));
  EXPECT_TRUE(NameMatcher("*room").Matches("Dining Room"));
  EXPECT_TRUE(NameMatcher("a*b*c").Matches("aXbXbc"));
  EXPECT_FALSE(NameMatcher("a*b*c").Matches("acb"));
  EXPECT_FALSE(NameMatcher("mug").Matches("mugs"));
  EXPECT_TRUE(NameMatcher(std::string(200, '*') + "b").Matches(std::string(2000, 'a') + "b"));
}

TEST(RelationWords, TakeTheLongestPhrase) {
  EXPECT_EQ(FindRelationWord({"on", "top", "of"})->word_count, 3U);
  EXPECT_EQ(FindRelationWord({"on", "table"})->word_count, 1U);
  EXPECT_EQ(FindRelationWord({"Adjacent", "TO", "x"})->relation, "ADJACENT");
  EXPECT_FALSE(FindRelationWord({"next", "door"}).has_value());
  // Every relation of the model can be said by its own name.
  for (const std::string& relation : ModelRelations()) {
    const auto found = FindRelationWord({relation});
    ASSERT_TRUE(found.has_value()) << relation;
    EXPECT_EQ(found->relation, relation);
    EXPECT_FALSE(found->reversed);
  }
}

TEST(Vocabulary, MakesSingulars) {
  EXPECT_EQ(SingularsOf("cups").front(), "cup");
  const auto benches = SingularsOf("benches");
  EXPECT_NE(std::find(benches.begin(), benches.end(), "bench"), benches.end());
  EXPECT_EQ(SingularsOf("knives").back(), "knife");
  EXPECT_TRUE(SingularsOf("cup").empty());
}

}  // namespace
}  // namespace dsg::query
