// SPDX-License-Identifier: Apache-2.0
#include "schema/model/ids.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg {
namespace {

TEST(NodeId, HasTheBitsOfASparkDsgSymbol) {
  EXPECT_EQ(NodeId('O', 1).value, 5692549928996306945u);
  EXPECT_EQ(NodeId('p', 0).value, 8070450532247928832u);
}

TEST(NodeId, ReadsBackWhatItPrints) {
  for (const NodeId id : {NodeId('H', 12), NodeId('a', 0), NodeId('Z', NodeId::kIndexMax)}) {
    EXPECT_EQ(*ParseNodeId(ToString(id)), id);
  }
  EXPECT_EQ(ToString(NodeId()), "");
}

TEST(NodeId, RefusesWhatIsNotALetterAndANumber) {
  for (const char* text : {"", "O", "12", "O-1", "O1x", "OO1", "O 1", "#1", "O72057594037927936",
                           "O99999999999999999999"}) {
    EXPECT_EQ(ReasonOf(ParseNodeId(text).status()), Reason::kNodeIdInvalid) << text;
  }
}

TEST(MapName, IsSafeAsAFolderName) {
  for (const char* good : {"office", "a", "0", "map-2_b"}) EXPECT_TRUE(IsValidMapName(good));
  for (const char* bad : {"", "../x", "a/b", ".", "A", "-a", "_a", "a b", "a\n", "ä"}) {
    EXPECT_EQ(ReasonOf(CheckMapName(bad)), Reason::kMapNameInvalid) << bad;
  }
  EXPECT_FALSE(IsValidMapName(std::string(65, 'a')));
  EXPECT_FALSE(IsValidMapName(std::string_view("a\0b", 3)));
}

}  // namespace
}  // namespace dsg
