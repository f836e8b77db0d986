// SPDX-License-Identifier: Apache-2.0
#include "query/engine/request.h"

#include <gtest/gtest.h>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

TEST(PageToken, ComesBackWithItsRevisionAndPosition) {
  const std::string position("\0key\xff", 5);
  const auto token = DecodePageToken(EncodePageToken({5, 7, position}, 42), 42);
  ASSERT_TRUE(token.ok()) << token.status();
  EXPECT_EQ(token->revision, 7);
  EXPECT_EQ(token->position, position);
}

TEST(PageToken, RefusesTheTokenOfAnotherQuestion) {
  const auto token = DecodePageToken(EncodePageToken({5, 7, "key"}, 42), 43);
  EXPECT_EQ(ReasonOf(token.status()), Reason::kPageTokenMismatch);
}

TEST(PageToken, RefusesEveryChangeOfOneCharacter) {
  const std::string good = EncodePageToken({5, 7, "position"}, 42);
  for (size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = bad[i] == 'A' ? 'B' : 'A';
    const auto token = DecodePageToken(bad, 42);
    // The last character of base64 may hold bits that say nothing.
    if (token.ok()) {
      EXPECT_EQ(token->position, "position");
    } else {
      EXPECT_EQ(ReasonOf(token.status()), Reason::kPageTokenMismatch);
    }
  }
}

TEST(PageToken, RefusesTextThatIsNoToken) {
  for (const char* text : {"", "x", "not base64!", "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"}) {
    EXPECT_EQ(ReasonOf(DecodePageToken(text, 42).status()), Reason::kPageTokenMismatch) << text;
  }
}

TEST(PageToken, DigestDependsOnMethodAndFields) {
  v1::ListNodesRequest a;
  a.set_map("office");
  v1::ListNodesRequest b = a;
  b.mutable_filter()->set_kind("room");
  EXPECT_EQ(QuestionDigest("ListNodes", a), QuestionDigest("ListNodes", a));
  EXPECT_NE(QuestionDigest("ListNodes", a), QuestionDigest("ListNodes", b));
  EXPECT_NE(QuestionDigest("ListNodes", a), QuestionDigest("ListEdges", a));
}

TEST(PageToken, WordsKeepTheirOrderAndValue) {
  std::string position;
  AppendWord(0x0102030405060708ull, &position);
  AppendWord(~uint64_t{0}, &position);
  std::string_view rest = position;
  uint64_t word = 0;
  ASSERT_TRUE(TakeWord(&rest, &word));
  EXPECT_EQ(word, 0x0102030405060708ull);
  ASSERT_TRUE(TakeWord(&rest, &word));
  EXPECT_EQ(word, ~uint64_t{0});
  EXPECT_FALSE(TakeWord(&rest, &word));
}

}  // namespace
}  // namespace dsg::query
