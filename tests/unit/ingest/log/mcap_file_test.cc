// SPDX-License-Identifier: Apache-2.0
// MCAP files: what they hold in all their variants, and what becomes of broken ones.
#include "ingest/log/mcap_file.h"

#include <random>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

Recording Chatter(int count) {
  Recording recording;
  for (int i = 0; i < count; ++i) {
    recording.push_back({i % 3 == 0 ? "/a" : "/b", "std_msgs/String", kT0 + i,
                         StringFields(CdrWriter(), absl::StrCat("message ", i))});
  }
  return recording;
}

// Opens and reads every message: no crash, and whatever comes is bounded.
absl::Status ReadEverything(const std::string& path) {
  const auto bag = McapFile::Open(path);
  if (!bag.ok()) return bag.status();
  for (const BagMessageRef& message : (*bag)->messages()) {
    const auto bytes = (*bag)->Read(message);
    if (!bytes.ok()) return bytes.status();
  }
  return absl::OkStatus();
}

TEST(McapFile, ReadsAllVariantsAlike) {
  const TempFolder folder;
  const Recording recording = Chatter(10);
  for (const char* const compression : {"", "lz4", "zstd", "plain"}) {
    for (int variant = 0; variant < 8; ++variant) {
      const McapOptions options{.compression = compression,
                                .has_index = (variant & 1) != 0,
                                .has_summary = (variant & 2) != 0,
                                .has_checksums = (variant & 4) != 0};
      SCOPED_TRACE(absl::StrCat(compression, " ", variant));
      const auto bag = McapFile::Open(folder.Write("log.mcap", WriteMcap(recording, options)));
      ASSERT_TRUE(bag.ok()) << bag.status();
      ASSERT_EQ((*bag)->connections().size(), 2u);
      EXPECT_EQ((*bag)->connections()[0].topic, "/a");
      EXPECT_EQ((*bag)->connections()[0].type, "std_msgs/String");
      EXPECT_EQ((*bag)->connections()[0].encoding, RosEncoding::kCdr);
      EXPECT_EQ((*bag)->connections()[0].message_count, 4);
      ASSERT_EQ((*bag)->messages().size(), recording.size());
      for (size_t i = 0; i < recording.size(); ++i) {
        const BagMessageRef& ref = (*bag)->messages()[i];
        EXPECT_EQ(ref.bag_time_ns, recording[i].time_ns);
        EXPECT_EQ((*bag)->connections()[ref.connection].topic, recording[i].topic);
        const auto message = (*bag)->Read(ref);
        ASSERT_TRUE(message.ok()) << message.status();
        EXPECT_EQ(message->data.bytes, recording[i].data);
        EXPECT_EQ((*bag)->Read(ref, 6)->data.bytes, recording[i].data.substr(0, 6));
      }
    }
  }
}

TEST(McapFile, KeepsTheOrderOfMessagesOfOneInstant) {
  const TempFolder folder;
  Recording recording = Chatter(10);
  for (RecordedMessage& message : recording) message.time_ns = kT0;
  const auto bag = McapFile::Open(folder.Write("log.mcap", WriteMcap(recording)));
  ASSERT_TRUE(bag.ok()) << bag.status();
  for (size_t i = 0; i < recording.size(); ++i) {
    EXPECT_EQ((*bag)->Read((*bag)->messages()[i])->data.bytes, recording[i].data);
  }
}

TEST(McapFile, RefusesEachCut) {
  const TempFolder folder;
  for (const char* const compression : {"plain", "zstd"}) {
    const std::string whole = WriteMcap(Chatter(5), {.compression = compression});
    for (size_t size = 0; size < whole.size(); ++size) {
      const absl::Status status = ReadEverything(folder.Write("log.mcap", whole.substr(0, size)));
      ExpectMalformedFile(status, {"log.mcap: byte"});
      if (size > 100) ExpectMalformedFile(status, {"mcap recover"});
    }
  }
}

TEST(McapFile, SurvivesChangedBytesAndChecksumsFindThem) {
  const TempFolder folder;
  std::mt19937 random(20231017);
  for (const char* const compression : {"", "lz4", "zstd", "plain"}) {
    for (const bool has_checksums : {false, true}) {
      const std::string whole =
          WriteMcap(Chatter(20), {.compression = compression, .has_checksums = has_checksums});
      for (int i = 0; i < 300; ++i) {
        std::string changed = whole;
        const size_t at = 8 + random() % (changed.size() - 16);
        changed[at] = static_cast<char>(changed[at] ^ 1 << random() % 8);
        const absl::Status status = ReadEverything(folder.Write("log.mcap", changed));
        EXPECT_TRUE(status.ok() || ReasonOf(status) == Reason::kFileMalformed) << status;
        if (has_checksums) {
          EXPECT_FALSE(status.ok()) << at << " of " << changed.size();
        }
      }
    }
  }
}

TEST(McapFile, StopsABombAtTheSizeThatItDeclares) {
  const TempFolder folder;
  Recording recording = Chatter(1);
  recording[0].data = std::string(size_t{8} << 20, '\0');
  for (const char* const compression : {"lz4", "zstd"}) {
    for (const uint64_t declared : {uint64_t{1000}, uint64_t{1} << 30, UINT64_MAX}) {
      const std::string bomb =
          WriteMcap(recording, {.compression = compression, .declared_size = declared});
      EXPECT_LT(bomb.size(), 100'000u);
      ExpectMalformedFile(ReadEverything(folder.Write("log.mcap", bomb)), {"log.mcap: byte"});
    }
  }
}

TEST(McapFile, NamesWhatIsWrong) {
  const TempFolder folder;
  const std::string whole = WriteMcap(Chatter(5), {.compression = "", .has_checksums = false});
  const auto expect = [&](const std::string& bytes, const std::vector<std::string>& parts) {
    ExpectMalformedFile(ReadEverything(folder.Write("log.mcap", bytes)), parts);
  };
  expect(WriteMcap(Chatter(5), {.compression = "brotli"}), {"brotli", "zstd are known"});
  const std::string count = ByteWriter().U8(0x0b).U64(42).U64(5).bytes();
  expect(Changed(whole, count, ByteWriter().U8(0x0b).U64(42).U64(6).bytes()), {"count 6", "has 5"});
  // The first message is of a channel that nobody defined.
  const std::string plain =
      WriteMcap(Chatter(5), {.compression = "plain", .has_summary = false, .has_checksums = false});
  const std::string first = ByteWriter().U8(1).U8(0).U32(0).U64(kT0).bytes();
  expect(Changed(plain, first, ByteWriter().U8(9).U8(0).U32(0).U64(kT0).bytes()),
         {"channel 9", "not defined"});
  // And in a chunk its index disagrees.
  expect(Changed(whole, first, ByteWriter().U8(9).U8(0).U32(0).U64(kT0).bytes()),
         {"the index says", "channel 1", "mcap recover"});
}

}  // namespace
}  // namespace dsg::ingest
