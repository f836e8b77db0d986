// SPDX-License-Identifier: Apache-2.0
#include "schema/base/spelling.h"

#include <gtest/gtest.h>

namespace dsg {
namespace {

TEST(Spelling, CountsInsertionsDeletionsReplacementsAndSwaps) {
  EXPECT_EQ(EditDistance("cup", "cup"), 0);
  EXPECT_EQ(EditDistance("cup", "cpu"), 1);
  EXPECT_EQ(EditDistance("table", "tables"), 1);
  EXPECT_EQ(EditDistance("", "abc"), 3);
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3);
}

TEST(Spelling, ListsTheNearestFirst) {
  const std::vector<std::string> known = {"table", "cable", "stable", "chair", "Tablet"};
  EXPECT_EQ(NearInSpelling("tabel", known), (std::vector<std::string>{"table"}));
  EXPECT_EQ(NearInSpelling("TABLE", known).front(), "table");
  EXPECT_EQ(NearHint("tabel", known), "; near in spelling: \"table\"");
  EXPECT_EQ(NearHint("zzzzz", known), "");
  EXPECT_EQ(SpellingHint("zzzzz", {"b", "a"}), "; known: \"a\", \"b\"");
  std::vector<std::string> many;
  for (char c = 'a'; c <= 'm'; ++c) many.emplace_back(3, c);
  const std::string hint = SpellingHint("zzzzz", many);
  EXPECT_EQ(hint.substr(hint.find("\"jjj\"")), "\"jjj\" and 3 more") << hint;
}

}  // namespace
}  // namespace dsg
