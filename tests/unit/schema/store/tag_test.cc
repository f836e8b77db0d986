// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "absl/strings/match.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg {
namespace {

using test::OrDie;
using test::TestMap;

class Tags : public test::OnEveryBackend {
 protected:
  Tags() {
    for (int sequence = 1; sequence <= 5; ++sequence) {
      OrDie(map_.writer().Commit(test::DeltaOfStream({}, sequence)));
    }
  }
  TestMap map_{GetParam()};
};
DSG_ON_EVERY_BACKEND(Tags);

TEST_P(Tags, AreListedByName) {
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

TEST_P(Tags, MoveWhenSetAgain) {
  OrDie(map_.writer().SetTag("good", 3, "a"));
  OrDie(map_.writer().SetTag("good", 5, ""));
  const auto tags = OrDie(map_.reader().Tags());
  ASSERT_EQ(tags.size(), 1u);
  EXPECT_EQ(tags[0].revision, 5);
  EXPECT_EQ(tags[0].note, "");
}

TEST_P(Tags, RefuseNamesThatAreRevisionsOrPaths) {
  for (const char* name : {"", "12", "a b", "../a", "n\nn", "\xc3\xa9"}) {
    EXPECT_EQ(ReasonOf(map_.writer().SetTag(name, 1, "").status()), Reason::kFieldInvalid) << name;
  }
  EXPECT_EQ(ReasonOf(map_.writer().SetTag(std::string(65, 'a'), 1, "").status()),
            Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(map_.writer().SetTag("a", 1, std::string(1001, 'a')).status()),
            Reason::kFieldInvalid);
}

TEST_P(Tags, RefuseRevisionsThatAreNotThere) {
  EXPECT_EQ(ReasonOf(map_.writer().SetTag("a", 6, "").status()), Reason::kRevisionInFuture);
  EXPECT_EQ(ReasonOf(map_.writer().SetTag("a", -1, "").status()), Reason::kRevisionInFuture);
}

TEST_P(Tags, ThatAreNotThereAreNamedBesideThoseThatAre) {
  OrDie(map_.writer().SetTag("good", 3, ""));
  const auto refused = map_.writer().RemoveTag("bad");
  EXPECT_EQ(ReasonOf(refused), Reason::kTagUnknown);
  EXPECT_TRUE(absl::StrContains(refused.message(), "it has good")) << refused;
  OrDie(map_.writer().RemoveTag("good"));
  EXPECT_TRUE(OrDie(map_.reader().Tags()).empty());
}

TEST_P(Tags, RefuseNotesThatAreNoText) {
  for (const std::string& note : {std::string("a\0b", 3), std::string("\xff")}) {
    EXPECT_EQ(ReasonOf(map_.writer().SetTag("a", 1, note).status()), Reason::kFieldInvalid);
  }
  EXPECT_EQ(ReasonOf(map_.writer().SetTag(std::string("a\0b", 3), 1, "").status()),
            Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg
