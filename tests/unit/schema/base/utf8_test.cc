// SPDX-License-Identifier: Apache-2.0
// Every code point comes back, and nothing else is taken for text.
#include "schema/base/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace dsg {
namespace {

TEST(Utf8, GivesEveryCodePointBack) {
  size_t count = 0;
  for (char32_t code = 1; code <= 0x10FFFF; ++code) {
    if (code >= 0xD800 && code <= 0xDFFF) continue;
    std::string text;
    AppendUtf8(code, &text);
    const Utf8Character read = FirstUtf8(text);
    count += read.is_valid && read.code == code && read.size == text.size() ? 1 : 0;
  }
  EXPECT_EQ(count, 0x10FFFFu - 0x800u);
}

TEST(Utf8, FindsWhereMalformedBytesBegin) {
  EXPECT_EQ(FindBadUtf8("Küche"), 6u);
  EXPECT_TRUE(IsUtf8(""));
  // Overlong, surrogate, too large, cut, and a tail that stands alone.
  for (const std::string bad :
       {"\xC0\x80", "\xC1\xBF", "\xE0\x80\x80", "\xF0\x80\x80\x80", "\xED\xA0\x80",
        "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xE5\x8E", "\x80", "\xFF"}) {
    EXPECT_EQ(FindBadUtf8("ab" + bad + "c"), 2u) << bad.size();
    EXPECT_EQ(FirstUtf8(bad).code, 0u);
  }
}

TEST(Utf8, TakesNoLeadThatTextNeverHas) {
  for (int lead = 0xF5; lead <= 0xFF; ++lead) {
    for (int second = 0x80; second <= 0xBF; ++second) {
      const std::string bad = {static_cast<char>(lead), static_cast<char>(second), '\x80', '\x80'};
      EXPECT_EQ(FindBadUtf8(bad), 0u) << lead << " " << second;
    }
  }
}

TEST(Utf8, PassesABrokenCharacterAsOne) {
  EXPECT_EQ(FirstUtf8("\xE5\x8E"
                      "a")
                .size,
            2u);
  EXPECT_EQ(FirstUtf8("\xFF\xFF").size, 1u);
}

TEST(Utf8, CountsAndCutsBetweenCharacters) {
  EXPECT_EQ(CountUtf8("Küche"), 5u);
  EXPECT_EQ(Utf8Prefix("Küche", 2), "K");
  EXPECT_EQ(Utf8Prefix("Küche", 3), "Kü");
  EXPECT_EQ(Utf8Prefix("Küche", 100), "Küche");
  EXPECT_EQ(Utf8Prefix("ü", 1), "");
}

}  // namespace
}  // namespace dsg
