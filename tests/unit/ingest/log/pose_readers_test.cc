// SPDX-License-Identifier: Apache-2.0
// Trajectories of TUM's form and tables that name their columns.
#include <random>

#include "absl/strings/str_cat.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

constexpr char kTumRemark[] = "# timestamp tx ty tz qx qy qz qw\n";

absl::StatusOr<WholeLog> ReadText(const std::string& bytes, const LogOptions& options = {}) {
  const TempFolder folder;
  return ReadAll(folder.Write("log.txt", bytes), options);
}

std::string Notes(const LogInfo& info) {
  std::string notes;
  for (const std::string& note : info.notes) notes += note + "\n";
  return notes;
}

// 200 poses, of which number `repeated` comes twice, the second time elsewhere.
std::string TumRows(int repeated) {
  std::string rows = kTumRemark;
  for (int i = 0; i < 200; ++i) {
    absl::StrAppend(&rows, 1600000000 + i, ".5 ", i, ".25 2 3 0 0 0 1\n");
    if (i == repeated) absl::StrAppend(&rows, 1600000000 + i, ".5 ", i, ".75 2 3 0 0 0 1\n");
  }
  return rows;
}

TEST(TumReader, IsToldFromObsmatByRemarksOrFractions) {
  for (const std::string& bytes :
       {std::string(kTumRemark) + "1 2 3 4 0 0 0 1\n", std::string("1.5 2 3 4 0 0 0 1\n"),
        std::string("1 0 0 0 0 0 0 1\n2 0.5 0 0 0 0 0 1\n")}) {
    const auto log = ReadText(bytes);
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->info.format, "tum") << bytes;
  }
  const auto obsmat = ReadText("1 2 3.5 0 4.5 0.1 0 0.2\n7 2 3.6 0 4.6 0.1 0 0.2\n");
  ASSERT_TRUE(obsmat.ok()) << obsmat.status();
  EXPECT_EQ(obsmat->info.format, "obsmat");
}

TEST(TumReader, IsTheTrajectoryOfOneRobot) {
  const auto log = ReadText("1600000000.000000001 1 2 3 0 0 0.6 0.8\n1600000001 1 2 4 0 0 0 1\n");
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(log->info.has_clock);
  EXPECT_EQ(log->info.clock, Clock::kUnix);
  ASSERT_EQ(log->poses.size(), 2u);
  EXPECT_EQ(log->poses[0].agent_name, "body");
  EXPECT_EQ(log->poses[0].agent_kind, kinds::kRobot);
  EXPECT_EQ(log->poses[0].pose.time_ns, 1'600'000'000'000'000'001);
  EXPECT_EQ(log->poses[0].pose.map_T_agent.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(log->poses[0].pose.map_T_agent.orientation.w(), 0.8, 1e-15);
  EXPECT_EQ(log->poses[0].pose.flags, 0u);
}

TEST(TumReader, CountsFromTheEpochBefore2001) {
  LogOptions options;
  options.epoch_ns = 7'000;
  const auto log = ReadText("0.5 1 2 3 0 0 0 1\n1.5 1 2 3 0 0 0 1\n", options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_FALSE(log->info.has_clock);
  EXPECT_EQ(log->poses[0].pose.time_ns, 500'007'000);
  EXPECT_NE(Notes(log->info).find("--epoch"), std::string::npos);
}

TEST(TumReader, KeepsTheFirstOfARepeatedStampAndCounts) {
  const auto log = ReadText(TumRows(20));
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->poses.size(), 200u);
  EXPECT_EQ(log->info.measurement_count, 200);
  EXPECT_EQ(log->poses[20].pose.map_T_agent.position.x(), 20.25);
  EXPECT_NE(Notes(log->info).find("1 of 201 rows"), std::string::npos) << Notes(log->info);
  EXPECT_NE(Notes(log->info).find("line 23"), std::string::npos) << Notes(log->info);
  LogOptions options;
  options.is_strict = true;
  ExpectMalformedFile(ReadText(TumRows(20), options).status(), {"log.txt:23", "two positions"});
  // Half of the rows is no small flaw.
  ExpectMalformed("1.5 1 0 0 0 0 0 1\n1.5 2 0 0 0 0 0 1\n", "tum", {"log.txt:2", "two positions"});
}

TEST(TumReader, SaysTheSameOfAPoseFile) {
  const TempFolder folder;
  folder.Write("mav0/imu0/data.csv",
               "#timestamp,w_x,w_y,w_z,a_x,a_y,a_z\n1600000010000000000,0,0,0,0,0,0\n");
  LogOptions options;
  options.pose_file = folder.Write("poses.txt", TumRows(3));
  const auto log = ReadAll(folder.Path(""), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 200u);
  EXPECT_NE(Notes(log->info).find("1 of 201 rows"), std::string::npos) << Notes(log->info);
  options.is_strict = true;
  ExpectMalformedFile(ReadAll(folder.Path(""), options).status(), {"poses.txt:6"});
}

TEST(TumReader, NamesBadRows) {
  ExpectMalformed("1 2 3 4 0 0 0 2\n", "tum", {"log.txt:1", "orientation", "norm is 2"});
  ExpectMalformed("1 2 3 4 0 0 0\n", "tum", {"log.txt:1", "expected 8 columns", "found 7"});
  ExpectMalformed("1 2 3 4 0 0 0 1\n0 2 3 4 0 0 0 1\n", "tum", {"log.txt:2", "steps back"});
  ExpectMalformed("1e300 2 3 4 0 0 0 1\n", "tum", {"field timestamp", "seconds"});
  ExpectMalformed(kTumRemark, "tum", {"no row"});
  ExpectMalformed("1 2 3 4 0 0 0 1\n2 2 3", "tum", {"log.txt:2", "ends in the middle"});
}

TEST(CsvReader, FindsColumnsByTheirNames) {
  const auto log = ReadText(
      "\xef\xbb\xbf\"Time [ms]\";kind;agent_id;tx;ty;tz;qw;qx;qy;qz;speed\r\n"
      "1600000000000.5;robot;R2;1;2;3;0.8;0;0;0.6;9\r\n"
      "1600000000000.5;human;\"7\";4;5;6;;;;;fast\r\n");
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "csv");
  EXPECT_TRUE(log->info.has_clock);
  ASSERT_EQ(log->poses.size(), 2u);
  EXPECT_EQ(log->poses[0].agent_name, "7");
  EXPECT_EQ(log->poses[0].agent_kind, kinds::kHuman);
  EXPECT_EQ(log->poses[0].pose.time_ns, 1'600'000'000'000'500'000);
  EXPECT_EQ(log->poses[0].pose.flags, pose_flags::kNoOrientation);
  EXPECT_EQ(log->poses[1].agent_name, "R2");
  EXPECT_EQ(log->poses[1].agent_kind, kinds::kRobot);
  EXPECT_EQ(log->poses[1].pose.map_T_agent.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(log->poses[1].pose.map_T_agent.orientation.z(), 0.6, 1e-15);
  EXPECT_EQ(log->poses[1].pose.flags, 0u);
  EXPECT_NE(Notes(log->info).find("not read: \"speed\""), std::string::npos) << Notes(log->info);
}

TEST(CsvReader, CallsAgentsByTheNameBesideTheirId) {
  const auto log = ReadText(
      "agent_id,agent_name,agent_kind,time_ns,x_m,y_m\n"
      "H5,henry,human,1,0,0\nr0,robot,robot,2,0,0\nH6,,human,3,0,0\nH7,henry,human,4,0,0\n"
      "H5,henry,human,5,0,0\n");
  ASSERT_TRUE(log.ok()) << log.status();
  std::vector<std::string> names;
  for (const PoseMeasurement& pose : log->poses) names.push_back(pose.agent_name);
  EXPECT_EQ(names, (std::vector<std::string>{"henry", "robot", "H6", "henry", "henry"}));
  EXPECT_NE(Notes(log->info).find("\"henry\" is one agent, of 2 ids, H5 among them"),
            std::string::npos)
      << Notes(log->info);
  EXPECT_EQ(log->poses[1].agent_kind, kinds::kRobot);
  EXPECT_EQ(Notes(log->info).find("not read"), std::string::npos) << Notes(log->info);
}

TEST(CsvReader, ReadsFieldsInQuotes) {
  const auto log = ReadText(
      "time_ns,\"agent_id\",x,y,z\n"
      "1,\"Smith, Anna\" ,0,0,0\n2,\"the \"\"old\"\" one\",0,\"1.5\",0\n3,5\" cart,0,0,0\n");
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->poses.size(), 3u);
  EXPECT_EQ(log->poses[0].agent_name, "Smith, Anna");
  EXPECT_EQ(log->poses[1].agent_name, "the \"old\" one");
  EXPECT_EQ(log->poses[1].pose.map_T_agent.position.y(), 1.5);
  EXPECT_EQ(log->poses[2].agent_name, "5\" cart");
  const auto tabs = ReadText("time_ns\tx\ty\tz\tid\n1\t0\t0\t\"2\"\t\"a\tb\"\n");
  ASSERT_TRUE(tabs.ok()) << tabs.status();
  EXPECT_EQ(tabs->poses.at(0).agent_name, "a\tb");
  EXPECT_EQ(tabs->poses.at(0).pose.map_T_agent.position.z(), 2.0);
  for (const char* field : {"\"anna", "\"anna\" b", "\"anna\nb\""}) {
    ExpectMalformed(absl::StrCat("time_ns,id,x,y\n1,", field, ",0,0\n"), "csv",
                    {":2", "field in quotes"});
  }
}

TEST(CsvReader, TakesPeopleWithIdsAndOneRobotWithout) {
  LogOptions options;
  options.agent_prefix = "a-";
  options.epoch_ns = 5;
  const auto people = ReadText("time,id,x,y\n0.25,3,1,2\n0.25,4,1,2\n0.5,3,1,2\n", options);
  ASSERT_TRUE(people.ok()) << people.status();
  ASSERT_EQ(people->poses.size(), 3u);
  EXPECT_EQ(people->poses[0].agent_name, "a-3");
  EXPECT_EQ(people->poses[0].agent_kind, kinds::kHuman);
  EXPECT_EQ(people->poses[0].pose.time_ns, 250'000'005);
  EXPECT_NE(Notes(people->info).find("z = 0"), std::string::npos);
  EXPECT_NE(Notes(people->info).find("all agents are people"), std::string::npos);
  const auto robot = ReadText("# time_ns\tx\ty\tz\n1600000000000000001\t1\t2\t3\n");
  ASSERT_TRUE(robot.ok()) << robot.status();
  EXPECT_EQ(robot->poses.at(0).agent_name, "body");
  EXPECT_EQ(robot->poses.at(0).agent_kind, kinds::kRobot);
  EXPECT_EQ(robot->poses.at(0).pose.time_ns, 1'600'000'000'000'000'001);
}

TEST(CsvReader, NamesWhatIsWrongWithHeaders) {
  ExpectMalformed("time,x\n0,1\n", "csv", {"field header", "no column y"});
  ExpectMalformed("time,x,y,qx,qy,qz\n0,1,2,0,0,0\n", "csv", {"qw", "go together"});
  ExpectMalformed("time,x,y,pos_y\n0,1,2,2\n", "csv", {"pos_y", "second column of y"});
  ExpectMalformed("time [min],x,y\n0,1,2\n", "csv", {"time [min]", "s, ms, us or ns"});
  ExpectMalformed("time,x [mm],y\n0,1,2\n", "csv", {"x [mm]", "metres"});
  // Detection leaves it to the reader to say so.
  ExpectMalformed("time,x [mm],y\n0,1,2\n", "auto", {"x [mm]", "metres"});
}

TEST(CsvReader, NamesBadRows) {
  const std::string header = "time,id,kind,x,y,z,qx,qy,qz,qw\n";
  ExpectMalformed(header, "csv", {"no row"});
  ExpectMalformed(header + "0,a,cat,0,0,0,0,0,0,1\n", "csv", {"log.txt:2", "kind", "\"cat\""});
  ExpectMalformed(header + "0,,human,0,0,0,0,0,0,1\n", "csv", {"log.txt:2", "field id"});
  ExpectMalformed(header + "0,\xff,human,0,0,0,0,0,0,1\n", "csv", {"field id", "UTF-8"});
  ExpectMalformed(header + "0,a,human,,0,0,0,0,0,1\n", "csv", {"field x", "number"});
  ExpectMalformed(header + "0,a,human,0,0,0,0,0,0,\n", "csv", {"field qw"});
  ExpectMalformed(header + "0,a,human,0,0,0,0,0,0,5\n", "csv", {"orientation", "norm is 5"});
  ExpectMalformed(header + "0,a,human,0,0,0\n", "csv", {"expected 10 columns", "found 6"});
  ExpectMalformed(header + "1,a,human,0,0,0,,,,\n0,a,human,0,0,0,,,,\n", "csv",
                  {"log.txt:3", "\"a\"", "steps back"});
  ExpectMalformed("time,x,y\n1403636584263555584,0,0\n", "csv", {"field time", "seconds"});
  ExpectMalformed("time_ms,x,y\n1e300,0,0\n", "csv", {"field time", "1e-3"});
}

TEST(CsvReader, ReadsManyAgentsAndNotTooMany) {
  std::string rows = "time,id,x,y\n";
  for (size_t i = 0; i < kAgentsOfLogMax; ++i) absl::StrAppend(&rows, "1,", i, ",0,0\n");
  const TempFolder folder;
  const auto log = OpenLog(folder.Write("log.csv", rows), {});
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ((*log)->info().measurement_count, kAgentsOfLogMax);
  rows += "1,one more,0,0\n";
  const absl::Status refused = OpenLog(folder.Write("more.csv", rows), {}).status();
  EXPECT_TRUE(absl::StrContains(refused.message(), "100001 agents in 100001 rows")) << refused;
}

TEST(PoseReaders, SurviveAnyCutAndAnyFlippedByte) {
  const std::pair<std::string, std::string> logs[] = {
      {"tum", std::string(kTumRemark) + "1.5 1 2 3 0 0 0 1\n2.5 1 2 3 0 0 0 1\n"},
      {"csv", "time,id,kind,x,y,z,qx,qy,qz,qw\n0,a,human,0,0,0,0,0,0,1\n1,a,human,0,0,0,,,,\n"}};
  std::mt19937 random(20261125);
  for (const auto& [format, bytes] : logs) {
    const auto check = [&, &name = format](const std::string& changed) {
      LogOptions options;
      options.format = name;
      const absl::Status status = ReadText(changed, options).status();
      EXPECT_TRUE(status.ok() || ReasonOf(status) == Reason::kFileMalformed) << status;
    };
    ASSERT_TRUE(ReadText(bytes).ok()) << format;
    for (size_t size = 0; size < bytes.size(); ++size) check(bytes.substr(0, size));
    for (int i = 0; i < 100; ++i) {
      std::string changed = bytes;
      changed[random() % changed.size()] = static_cast<char>(random() % 256);
      check(changed);
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
