// SPDX-License-Identifier: Apache-2.0
// Bad logs: each gets one error that names file, line and field, and says what to do.
#include <algorithm>
#include <random>

#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

TEST(ObsmatReader, RejectsBackwardTimeNamingTheLine) {
  ExpectMalformed("10 1 0 0 0 0 0 0\n0 2 0 0 0 0 0 0\n0 1 1 0 0 0 0 0\n", "obsmat",
                  {"log.txt:3", "\"1\"", "frame 10", "line 1", "frame 0", "sort the log"});
}

TEST(LogFormat, OfMatricesWithoutTimesIsToldWithWhatToDo) {
  ExpectMalformed("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.5 0 1 0 0 0 0 1 0\n", "auto",
                  {"log.txt", "without times", "KITTI", "times.txt", "TUM"});
  ExpectMalformed("1 0 0 0 0 1 0 0 0 0 1 0\n", "kitti", {"log.txt", "a kitti log is a folder"});
  ExpectMalformed("1 0 0 0 0 1 0 0 0 0 1\n", "auto", {"no known log format", "--format"});
}

TEST(TrajnetReader, NotesALastLineThatMayBeCutInItsLastNumber) {
  const TempFolder folder;
  LogOptions options;
  options.format = "trajnet";
  const std::string rows = "10 1 5.25 17.5\n20 1 5.25 17.7\n30 1 5.25 1";
  const auto cut = OpenLog(folder.Write("cut.txt", rows), options);
  ASSERT_TRUE(cut.ok()) << cut.status();
  ASSERT_EQ((*cut)->info().notes.size(), 1u);
  EXPECT_NE((*cut)->info().notes[0].find("cut"), std::string::npos);
  const auto whole = OpenLog(folder.Write("whole.txt", rows + "7.9\n"), options);
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_TRUE((*whole)->info().notes.empty());
}

TEST(TrajnetReader, RejectsADuplicateRowNamingBothLines) {
  ExpectMalformed("0 1 0.5 2\n0 2 0 0\n0 1 0.5 2\n", "trajnet",
                  {"log.txt:3", "repeats line 1", "remove the duplicate row"});
}

TEST(TrajnetReader, RejectsAnAgentInTwoPositionsAtOnce) {
  ExpectMalformed("0 1 0.5 2\n0 1 0.5 3\n", "trajnet", {"log.txt:2", "two positions", "line 1"});
}

TEST(TrajnetReader, RejectsBadNumbersNamingFieldAndValue) {
  ExpectMalformed("0 1 nan 2\n", "trajnet", {"log.txt:1", "field x", "\"nan\"", "finite"});
  ExpectMalformed("0 1 0 inf\n", "trajnet", {"field y", "\"inf\""});
  ExpectMalformed("0 1 0 1e300\n", "trajnet", {"field y", "1e300", "metres?"});
  ExpectMalformed("0 1 a 2\n", "trajnet", {"field x", "\"a\"", "number"});
  ExpectMalformed("0 1.5 0 2\n", "trajnet", {"field person", "\"1.5\"", "integer"});
  ExpectMalformed("0 -1 0 2\n", "trajnet", {"field person", "\"-1\""});
  ExpectMalformed("0.5 1 0 2\n", "trajnet", {"field frame", "\"0.5\"", "integer"});
  ExpectMalformed("1e30 1 0 2\n", "trajnet", {"field frame"});
}

TEST(TrajnetReader, RejectsAWrongCountOfColumns) {
  ExpectMalformed("0 1 0 2\n0 2 0\n1 1 1 1\n", "trajnet",
                  {"log.txt:2", "expected 4 columns", "found 3"});
  ExpectMalformed("0 1 0 2 9\n", "trajnet", {"expected 4 columns", "found 5"});
}

TEST(ObsmatReader, SaysThatTheLastLineWasCut) {
  ExpectMalformed("0 1 0 0 0 0 0 0\n10 1 0 0", "obsmat",
                  {"log.txt:2", "ends in the middle", "copy the log again"});
}

TEST(ObsmatReader, ChecksVelocitiesThatItDoesNotKeep) {
  ExpectMalformed("0 1 0 0 0 0 0 x\n", "obsmat", {"field vy", "\"x\""});
}

TEST(NdjsonReader, RejectsWhatIsNoTrack) {
  ExpectMalformed("{\"track\": {\"f\": 0, \"p\": 1, \"x\": 0}}\n", "trajnet-ndjson",
                  {"log.txt:1", "no field \"y\""});
  ExpectMalformed("{\"track\": {\"f\": 0, \"p\": 1, \"x\": 0, \"y\": \"a\"}}\n", "trajnet-ndjson",
                  {"field y", "number"});
  ExpectMalformed("{\"track\": {\"f\": 0, \"p\": 1, \"x\": 0, \"y\": NaN}}\n", "trajnet-ndjson",
                  {"log.txt:1", "JSON"});
  ExpectMalformed("{\"track\": {\"f\": 0, \"p\": 1.5, \"x\": 0, \"y\": 0}}\n", "trajnet-ndjson",
                  {"field person", "1.5"});
  ExpectMalformed("{\"track\": 3}\n", "trajnet-ndjson", {"no object"});
  ExpectMalformed("{\"trick\": {}}\n", "trajnet-ndjson", {"log.txt:1", "track"});
  ExpectMalformed("[1, 2]\n", "trajnet-ndjson", {"log.txt:1"});
  ExpectMalformed("{\"scene\": {}}\n{\"track\": {\"f\": 0, \"p\"", "trajnet-ndjson",
                  {"log.txt:2", "ends in the middle"});
  ExpectMalformed("{\"scene\": {}}\n", "trajnet-ndjson", {"no row"});
  ExpectMalformed(
      "{\"track\": {\"f\": 0, \"p\": 1, \"x\": 0, \"y\": 0, \"prediction_number\": 0}}\n",
      "trajnet-ndjson", {"predicted"});
}

TEST(ThorReader, RejectsMissingColumnsAndBadCells) {
  const std::string header = "Time,x,y,z,ag_id,data_label,tracklet_id\n";
  ExpectMalformed("Time,x,y,z,ag_id,data_label\n", "thor", {"tracklet_id"});
  ExpectMalformed(header, "thor", {"no row"});
  ExpectMalformed(header + "0.1,0,0,0,,a,1\n", "thor", {"log.txt:2", "field ag_id"});
  ExpectMalformed(header + "0.1,0,0,0,H,a,1.5\n", "thor", {"field tracklet_id", "1.5"});
  ExpectMalformed(header + "0.1,0,0,0,H,a,-1\n", "thor", {"field tracklet_id", "-1"});
  ExpectMalformed(header + "soon,0,0,0,H,a,1\n", "thor", {"field Time", "soon"});
  ExpectMalformed(header + "0.1,0,0,0,H,a\n", "thor", {"expected 7 columns"});
  ExpectMalformed(header + "0.5,0,0,0,H,a,1\n0.1,0,0,0,H,a,1\n", "thor",
                  {"log.txt:3", "H/1", "steps back"});
}

TEST(EurocReader, RejectsOtherTablesAndBadQuaternions) {
  const std::string row = "1403636584263555584,4.7,-1.8,0.7,1,0,0,0";
  ExpectMalformed("#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n", "euroc", {"7 columns"});
  ExpectMalformed("#timestamp,q_w,q_x,q_y,q_z,p_x,p_y,p_z\n", "euroc", {"field header", "q_w"});
  ExpectMalformed("1403636584263555584,4.7,-1.8,0.7,2,0,0,0\n", "euroc",
                  {"log.txt:1", "orientation", "norm is 2"});
  ExpectMalformed("1403636584263555584,4.7,-1.8,0.7,nan,0,0,0\n", "euroc", {"field q_w"});
  ExpectMalformed("1403636584.5,4.7,-1.8,0.7,1,0,0,0\n", "euroc", {"field timestamp"});
  ExpectMalformed(row + "\n" + row + "\n", "euroc", {"log.txt:2", "repeats line 1"});
  ExpectMalformed(row + "\n1403636584263555583,4.7,-1.8,0.7,1,0,0,0\n", "euroc",
                  {"steps back", "1403636584263555583"});
}

TEST(TracksReader, RejectsBadHeadersKindsAndNames) {
  const std::string header = "time_ns,agent,kind,x,y,z,qx,qy,qz,qw\n";
  ExpectMalformed("time_ns,agent,kind,x,y,z\n0,a,human,0,0,0\n", "dsg-tracks",
                  {"log.txt:1", "header"});
  ExpectMalformed(header + "0,a,cat,0,0,0,0,0,0,1\n", "dsg-tracks", {"field kind", "\"cat\""});
  ExpectMalformed(header + "0,,human,0,0,0,0,0,0,1\n", "dsg-tracks", {"field agent"});
  ExpectMalformed(header + "0,a,human,0,0,0,0,0,0,\n", "dsg-tracks", {"field qw"});
  ExpectMalformed(header + "0,a,human,0,0,0,0,0,0,3\n", "dsg-tracks", {"orientation"});
  ExpectMalformed(header, "dsg-tracks", {"no row"});
}

TEST(Readers, SurviveAnyCutAndAnyFlippedByte) {
  const std::vector<std::pair<std::string, std::string>> logs = {
      {"obsmat", "0 1 0 0 0 0 0 0\n10 1 1 0 1 0 0 0\n20 1 2 0 1 0 0 0\n"},
      {"trajnet", "0\t1\t0.5\t2.5\n10\t1\t0.75\t2.25\n"},
      {"trajnet-ndjson", "{\"track\": {\"f\": 0, \"p\": 1, \"x\": 0.5, \"y\": -1}}\n"},
      {"thor", "Time,x,y,z,ag_id,data_label,tracklet_id\n0.1,1,2,3,H,a,1.0\n0.5,1,2,3,H,a,1.0\n"},
      {"euroc", "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n1403636584263555584,4,1,0,1,0,0,0\n"},
      {"dsg-tracks", "time_ns,agent,kind,x,y,z,qx,qy,qz,qw\n0,a,human,0,0,0,0,0,0,1\n"}};
  constexpr unsigned kSeed = 20140625;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  const TempFolder folder;
  for (const auto& [format, bytes] : logs) {
    LogOptions options;
    options.format = format;
    const auto check = [&](const std::string& changed) {
      const absl::StatusOr<WholeLog> log = ReadAll(folder.Write("log.txt", changed), options);
      EXPECT_TRUE(log.ok() || ReasonOf(log.status()) == Reason::kFileMalformed)
          << format << ": " << log.status();
      (void)ReadAll(folder.Path("log.txt")).status();
    };
    ASSERT_TRUE(ReadAll(folder.Write("log.txt", bytes), options).ok()) << format;
    for (size_t size = 0; size < bytes.size(); ++size) check(bytes.substr(0, size));
    for (int i = 0; i < 50; ++i) {
      std::string changed = bytes;
      changed[random() % changed.size()] = static_cast<char>(random() % 256);
      check(changed);
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
