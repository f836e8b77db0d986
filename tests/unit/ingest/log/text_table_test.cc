// SPDX-License-Identifier: Apache-2.0
// Numbers and lines of text logs. Files as a whole are the business of the readers' tests.
#include "ingest/log/text_table.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

const std::string kFile = "log.txt";
const LinePosition kAt{kFile, 7};

TEST(ParseSeconds, IsExactToTheNanosecond) {
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "0.01"), 10'000'000);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "333.21"), 333'210'000'000);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "1403715524.907143168"), 1'403'715'524'907'143'168);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "-0.5"), -500'000'000);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "1.25e+02"), 125'000'000'000);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "125e-3"), 125'000'000);
}

TEST(ParseSeconds, TakesOtherUnits) {
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "1600000000000.5", -3), 1'600'000'000'000'500'000);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "7", -6), 7'000);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "1403715524907143168", -9), 1'403'715'524'907'143'168);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "1.5", -9), 2);
  EXPECT_FALSE(ParseSeconds(kAt, "Time", "9300000000000", -3).ok());
}

TEST(ParseSeconds, RoundsDigitsBeyondTheNinthDecimal) {
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "0.1234567894"), 123'456'789);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "0.1234567895"), 123'456'790);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "0.00000000004"), 0);
  EXPECT_EQ(*ParseSeconds(kAt, "Time", "0.30000000000000004440892098500626"), 300'000'000);
}

TEST(ParseSeconds, RefusesWhatIsNoNumberOrDoesNotFit) {
  for (const char* text : {"", "-", ".", "1.2.3", "1s", "nan", "inf", "1e", "1e400", "1e12",
                           "99999999999999999999999999999999999999999"}) {
    EXPECT_EQ(ReasonOf(ParseSeconds(kAt, "Time", text).status()), Reason::kFileMalformed) << text;
  }
}

TEST(ParseInteger, TakesAnyNotationOfAnInteger) {
  EXPECT_EQ(*ParseInteger(kAt, "frame", "780"), 780);
  EXPECT_EQ(*ParseInteger(kAt, "frame", "7.8000000e+02"), 780);
  EXPECT_EQ(*ParseInteger(kAt, "frame", "1.0"), 1);
  EXPECT_EQ(*ParseInteger(kAt, "stamp", "1403715524907143168"), 1'403'715'524'907'143'168);
  EXPECT_FALSE(ParseInteger(kAt, "frame", "1.5").ok());
  EXPECT_FALSE(ParseInteger(kAt, "frame", "1e300").ok());
}

TEST(ParsePersonName, PrintsIntegersWithoutDecimals) {
  EXPECT_EQ(*ParsePersonName(kAt, "1.0"), "1");
  EXPECT_EQ(*ParsePersonName(kAt, "3.6000000e+02"), "360");
  EXPECT_FALSE(ParsePersonName(kAt, "-1").ok());
  EXPECT_FALSE(ParsePersonName(kAt, "1.5").ok());
}

TEST(ParseCoordinate, RefusesNotFiniteAndAbsurdNumbers) {
  EXPECT_EQ(*ParseCoordinate(kAt, "x", "-2.5"), -2.5);
  for (const char* text : {"nan", "inf", "-inf", "1e400", "2000001", "-1e7", "1,5", "abc", ""}) {
    const absl::Status status = ParseCoordinate(kAt, "x", text).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << text;
    EXPECT_EQ(MetadataOf(status)["line"], "7");
    EXPECT_EQ(MetadataOf(status)["field"], "x");
  }
}

TEST(LinePosition, QuotesBinaryGarbageSafely) {
  const absl::Status status =
      kAt.FieldError("x", std::string_view("\x1b[2J\0\n", 6), "a number is due");
  EXPECT_EQ(status.message(), "log.txt:7: field x is \"\\x1b[2J\\x00\\n\"; a number is due");
}

TEST(Normalize, MakesQuaternionsUnitAndRefusesOthers) {
  const auto close = Normalize(kAt, Eigen::Quaterniond(1.0005, 0, 0, 0));
  ASSERT_TRUE(close.ok());
  EXPECT_DOUBLE_EQ(close->norm(), 1.0);
  EXPECT_FALSE(Normalize(kAt, Eigen::Quaterniond(1.01, 0, 0, 0)).ok());
  EXPECT_FALSE(Normalize(kAt, Eigen::Quaterniond(0, 0, 0, 0)).ok());
}

TEST(LineReader, CountsBlankLinesAndKnowsACutLastLine) {
  LineReader lines("a\r\n\n  \nb");
  TextLine line;
  ASSERT_TRUE(lines.Next(&line));
  EXPECT_EQ(line.text, "a");
  EXPECT_TRUE(line.has_line_end);
  ASSERT_TRUE(lines.Next(&line));
  EXPECT_EQ(line.text, "b");
  EXPECT_EQ(line.number, 4);
  EXPECT_FALSE(line.has_line_end);
  EXPECT_FALSE(lines.Next(&line));
}

}  // namespace
}  // namespace dsg::ingest
