// SPDX-License-Identifier: Apache-2.0
#include "query/cli/csv.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <string>

namespace dsg::cli {
namespace {

std::string RecordOf(const std::vector<std::string>& cells) {
  std::string text;
  AppendCsvRecord(cells, &text);
  return text;
}

TEST(Csv, QuotesOnlyWhatNeedsIt) {
  EXPECT_EQ(RecordOf({"a", "", "b c"}), "a,,b c\r\n");
  EXPECT_EQ(RecordOf({" a", "b ", "\t", "c"}), "\" a\",\"b \",\"\t\",c\r\n");
  EXPECT_EQ(RecordOf({"a,b", "say \"hi\"", "two\nlines", "\r"}),
            "\"a,b\",\"say \"\"hi\"\"\",\"two\nlines\",\"\r\"\r\n");
}

TEST(Csv, NumbersReadBackAsTheSame) {
  EXPECT_EQ(ExactNumber(0.1), "0.1");
  EXPECT_EQ(ExactNumber(-3.0), "-3");
  for (const double number : {1.0 / 3.0, 1e-300, -123456789.123456789, 5e300,
                              std::numeric_limits<double>::denorm_min()}) {
    EXPECT_EQ(std::strtod(ExactNumber(number).c_str(), nullptr), number);
  }
}

}  // namespace
}  // namespace dsg::cli
