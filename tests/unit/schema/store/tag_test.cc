// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/map_file.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg {
namespace {

using test::OrDie;
using test::TestMap;

class Tags : public ::testing::Test {
 protected:
  Tags() {
    for (int sequence = 1; sequence <= 5; ++sequence) {
      OrDie(map_.writer().Commit(test::DeltaOfStream({}, sequence)));
    }
  }
  TestMap map_;
};

TEST_F(Tags, AreListedByName) {
  OrDie(map_.writer().SetTag("v1.0", 3, "before the move"));
  OrDie(map_.writer().SetTag("empty", 0, ""));
  const auto tags = OrDie(map_.reader().Tags());
  ASSERT_EQ(tags.size(), 2u);
  EXPECT_EQ(tags[0].name, "empty");
  EXPECT_EQ(tags[1].name, "v1.0");
  EXPECT_EQ(tags[1].revision, 3);
  EXPECT_EQ(tags[1].note, "before the move");
  EXPECT_GT(tags[1].created_ns, 0);
}

TEST_F(Tags, MoveWhenSetAgain) {
  OrDie(map_.writer().SetTag("good", 3, "a"));
  OrDie(map_.writer().SetTag("good", 5, ""));
  const auto tags = OrDie(map_.reader().Tags());
  ASSERT_EQ(tags.size(), 1u);
  EXPECT_EQ(tags[0].revision, 5);
  EXPECT_EQ(tags[0].note, "");
}

TEST_F(Tags, RefuseNamesThatAreRevisionsOrPaths) {
  for (const char* name : {"", "12", "a b", "../a", "n\nn", "\xc3\xa9"}) {
    EXPECT_EQ(ReasonOf(map_.writer().SetTag(name, 1, "").status()), Reason::kFieldInvalid) << name;
  }
  EXPECT_EQ(ReasonOf(map_.writer().SetTag(std::string(65, 'a'), 1, "").status()),
            Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(map_.writer().SetTag("a", 1, std::string(1001, 'a')).status()),
            Reason::kFieldInvalid);
}

TEST_F(Tags, RefuseRevisionsThatAreNotThere) {
  EXPECT_EQ(ReasonOf(map_.writer().SetTag("a", 6, "").status()), Reason::kRevisionInFuture);
  EXPECT_EQ(ReasonOf(map_.writer().SetTag("a", -1, "").status()), Reason::kRevisionInFuture);
}

TEST_F(Tags, ThatAreNotThereAreNamedBesideThoseThatAre) {
  OrDie(map_.writer().SetTag("good", 3, ""));
  const auto refused = map_.writer().RemoveTag("bad");
  EXPECT_EQ(ReasonOf(refused), Reason::kTagUnknown);
  EXPECT_TRUE(absl::StrContains(refused.message(), "it has good")) << refused;
  OrDie(map_.writer().RemoveTag("good"));
  EXPECT_TRUE(OrDie(map_.reader().Tags()).empty());
}

TEST_F(Tags, RefuseNotesThatAreNoText) {
  for (const std::string& note : {std::string("a\0b", 3), std::string("\xff")}) {
    EXPECT_EQ(ReasonOf(map_.writer().SetTag("a", 1, note).status()), Reason::kFieldInvalid);
  }
  EXPECT_EQ(ReasonOf(map_.writer().SetTag(std::string("a\0b", 3), 1, "").status()),
            Reason::kFieldInvalid);
}

// Written past the map's writer: each of its commits waits for the disk.
void AddTags(const std::string& folder, int count, int note_bytes) {
  const auto db = OrDie(sqlite::OpenMapFile(folder, test::kMap, sqlite::Database::Mode::kWrite));
  OrDie(db->Execute(absl::StrCat("WITH RECURSIVE i(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM i"
                                 " WHERE n < ",
                                 count,
                                 ") INSERT INTO tag (name, revision, created_ns, note)"
                                 " SELECT 't' || n, 1, 0, printf('%.*c', ",
                                 note_bytes, ", 'x') FROM i")
                        .c_str()));
}

TEST_F(Tags, AreOfABoundedNumber) {
  AddTags(map_.folder(), 9'999, 1);
  OrDie(map_.writer().SetTag("last", 1, ""));
  const auto refused = map_.writer().SetTag("more", 1, "").status();
  EXPECT_EQ(ReasonOf(refused), Reason::kQuotaExceeded);
  EXPECT_TRUE(absl::StrContains(refused.message(), "at most 10000 tags")) << refused;
  // One that is there may move, and errors do not list them all.
  OrDie(map_.writer().SetTag("last", 2, ""));
  const auto unknown = map_.writer().RemoveTag("none");
  EXPECT_TRUE(absl::StrContains(unknown.message(), "and 9980 more")) << unknown;
  EXPECT_LT(unknown.message().size(), 300U);
  OrDie(map_.writer().RemoveTag("t1"));
  OrDie(map_.writer().SetTag("more", 1, ""));
}

TEST_F(Tags, HaveNotesOfABoundedLengthAltogether) {
  AddTags(map_.folder(), 2'097, 1'000);
  OrDie(map_.writer().SetTag("a", 1, std::string(152, 'a')));
  const auto refused = map_.writer().SetTag("b", 1, "b").status();
  EXPECT_EQ(ReasonOf(refused), Reason::kQuotaExceeded);
  EXPECT_TRUE(absl::StrContains(refused.message(), "bytes of notes")) << refused;
  OrDie(map_.writer().SetTag("b", 1, ""));
}

}  // namespace
}  // namespace dsg
