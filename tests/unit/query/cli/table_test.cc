// SPDX-License-Identifier: Apache-2.0
#include "query/cli/table.h"

#include <gtest/gtest.h>

#include <string>

namespace dsg::cli {
namespace {

TEST(Table, AlignsColumnsToTheirWidestCell) {
  Table table({{"id"}, {"x m", Align::kRight}, {"name"}});
  table.AddRow({"O42", "1.00", "cup"});
  table.AddRow({"R3", "-12.50", "a long name"});
  EXPECT_EQ(table.Render(),
            "id      x m  name\n"
            "O42    1.00  cup\n"
            "R3   -12.50  a long name\n");
  EXPECT_EQ(table.row_count(), 2u);
}

TEST(Table, CountsCodePointsNotBytes) {
  Table table({{"name"}, {"n", Align::kRight}});
  table.AddRow({"Küche", "1"});
  table.AddRow({"hall", "2"});
  EXPECT_EQ(table.Render(), "name   n\nKüche  1\nhall   2\n");
}

TEST(Table, FillsMissingCellsAndLeavesNoBlanksAtTheEnd) {
  Table table({{"a"}, {"b"}, {"c"}});
  table.AddRow({"1"});
  EXPECT_EQ(table.Render(), "a  b  c\n1\n");
}

TEST(Table, ComesInPartsThatNeverBecomeNarrower) {
  Table table({{"id"}, {"n", Align::kRight}});
  table.AddRow({"O1", "100"});
  EXPECT_EQ(table.Take(), "id    n\nO1  100\n");
  EXPECT_EQ(table.row_count(), 0u);
  EXPECT_EQ(table.Take(), "");
  table.AddRow({"O2", "7"});
  EXPECT_EQ(table.Take(), "O2    7\n");
  table.AddRow({"O1000", "7"});
  EXPECT_EQ(table.Take(), "O1000    7\n");
}

TEST(Table, NeverSendsControlCodesToTheTerminal) {
  Table table({{"name"}});
  table.AddRow({"a\x1b[31mb\nc"});
  EXPECT_EQ(table.Render(), "name\na?[31mb?c\n");
}

TEST(Table, ShowsMarksThatTurnTheDirectionOfWriting) {
  Table table({{"name"}, {"n", Align::kRight}});
  table.AddRow({"a\u202eb", "1"});
  EXPECT_EQ(table.Render(), "name      n\na\\u202eb  1\n");
}

TEST(Table, FixedHasNoMinusZero) {
  EXPECT_EQ(Fixed(-0.001, 2), "0.00");
  EXPECT_EQ(Fixed(-0.01, 2), "-0.01");
  EXPECT_EQ(Fixed(-0.4, 0), "0");
  EXPECT_EQ(Fixed(3.14159, 3), "3.142");
}

TEST(Table, FieldsWithoutAValueAreLeftOut) {
  EXPECT_EQ(RenderFields({{"id", "O42"}, {"a longer name", ""}, {"kind", "object"}}),
            "id    O42\nkind  object\n");
}

}  // namespace
}  // namespace dsg::cli
