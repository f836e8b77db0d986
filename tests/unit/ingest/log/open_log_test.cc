// SPDX-License-Identifier: Apache-2.0
// How a log's format is told, and what is the identity of a log.
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

std::string FormatOrError(const TempFolder& folder, const std::string& bytes) {
  const absl::StatusOr<WholeLog> log = ReadAll(folder.Write("log.bin", bytes));
  return log.ok() ? log->info.format : std::string(log.status().message());
}

TEST(OpenLog, TellsFormatsByContentNotByName) {
  const TempFolder folder;
  EXPECT_EQ(FormatOrError(folder, "0 1 0 0 0 0 0 0\n"), "obsmat");
  EXPECT_EQ(FormatOrError(folder, "  0.0\t1.0\t2.5\t3\r\n"), "trajnet");
  EXPECT_EQ(FormatOrError(folder, "{\"track\": {\"f\": 0, \"p\": 1, \"x\": 0, \"y\": 0}}\n"),
            "trajnet-ndjson");
  EXPECT_EQ(FormatOrError(folder, "Time,x,y,z,ag_id,data_label,tracklet_id\n0,0,0,0,H,a,1\n"),
            "thor");
  EXPECT_EQ(FormatOrError(folder, "1403636584263555584,4,1,0,1,0,0,0\n"), "euroc");
  EXPECT_EQ(FormatOrError(folder, "# one\n# two\n0 0 0 0 0 0 0 1\n"), "tum");
  EXPECT_EQ(FormatOrError(folder, "time,id,x,y,z\n0,1,0,0,0\n"), "csv");
  EXPECT_EQ(FormatOrError(folder, "#timestamp [s],x,y,z,qx,qy,qz,qw\n0,1,0,0,0,0,0,1\n"), "csv");
  EXPECT_EQ(
      FormatOrError(folder, "time_ns,agent,kind,x,y,z,qx,qy,qz,qw\n0,a,human,0,0,0,0,0,0,1\n"),
      "dsg-tracks");
}

TEST(OpenLog, ListsTheFormatsWhenNoneFits) {
  const TempFolder folder;
  for (const std::string& bytes :
       {std::string("hello world\n"), std::string("\x7f\x45\x4c\x46\0\0\0\1", 8),
        std::string("1 2\n"), std::string("a,b,c\n"), std::string("\n\n")}) {
    const absl::Status status = ReadAll(folder.Write("log.txt", bytes)).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
    for (const char* part : {"log.txt", "--format", "obsmat", "euroc", "dsg-tracks"}) {
      EXPECT_NE(std::string(status.message()).find(part), std::string::npos) << status;
    }
  }
}

TEST(OpenLog, RefusesMissingEmptyAndForeignPaths) {
  const TempFolder folder;
  EXPECT_EQ(ReadAll(folder.Path("none.txt")).status().code(), absl::StatusCode::kNotFound);
  const absl::Status empty = ReadAll(folder.Write("empty.txt", "")).status();
  EXPECT_EQ(ReasonOf(empty), Reason::kFileMalformed);
  EXPECT_NE(std::string(empty.message()).find("is empty"), std::string::npos);
  const absl::Status bare = ReadAll(folder.Path("")).status();
  EXPECT_EQ(ReasonOf(bare), Reason::kFileMalformed);
  EXPECT_NE(std::string(bare.message()).find("tracks.csv"), std::string::npos);
  EXPECT_EQ(ReasonOf(ReadAll("/dev/null").status()), Reason::kFileMalformed);
}

TEST(OpenLog, RefusesUnknownFormatsAndPeriods) {
  const TempFolder folder;
  const std::string path = folder.Write("log.txt", "0 1 2 3\n");
  LogOptions options;
  options.format = "pcap";
  EXPECT_EQ(ReasonOf(ReadAll(path, options).status()), Reason::kFieldInvalid);
  options = {};
  options.frame_period_ns = 0;
  EXPECT_EQ(ReasonOf(ReadAll(path, options).status()), Reason::kFieldInvalid);
}

TEST(OpenLog, FindsEurocGroundTruthAtEachLevelOfTheFolder) {
  const TempFolder folder;
  folder.Write("run/mav0/state_groundtruth_estimate0/data.csv",
               "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n7,4,1,0,1,0,0,0\n");
  std::string identity;
  for (const char* path : {"run", "run/mav0", "run/mav0/state_groundtruth_estimate0",
                           "run/mav0/state_groundtruth_estimate0/data.csv"}) {
    const absl::StatusOr<WholeLog> log = ReadAll(folder.Path(path));
    ASSERT_TRUE(log.ok()) << path << log.status();
    EXPECT_EQ(log->info.format, "euroc");
    EXPECT_EQ(log->poses.at(0).agent_name, "body");
    if (identity.empty()) identity = log->info.content_sha256;
    EXPECT_EQ(log->info.content_sha256, identity);
  }
  // With another sensor it is another log, and that sensor's folder alone is none.
  folder.Write("run/mav0/imu0/data.csv", "#timestamp,w_x,w_y,w_z,a_x,a_y,a_z\n7,0,0,0,0,0,0\n");
  EXPECT_EQ(ReasonOf(ReadAll(folder.Path("run/mav0/imu0")).status()), Reason::kFileMalformed);
  const absl::StatusOr<WholeLog> both = ReadAll(folder.Path("run"));
  ASSERT_TRUE(both.ok()) << both.status();
  EXPECT_EQ(both->imu.size(), 1u);
  EXPECT_NE(both->info.content_sha256, identity);
}

TEST(OpenLog, TellsBagsByTheirFirstBytes) {
  const TempFolder folder;
  ExpectMalformedFile(
      ReadAll(folder.Write("log.bin", std::string("\x89MCAP0\r\n") + "rest")).status(),
      {"log.bin: byte", "mcap recover"});
  ExpectMalformedFile(
      ReadAll(folder.Write("log.bin", std::string("SQLite format 3\0", 16) + "rest")).status(),
      {"log.bin", "whole pages", "copy it again"});
  ExpectMalformedFile(ReadAll(folder.Write("log.bag", "#ROSBAG V1.2\n")).status(), {"rosbag fix"});
  const std::string text = folder.Write("log.txt", "0 1 2 3\n");
  for (const char* const format : {"rosbag", "mcap", "rosbag2"}) {
    LogOptions options;
    options.format = format;
    ExpectMalformedFile(ReadAll(text, options).status(), {"is no ", format});
  }
}

TEST(OpenLog, RefusesExternalPosesForLogsWithoutARobot) {
  const TempFolder folder;
  LogOptions options;
  options.pose_file = folder.Path("poses.txt");
  EXPECT_EQ(ReasonOf(ReadAll(folder.Write("log.txt", "0 1 2 3\n"), options).status()),
            Reason::kFieldInvalid);
}

TEST(OpenLog, NamesARobotByThePrefix) {
  const TempFolder folder;
  LogOptions options;
  options.agent_prefix = "mav";
  const auto log = ReadAll(folder.Write("log.csv", "7,4,1,0,1,0,0,0\n"), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.at(0).agent_name, "mav");
}

TEST(OpenLog, IdentityIsTheContent) {
  const TempFolder folder;
  const auto a = ReadAll(folder.Write("a.txt", "0 1 2 3\n"));
  const auto b = ReadAll(folder.Write("b.txt", "0 1 2 3\n"));
  const auto c = ReadAll(folder.Write("c.txt", "0 1 2 4\n"));
  ASSERT_TRUE(a.ok() && b.ok() && c.ok());
  // printf '0 1 2 3\n' | sha256sum
  EXPECT_EQ(a->info.content_sha256,
            "3f31bc2191b8b55d447838e14cbce78ca44feba5b46c902ade4cc2eb7b68a041");
  EXPECT_EQ(a->info.content_sha256, b->info.content_sha256);
  EXPECT_NE(a->info.content_sha256, c->info.content_sha256);
}

TEST(OpenLog, OrdersByTimeThenName) {
  const TempFolder folder;
  const auto log = ReadAll(folder.Write("log.txt", "0 2 0 0\n10 2 1 0\n0 1 5 0\n10 10 6 0\n"));
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->poses.size(), 4u);
  EXPECT_EQ(log->poses[0].agent_name, "1");
  EXPECT_EQ(log->poses[0].line, 3);
  EXPECT_EQ(log->poses[1].agent_name, "2");
  EXPECT_EQ(log->poses[2].agent_name, "10");
  EXPECT_EQ(log->poses[3].agent_name, "2");
}

}  // namespace
}  // namespace dsg::ingest
