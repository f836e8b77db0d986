// SPDX-License-Identifier: Apache-2.0
// Bags: what they hold, in all compressions, and what becomes of broken ones.
#include "ingest/log/bag_file.h"

#include <random>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag_chunk.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/bag_writer.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

std::string SmallBag(const std::string& compression) {
  BagWriter bag(compression);
  for (int i = 0; i < 10; ++i) {
    bag.Add("/imu0", "sensor_msgs/Imu", 1000 + i, ImuMessage(5000 + i, 0.1 * i, 9.81));
    bag.Add("/note", "std_msgs/String", 1000 + i, StringMessage(absl::StrCat("note ", i)));
  }
  return bag.Finish();
}

TEST(BagFile, GivesEachMessageInTheOrderOfRecording) {
  const TempFolder folder;
  for (const std::string compression : {"none", "bz2", "lz4"}) {
    const auto bag = BagFile::Open(folder.Write("log.bag", SmallBag(compression)));
    ASSERT_TRUE(bag.ok()) << compression << bag.status();
    ASSERT_EQ((*bag)->connections().size(), 2u);
    EXPECT_EQ((*bag)->connections()[0].topic, "/imu0");
    EXPECT_EQ((*bag)->connections()[0].type, "sensor_msgs/Imu");
    EXPECT_EQ((*bag)->connections()[0].message_count, 10);
    ASSERT_EQ((*bag)->messages().size(), 20u);
    for (int i = 0; i < 20; ++i) {
      const BagMessageRef& ref = (*bag)->messages()[static_cast<size_t>(i)];
      EXPECT_EQ(ref.bag_time_ns, 1000 + i / 2);
      const auto message = (*bag)->Read(ref);
      ASSERT_TRUE(message.ok()) << message.status();
      EXPECT_EQ(message->data.bytes, i % 2 == 0 ? ImuMessage(5000 + i / 2, 0.1 * (i / 2), 9.81)
                                                : StringMessage(absl::StrCat("note ", i / 2)));
      const auto head = (*bag)->Read(ref, 4);
      ASSERT_TRUE(head.ok());
      EXPECT_EQ(head->data.bytes, message->data.bytes.substr(0, 4));
    }
  }
}

TEST(BagFile, OutlivesItsMessagesAndIsOutlivedByThem) {
  const TempFolder folder;
  BagMessage message;
  {
    const auto bag = BagFile::Open(folder.Write("log.bag", SmallBag("lz4")));
    message = *(*bag)->Read((*bag)->messages()[1]);
  }
  EXPECT_EQ(message.data.bytes, StringMessage("note 0"));
}

TEST(BagFile, SaysHowToMendABagWithoutIndex) {
  const TempFolder folder;
  BagWriter writer;
  writer.Add("/imu0", "sensor_msgs/Imu", 1, ImuMessage(1, 0, 0));
  for (const int64_t index_at : {0, 1'000'000}) {
    const absl::Status status =
        BagFile::Open(folder.Write("log.bag", writer.Finish(index_at))).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
    EXPECT_NE(std::string(status.message()).find("rosbag reindex"), std::string::npos) << status;
  }
}

TEST(BagChunk, RefusesBombsAndWrongSizes) {
  EXPECT_FALSE(DecompressChunk("none", "abc", 4, "x").ok());
  EXPECT_FALSE(DecompressChunk("zip", "abc", 3, "x").ok());
  EXPECT_FALSE(DecompressChunk("bz2", "abc", kBagChunkBytesMax + 1, "x").ok());
  EXPECT_FALSE(DecompressChunk("lz4", "abc", kBagChunkBytesMax, "x").ok());
  const std::string zeros(1'000'000, '\0');
  std::string lz4(LZ4F_compressFrameBound(zeros.size(), nullptr), '\0');
  lz4.resize(LZ4F_compressFrame(lz4.data(), lz4.size(), zeros.data(), zeros.size(), nullptr));
  EXPECT_TRUE(DecompressChunk("lz4", lz4, zeros.size(), "x").ok());
  EXPECT_FALSE(DecompressChunk("lz4", lz4, zeros.size() - 1, "x").ok());
  EXPECT_FALSE(DecompressChunk("lz4", lz4, zeros.size() + 1, "x").ok());
  EXPECT_FALSE(DecompressChunk("lz4", lz4.substr(0, lz4.size() / 2), zeros.size(), "x").ok());
}

// Opens the bag as a log and reads all of it, images too. Any status will do.
void ReadHostile(const std::string& path) {
  const absl::StatusOr<WholeLog> log = ReadAll(path);
  if (!log.ok()) {
    EXPECT_EQ(ReasonOf(log.status()), Reason::kFileMalformed) << log.status();
    return;
  }
  for (const ImageMeasurement& image : log->images) (void)image.load();
}

std::string RichBag(const std::string& compression) {
  BagWriter bag(compression, 3);
  for (int i = 0; i < 6; ++i) {
    const TimeNs t = 100 + i;
    bag.Add("/tesse/imu/noisy/imu", "sensor_msgs/Imu", t, ImuMessage(t, 0.1, 9.81));
    bag.Add("/tesse/left_cam/mono/image_raw", "sensor_msgs/Image", t,
            ImageMessage(t, "mono8", 4, 3, 4, std::string(12, 'x')));
    bag.Add("/tesse/odom", "nav_msgs/Odometry", t, OdometryMessage(t, {1, 2, 3, 0, 0, 0, 1}));
  }
  bag.Add("/tesse/left_cam/camera_info", "sensor_msgs/CameraInfo", 1,
          CameraInfoMessage(4, 3, 3.0, "plumb_bob", {0, 0, 0, 0, 0}, "left_cam"));
  bag.Add("/tf_static", "tf2_msgs/TFMessage", 1,
          ByteWriter().U32(1).bytes() +
              TransformBytes(1, "base_link_gt", "left_cam", {0, 0.05, 0, 0.5, -0.5, 0.5, -0.5}));
  return bag.Finish();
}

TEST(BagFile, SurvivesAnyCut) {
  const TempFolder folder;
  for (const std::string compression : {"none", "bz2", "lz4"}) {
    const std::string whole = RichBag(compression);
    ASSERT_TRUE(ReadAll(folder.Write("log.bag", whole)).ok())
        << ReadAll(folder.Path("log.bag")).status();
    for (size_t size = 13; size < whole.size(); size += 37) {
      const std::string path = folder.Write("log.bag", whole.substr(0, size));
      EXPECT_FALSE(BagFile::Open(path).ok()) << size;
    }
  }
}

TEST(BagFile, SurvivesAnyChangedBytes) {
  constexpr unsigned kSeed = 20210713;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  const TempFolder folder;
  for (const std::string compression : {"none", "bz2", "lz4"}) {
    const std::string whole = RichBag(compression);
    for (int i = 0; i < 1200; ++i) {
      std::string changed = whole;
      const int count = 1 + static_cast<int>(random() % 3);
      for (int k = 0; k < count; ++k) {
        // Lengths are what can do harm; half of the changes make them huge.
        const char byte = random() % 2 == 0 ? '\xff' : static_cast<char>(random() % 256);
        changed[13 + random() % (changed.size() - 13)] = byte;
      }
      ReadHostile(folder.Write("log.bag", changed));
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
