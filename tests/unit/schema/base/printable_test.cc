// SPDX-License-Identifier: Apache-2.0
#include "schema/base/printable.h"

#include <gtest/gtest.h>

namespace dsg {
namespace {

TEST(Printable, ShowsControlsOfOneCharacterAsOne) {
  // U+009B is the form of ESC [ of eight bits.
  EXPECT_EQ(Printable("a\u009b31mb\x7f"), "a?31mb?");
  EXPECT_EQ(Printable("Küche \u4e2d"), "Küche \u4e2d");
  EXPECT_EQ(Printable("\xff"
                      "caf\xe9"),
            "\\xffcaf\\xe9");
}

TEST(Printable, ShowsMarksThatTurnTheDirectionOfWriting) {
  EXPECT_EQ(Printable("cup\u202etxt"), "cup\\u202etxt");
  for (const char* mark : {"\u202a", "\u202b", "\u202c", "\u202d", "\u202e", "\u2066", "\u2067",
                           "\u2068", "\u2069", "\u200e", "\u200f", "\u061c"}) {
    const std::string shown = Printable(mark);
    EXPECT_EQ(shown.size(), 6U) << shown;
    EXPECT_EQ(shown.substr(0, 2), "\\u");
  }
  // Letters that are written from the right, and joiners of letters, stay.
  EXPECT_EQ(Printable("\u05d0\u200d"), "\u05d0\u200d");
}

TEST(Printable, MessagesHaveAnEnd) {
  EXPECT_EQ(PrintableMessage("a\nb"), "a?b");
  EXPECT_EQ(PrintableMessage(std::string(100'000, 'x')), std::string(4000, 'x') + "...");
}

}  // namespace
}  // namespace dsg
