// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/bag/bag_writer.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/simulator/bag/small_log.h"

namespace dsg::simulator {
namespace {

// No file of this process may grow beyond `bytes`: the nearest thing to a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(size_t bytes) {
    handler_ = signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    signal(SIGXFSZ, handler_);
  }

 private:
  sighandler_t handler_;
  rlimit before_{};
};

class BagFailure : public testing::Test {
 protected:
  void SetUp() override { test::WriteFolder(log_, folder_.path()); }

  absl::Status Write(BagCompression compression = BagCompression::kLz4) {
    log_.Rewind();
    return WriteBag(&log_, folder_.path(), path_, BagOptions{.compression = compression});
  }
  // The write fails and says so with `reason` and `words`; nothing of it stays.
  void ExpectFails(Reason reason, const std::vector<std::string>& words) {
    const absl::Status status = Write();
    EXPECT_EQ(ReasonOf(status), reason) << status;
    for (const std::string& word : words) {
      EXPECT_NE(status.message().find(word), absl::string_view::npos) << status << " no " << word;
    }
    EXPECT_FALSE(std::filesystem::exists(path_));
    EXPECT_FALSE(std::filesystem::exists(path_ + ".part"));
  }

  dsg::test::TempFolder folder_;
  test::SmallLog log_ = test::MakeSmallLog(dsg::test::TestSeed(7));
  std::string path_ = folder_.path() + "/out.bag";
};

TEST_F(BagFailure, NamesAFolderThatIsNotThere) {
  path_ = folder_.path() + "/nowhere/out.bag";
  ExpectFails(Reason::kFieldInvalid, {path_, "No such file"});
}

TEST_F(BagFailure, NamesAFolderThatIsAFile) {
  path_ = folder_.path() + "/labels.csv/out.bag";
  ExpectFails(Reason::kFieldInvalid, {path_, "Not a directory"});
}

TEST_F(BagFailure, LeavesNothingWhenTheDiskIsFullAtAnyPoint) {
  for (const BagCompression compression : {BagCompression::kNone, BagCompression::kLz4}) {
    ASSERT_TRUE(Write(compression).ok());
    const size_t size = std::filesystem::file_size(path_);
    std::filesystem::remove(path_);
    for (size_t limit = 0; limit < size; limit += size / 23) {
      absl::Status status;
      {
        const FileSizeLimit full(limit);
        status = Write(compression);
      }
      EXPECT_EQ(ReasonOf(status), Reason::kDiskFull) << limit << ": " << status;
      EXPECT_NE(status.message().find(path_), absl::string_view::npos) << status;
      EXPECT_FALSE(std::filesystem::exists(path_));
      EXPECT_FALSE(std::filesystem::exists(path_ + ".part"));
    }
    EXPECT_TRUE(Write(compression).ok());
    std::filesystem::remove(path_);
  }
}

TEST_F(BagFailure, KeepsTheBagThatWasThere) {
  ASSERT_TRUE(Write().ok());
  const std::string before = test::ReadBytes(path_);
  std::get<ingest::ImageMeasurement>(log_.measurements[3]).load = [] {
    return MakeError(Reason::kFileMalformed, "cam1/7.png: cut short");
  };
  const absl::Status status = Write();
  EXPECT_EQ(status.message(), "cam1/7.png: cut short");
  EXPECT_TRUE(test::ReadBytes(path_) == before);
  EXPECT_FALSE(std::filesystem::exists(path_ + ".part"));
}

TEST_F(BagFailure, MissesTheLabelsOfALogWithLabelImages) {
  std::filesystem::remove(folder_.path() + "/labels.csv");
  EXPECT_TRUE(absl::IsNotFound(Write()));
  ExpectFails(Reason::kUnspecified, {"labels.csv"});
}

TEST_F(BagFailure, MissesTheDetectionsOfALogWithDetections) {
  std::filesystem::remove(folder_.path() + "/mav0/detections0/data.jsonl");
  EXPECT_TRUE(absl::IsNotFound(Write()));
  ExpectFails(Reason::kUnspecified, {"data.jsonl"});
}

TEST_F(BagFailure, NamesAClassWithoutAColour) {
  test::WriteText(folder_.path() + "/labels.csv",
                  "name,red,green,blue,alpha,id\nwall,1,2,3,255,1\n");
  ExpectFails(Reason::kFileMalformed, {"label0", "class 2", "labels.csv"});
}

TEST_F(BagFailure, NamesTheLineOfADetectionThatIsNone) {
  const std::string path = folder_.path() + "/mav0/detections0/data.jsonl";
  for (const char* line : {"{", "[1]", "{\"time_ns\": \"7\"}", "{\"time_ns\": 1.5}", "{\"id\": 7}",
                           "\xff\xfe", "{\"time_ns\": 1600000000123456788}"}) {
    test::WriteText(path, absl::StrCat("\n{\"time_ns\": 1600000000123456789}\n", line, "\n"));
    ExpectFails(Reason::kFileMalformed, {path + ":3", "time_ns"});
  }
}

TEST_F(BagFailure, RefusesStampsThatABagCannotHold) {
  for (const TimeNs time_ns : {TimeNs{0}, TimeNs{-1}, kTimeMin}) {
    std::get<ingest::ImuMeasurement>(log_.measurements.front()).time_ns = time_ns;
    ExpectFails(Reason::kFileMalformed, {absl::StrCat(time_ns), "stamp"});
  }
  std::get<ingest::ImuMeasurement>(log_.measurements.front()).time_ns = 1;
  EXPECT_TRUE(Write().ok());
  std::filesystem::remove(path_);
  std::get<ingest::ImuMeasurement>(log_.measurements.back()).time_ns =
      (TimeNs{1} << 32) * kNsPerSecond;
  ExpectFails(Reason::kFileMalformed, {"4294967296000000000"});
}

TEST_F(BagFailure, RefusesAnImageOfAnotherKindThanItsChannel) {
  auto& image = std::get<ingest::ImageMeasurement>(log_.measurements[2]);
  image.channel = "depth0";
  ExpectFails(Reason::kFileMalformed, {image.origin, "gray8", "depth0"});
  image.channel = "thermal0";
  ExpectFails(Reason::kFileMalformed, {image.origin, "thermal0"});
}

TEST_F(BagFailure, RefusesCalibrationThatABagHasNoPlaceFor) {
  log_.log_info.rig.imu->body_T_imu.position.x() = 0.01;
  ExpectFails(Reason::kFileMalformed, {"imu0", "T_BS"});
  log_.log_info.rig.imu.reset();
  log_.log_info.rig.cameras[3].fx += 0.5;
  ExpectFails(Reason::kFileMalformed, {"depth0", "cam0"});
}

TEST_F(BagFailure, RefusesGraphsAndPeople) {
  std::get<ingest::PoseMeasurement>(log_.measurements[1]).agent_kind = "human";
  ExpectFails(Reason::kFileMalformed, {"robot"});
  log_.measurements[1] = ingest::GraphMeasurement{};
  EXPECT_TRUE(absl::IsInvalidArgument(Write()));
}

}  // namespace
}  // namespace dsg::simulator
