// SPDX-License-Identifier: Apache-2.0
// Loop closures as lines of JSON: in a folder, in a bag, in a file of their own.
#include "ingest/log/loop_file.h"

#include <Eigen/Cholesky>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/bag_writer.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

constexpr char kPoses[] =
    "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n100,0,0,0,1,0,0,0\n200,1,0,0,1,0,0,0\n"
    "300,2,0,0,1,0,0,0\n";

std::string Line(TimeNs from_ns, TimeNs to_ns, const std::string& more = "") {
  return absl::StrCat("{\"from_ns\": ", from_ns, ", \"to_ns\": ", to_ns,
                      ", \"translation\": [1, 2, 3], \"rotation\": [0, 0, 1, 0]",
                      ", \"sigma_m\": 0.1, \"sigma_rad\": 0.01", more, "}\n");
}

absl::StatusOr<LoopMeasurement> ParseLoop(const std::string& line) {
  LoopLines loops;
  const std::string file = "loops.jsonl";
  const absl::Status status = loops.Add(LinePosition{file, 7}, line);
  if (!status.ok()) return status;
  std::vector<std::string> notes;
  return std::get<LoopMeasurement>(*loops.TakeChannel(&notes).make(0));
}

void ExpectRefused(const std::string& line, const std::string& part) {
  const auto loop = ParseLoop(line);
  EXPECT_EQ(ReasonOf(loop.status()), Reason::kFileMalformed) << line;
  const std::string message(loop.status().message());
  EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_NE(message.find("loops.jsonl:7"), std::string::npos) << message;
}

std::string Replace(const std::string& from, const std::string& to) {
  return absl::StrReplaceAll(Line(100, 300), {{from, to}});
}

TEST(LoopFile, ReadsPoseAndDeviations) {
  const auto loop = ParseLoop(Line(100, 300, ", \"score\": 0.5"));
  ASSERT_TRUE(loop.ok()) << loop.status();
  EXPECT_EQ(loop->from_ns, 100);
  EXPECT_EQ(loop->time_ns, 300);
  EXPECT_EQ(loop->from_T_to.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(loop->from_T_to.orientation.z(), 1.0);
  EXPECT_DOUBLE_EQ(loop->information(0, 0), 100.0);
  EXPECT_DOUBLE_EQ(loop->information(5, 5), 10000.0);
  EXPECT_EQ(loop->score, 0.5);
  EXPECT_EQ(loop->origin, "loops.jsonl:7");
}

TEST(LoopFile, AnyLoopIsReadBackAsItWasWritten) {
  Random random(20, 0);
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(i);
    LoopMeasurement loop;
    loop.from_ns = random.Integer(0, 1'000'000);
    loop.time_ns = loop.from_ns + random.Integer(1, 1000);
    loop.from_T_to.position = {random.Normal(), random.Normal(), random.Normal()};
    loop.from_T_to.orientation =
        Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), 1.0).normalized();
    Eigen::Matrix<double, 6, 6> root;
    for (double& value : root.reshaped()) value = random.Normal();
    loop.information = root * root.transpose() + Eigen::Matrix<double, 6, 6>::Identity();
    if (random.Chance(0.5)) loop.score = random.Uniform();
    const auto again = ParseLoop(FormatLoop(loop));
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->from_ns, loop.from_ns);
    EXPECT_EQ(again->time_ns, loop.time_ns);
    EXPECT_EQ(again->from_T_to.position, loop.from_T_to.position);
    EXPECT_LT(AngleBetween(again->from_T_to.orientation, loop.from_T_to.orientation), 1e-12);
    EXPECT_TRUE(again->information.isApprox(loop.information, 1e-15));
    EXPECT_EQ(again->score, loop.score);
  }
}

TEST(LoopFile, RefusesWhatIsNoLoopClosureAndSaysWhere) {
  ExpectRefused("{\"from_ns\": 1", "JSON");
  ExpectRefused(Replace("0.1", "NaN"), "NaN");
  ExpectRefused(Replace("[1, 2, 3]", "[1, 2]"), "translation");
  ExpectRefused(Replace("[1, 2, 3]", "[1, 2, 1e300]"), "translation");
  ExpectRefused(Replace("[0, 0, 1, 0]", "[0, 0, 1, 1]"), "");
  ExpectRefused(Replace("\"to_ns\": 300", "\"to_ns\": 100"), "from_ns is the same");
  ExpectRefused(Replace("\"to_ns\": 300", "\"to_ns\": 1.5"), "to_ns");
  ExpectRefused(Replace("\"to_ns\": 300", "\"to_ns\": -3"), "to_ns");
  ExpectRefused(Replace("\"sigma_rad\": 0.01", "\"sigma_rad\": 0"), "sigma_rad");
  ExpectRefused(Replace(", \"sigma_rad\": 0.01", ""), "sigma_rad");
  ExpectRefused(std::string(70'000, ' ') + Line(1, 2), "bytes");
  ExpectRefused(std::string(5000, '['), "brackets");
  ExpectRefused("[1, 2]", "JSON");
}

TEST(LoopFile, RefusesInformationThatIsNotPositiveDefinite) {
  LoopMeasurement loop;
  loop.from_ns = 1;
  loop.time_ns = 2;
  loop.information(2, 2) = -1.0;
  ExpectRefused(FormatLoop(loop), "positive definite");
  loop.information.setIdentity();
  ASSERT_TRUE(ParseLoop(FormatLoop(loop)).ok());
  ExpectRefused(absl::StrReplaceAll(FormatLoop(loop), {{"\"information\"",
                                                        "\"sigma_m\": 1, "
                                                        "\"information\""}}),
                "one kind");
}

class LoopLogTest : public testing::Test {
 protected:
  void SetUp() override { folder_.Write("mav0/state_groundtruth_estimate0/data.csv", kPoses); }
  TempFolder folder_;
};

TEST_F(LoopLogTest, AFolderGivesItsLoopsByTheTimeOfTheLaterPose) {
  folder_.Write("mav0/loop_closures0/data.jsonl",
                Line(100, 300) + Line(300, 200, ", \"by\": \"me\"") + Line(200, 300));
  const auto log = ReadAll(folder_.Path(""));
  ASSERT_TRUE(log.ok()) << log.status();
  const std::vector<std::pair<std::string, TimeNs>> order = {{"poses", 100},  {"poses", 200},
                                                             {"loops0", 200}, {"poses", 300},
                                                             {"loops0", 300}, {"loops0", 300}};
  EXPECT_EQ(log->order, order);
  EXPECT_EQ(log->loops[1].from_ns, 100);
  EXPECT_EQ(log->loops[1].origin, "data.jsonl:1");
  EXPECT_EQ(log->info.channel_counts.at("loops0"), 3);
  bool has_note = false;
  for (const std::string& note : log->info.notes) {
    has_note = has_note || note.find("by (1)") != std::string::npos;
  }
  EXPECT_TRUE(has_note);
}

TEST_F(LoopLogTest, AFileOfItsOwnTakesThePlaceOfTheLogsAndIsAnotherLog) {
  folder_.Write("mav0/loop_closures0/data.jsonl", Line(100, 300));
  const auto own = ReadAll(folder_.Path(""));
  LogOptions options;
  options.loop_file = folder_.Write("found.jsonl", Line(100, 200) + Line(200, 300));
  const auto other = ReadAll(folder_.Path(""), options);
  ASSERT_TRUE(own.ok() && other.ok()) << own.status() << other.status();
  EXPECT_EQ(own->loops.size(), 1u);
  EXPECT_EQ(other->loops.size(), 2u);
  EXPECT_NE(own->info.content_sha256, other->info.content_sha256);
}

TEST_F(LoopLogTest, AnEmptyFileIsALogWithoutLoops) {
  folder_.Write("mav0/loop_closures0/data.jsonl", "");
  const auto log = ReadAll(folder_.Path(""));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(log->loops.empty());
  EXPECT_EQ(log->info.channel_counts.at("loops0"), 0);
}

TEST_F(LoopLogTest, ABrokenLineIsNamed) {
  folder_.Write("mav0/loop_closures0/data.jsonl", Line(100, 300) + "\n{}\n");
  const auto log = ReadAll(folder_.Path(""));
  EXPECT_EQ(ReasonOf(log.status()), Reason::kFileMalformed);
  EXPECT_NE(std::string(log.status().message()).find("data.jsonl:3: "), std::string::npos)
      << log.status();
}

TEST_F(LoopLogTest, AMissingFileIsNotFound) {
  LogOptions options;
  options.loop_file = folder_.Path("nothing.jsonl");
  EXPECT_TRUE(absl::IsNotFound(ReadAll(folder_.Path(""), options).status()));
}

TEST_F(LoopLogTest, LogsOfTracksTakeNoLoops) {
  LogOptions options;
  options.loop_file = folder_.Write("found.jsonl", Line(100, 200));
  const std::string tracks = folder_.Write("obsmat.txt", "0 1 1 0 1 0 0 0\n");
  EXPECT_EQ(ReasonOf(ReadAll(tracks, options).status()), Reason::kFieldInvalid);
}

TEST(LoopBag, LoopsFoundLateAreGivenAtTheirStamps) {
  BagWriter bag("none");
  for (int i = 0; i < 20; ++i) {
    const TimeNs t = kT0 + i * kNsPerSecond;
    bag.Add("/tesse/odom", "nav_msgs/Odometry", t, OdometryMessage(t, {1.0 * i, 2, 3, 0, 0, 0, 1}));
  }
  // Recorded at the end, out of order.
  for (const int to : {15, 5}) {
    bag.Add("/dsg/loop_closures", "std_msgs/String", kT0 + 30 * kNsPerSecond,
            StringMessage(Line(kT0, kT0 + to * kNsPerSecond)));
  }
  const TempFolder folder;
  const std::string path = folder.Write("log.bag", bag.Finish());
  const auto log = ReadAll(path);
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->loops.size(), 2u);
  EXPECT_EQ(log->loops[0].time_ns, kT0 + 5 * kNsPerSecond);
  EXPECT_EQ(log->order[6].first, "loops0");
  EXPECT_EQ(log->info.channel_counts.at("loops0"), 2);
  EXPECT_EQ(log->info.measurement_count, 22);

  LogOptions options;
  options.loop_file = folder.Write("found.jsonl", Line(kT0, kT0 + 1));
  const auto other = ReadAll(path, options);
  ASSERT_TRUE(other.ok()) << other.status();
  EXPECT_EQ(other->loops.size(), 1u);
  EXPECT_NE(other->info.content_sha256, log->info.content_sha256);
}

TEST(LoopBag, ABrokenMessageIsNamed) {
  BagWriter bag("none");
  bag.Add("/dsg/loop_closures", "std_msgs/String", kT0, StringMessage("{}"));
  const TempFolder folder;
  const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
  EXPECT_EQ(ReasonOf(log.status()), Reason::kFileMalformed);
  EXPECT_NE(std::string(log.status().message()).find("/dsg/loop_closures message 1"),
            std::string::npos)
      << log.status();
}

}  // namespace
}  // namespace dsg::ingest
