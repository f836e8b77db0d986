// SPDX-License-Identifier: Apache-2.0
#include "schema/files/yaml_text.h"

#include <gtest/gtest.h>

#include <string>

namespace dsg::test {
namespace {

TEST(YamlText, OneDocumentHasNoSecond) {
  EXPECT_EQ(FindSecondYamlDocument(""), std::nullopt);
  EXPECT_EQ(FindSecondYamlDocument("a: 1\nb: 2\n"), std::nullopt);
  EXPECT_EQ(FindSecondYamlDocument("%YAML 1.2\n---\na: 1\n...\n# the end\n"), std::nullopt);
  EXPECT_EQ(FindSecondYamlDocument("a: ---x\n"), std::nullopt);
}

TEST(YamlText, ASecondDocumentIsFoundAtItsLine) {
  EXPECT_EQ(FindSecondYamlDocument("a: 1\n---\nb: 2\n"), 1);
  EXPECT_EQ(FindSecondYamlDocument("---\na: 1\n\n---\nb: 2\n"), 3);
  EXPECT_EQ(FindSecondYamlDocument("a: 1\n...\nb: 2\n"), 2);
}

TEST(YamlText, DepthIsSeenInBracketsAndInDashes) {
  EXPECT_FALSE(YamlNestsTooDeep("a: [1, [2, {b: 3}]]\n"));
  EXPECT_FALSE(YamlNestsTooDeep("- - - x\n"));
  EXPECT_TRUE(YamlNestsTooDeep(std::string(100'000, '[')));
  std::string dashes;
  for (int i = 0; i < 100; ++i) dashes += "- ";
  EXPECT_TRUE(YamlNestsTooDeep(dashes + "x"));
}

}  // namespace
}  // namespace dsg::test
