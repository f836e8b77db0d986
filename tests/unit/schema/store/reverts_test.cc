// SPDX-License-Identifier: Apache-2.0
#include "schema/store/reverts.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace dsg {
namespace {

// Revisions 1, 2, ... are of these sessions; what "log" has lost.
std::optional<Undoing> Search(const std::vector<std::string>& sessions) {
  UndoingSearch search([](const std::string& session) { return session == "log"; });
  for (auto revision = std::ssize(sessions); revision > 0; --revision) {
    RevisionInfo info;
    info.revision = revision;
    info.session_id = sessions[static_cast<size_t>(revision - 1)];
    search.Take(info);
  }
  return search.found();
}

std::string Revert(Revision to, const std::string& unique = "a") {
  return RevertSessionName(to) + "-" + unique;
}

TEST(RevertsTest, SessionsOfRevertsNameTheRevisionToWhichTheyGoBack) {
  EXPECT_EQ(RevertedTo(RevertSessionName(12) + "-1764-3-1"), 12);
  EXPECT_EQ(RevertedTo(RevertSessionName(0) + "-x"), 0);
  for (const char* other : {"", "log", "revert-1764-3-1", "revert-to-", "revert-to-x-1",
                            "revert-to--3-1", "revert-to-99999999999999999999-1"}) {
    EXPECT_EQ(RevertedTo(other), std::nullopt) << other;
  }
}

TEST(RevertsTest, FindsWhatOneRevertHasUndone) {
  const auto found = Search({"x", "log", "log", "x", Revert(2), "x"});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->to, 2);
  EXPECT_EQ(found->revert.revision, 5);
  EXPECT_EQ(found->newest_undone, 3);
  EXPECT_EQ(found->before, 4);
  EXPECT_FALSE(found->has_later);
}

TEST(RevertsTest, KnowsThePartsOfALargeRevert) {
  const auto found = Search({"log", "log", Revert(1), Revert(1), Revert(1), "log"});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->revert.revision, 5);
  EXPECT_EQ(found->before, 2);
  EXPECT_TRUE(found->has_later);
}

TEST(RevertsTest, FindsWhatWasToldBetweenThePartsOfARevert) {
  // A revert that meets another writer plans anew, and then undoes what that has written.
  const auto found = Search({"x", "x", Revert(1), "log", Revert(1, "b")});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->newest_undone, 4);
}

TEST(RevertsTest, WhatIsKeptOrBroughtBackIsNotUndone) {
  EXPECT_FALSE(Search({"log", "log", "x"}).has_value());
  EXPECT_FALSE(Search({"log", "x", Revert(1), "log"}).has_value());
  EXPECT_FALSE(Search({"x", "x", Revert(1), "log"}).has_value());
  EXPECT_FALSE(Search({"x", "log", Revert(1), Revert(2)}).has_value());
  EXPECT_FALSE(Search({"x", "log", "log", Revert(1), "x", Revert(3)}).has_value());
}

TEST(RevertsTest, ARevertOfARevertBringsBackNoMoreThanWasThere) {
  const auto found = Search({"x", "log", Revert(1), "x", Revert(4)});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->newest_undone, 2);
  EXPECT_EQ(found->revert.revision, 3);
}

}  // namespace
}  // namespace dsg
