// SPDX-License-Identifier: Apache-2.0
// One list in all formats: what is shown, what is exact, and that it goes out while it is read.
#include "query/cli/list_writer.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "dsg/v1/query_service.pb.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

using Json = nlohmann::json;
using test::ListText;
using test::Monotonic;

TimeText UnixTimes() {
  MapSpec map;
  map.clock = Clock::kUnix;
  return TimeText(map);
}

std::vector<ListColumn> AllTypes() {
  return {{"name"},
          {"count", CellType::kCount},
          {"size m", CellType::kReal, 1, "-"},
          {"at", CellType::kTime},
          {"lasted", CellType::kDuration},
          {"held", CellType::kSpan},
          {"in", CellType::kNode},
          {"date", CellType::kDate}};
}

v1::ListNodesResponse PageOf(int count) {
  v1::ListNodesResponse page;
  for (int i = 0; i < count; ++i) page.add_nodes()->set_id("O" + std::to_string(i));
  return page;
}

// A row with a value in each cell, then one without any.
absl::Status AddRows(ListWriter* list) {
  const v1::ListNodesResponse page = PageOf(2);
  return list->Add(page, page.nodes(), [](const v1::Node& node) {
    if (node.id() == "O1") return Row(8);
    return Row{"a, b",
               int64_t{7},
               0.25,
               kNsPerSecond,
               2 * kNsPerSecond,
               Interval{kNsPerSecond, kTimeMax},
               NodeCell{"R1", "hall"},
               kNsPerSecond};
  });
}

TEST(ListWriter, TablesRoundAndCsvIsExact) {
  EXPECT_EQ(ListText(AllTypes(), Monotonic(), AddRows, "end\n"),
            "name  count  size m   at  lasted  held         in\n"
            "a, b      7     0.2  +1s      2s  +1s to open  hall (R1)\n"
            "                  -\n"
            "end\n");
  EXPECT_EQ(ListText(AllTypes(), Monotonic(), AddRows, "end\n", ListFormat::kCsv),
            "name,count,size_m,at_ns,lasted_ns,held_from_ns,held_to_ns,in_id,in_name\r\n"
            "\"a, b\",7,0.25,1000000000,2000000000,1000000000,,R1,hall\r\n"
            ",,,,,,,,\r\n");
}

TEST(ListWriter, DatesAreOfMapsThatHaveThem) {
  const std::string table = ListText(AllTypes(), UnixTimes(), AddRows);
  EXPECT_NE(table.find("hall (R1)  1970-01-01T00:00:01Z\n"), std::string::npos) << table;
  const std::string csv = ListText(AllTypes(), UnixTimes(), AddRows, "", ListFormat::kCsv);
  EXPECT_EQ(csv.substr(0, csv.find('\r')),
            "name,count,size_m,at_ns,at_utc,lasted_ns,held_from_ns,held_from_utc,held_to_ns,"
            "held_to_utc,in_id,in_name");
  EXPECT_NE(csv.find(",1000000000,1970-01-01T00:00:01Z,,,R1,hall\r\n"), std::string::npos) << csv;
}

TEST(ListWriter, JsonLinesHaveAnEntryEach) {
  std::istringstream lines(ListText(AllTypes(), Monotonic(), AddRows, "", ListFormat::kJsonLines));
  std::string line;
  for (const char* id : {"O0", "O1"}) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_EQ(Json::parse(line)["id"], id);
  }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST(ListWriter, CsvOfAnEmptyListHasItsHeadings) {
  const auto none = [](ListWriter* list) {
    const v1::ListNodesResponse page;
    return list->Add(page, page.nodes(), [](const v1::Node&) { return Row(); });
  };
  EXPECT_EQ(ListText({{"id"}}, Monotonic(), none, "", ListFormat::kCsv), "id\r\n");
}

TEST(ListWriter, LongTablesGoOutWhileTheyAreRead) {
  std::ostringstream out;
  const TimeText times = Monotonic();
  ListWriter list({}, times, "nodes", {{"id"}}, &out);
  const v1::ListNodesResponse page = PageOf(700);
  const auto row = [](const v1::Node& node) { return Row{node.id()}; };
  ASSERT_TRUE(list.Add(page, page.nodes(), row).ok());
  EXPECT_EQ(out.str(), "");
  ASSERT_TRUE(list.Add(page, page.nodes(), row).ok());
  EXPECT_NE(out.str().find("\nO299\n"), std::string::npos);
  ASSERT_TRUE(list.End("end\n").ok());
  EXPECT_EQ(list.count(), 1400);
  // Headings, rows and the end, each once.
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1402);
}

TEST(ListWriter, SaysThatNothingMoreCanBeWritten) {
  std::ostringstream out;
  const TimeText times = Monotonic();
  ListWriter list({.format = ListFormat::kCsv}, times, "nodes", {{"id"}}, &out);
  out.setstate(std::ios::badbit);
  const v1::ListNodesResponse page = PageOf(1);
  const auto row = [](const v1::Node& node) { return Row{node.id()}; };
  EXPECT_TRUE(absl::IsUnavailable(list.Add(page, page.nodes(), row)));
  EXPECT_TRUE(absl::IsUnavailable(list.End("")));
}

}  // namespace
}  // namespace dsg::cli
