// SPDX-License-Identifier: Apache-2.0
// What stands at the end of an MCAP file that is still written and is no record, or none yet.
#include "ingest/log/growing_bag.h"

#include <fstream>
#include <random>
#include <thread>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/follow_test_util.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

using std::chrono::milliseconds;

// Where the data end, behind which come summary and footer.
size_t EndOfData(const std::string& mcap) {
  const size_t at = mcap.rfind(std::string("\x0f\x04\0\0\0\0\0\0\0", 9));
  EXPECT_NE(at, std::string::npos);
  return at;
}

void Overwrite(const std::string& path, size_t at, std::string_view bytes) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(at));
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

TEST(GrowingBag, IsReadInSpaceThatIsSetAside) {
  const TempFolder folder;
  for (const std::string compression : {"zstd", "plain"}) {
    SCOPED_TRACE(compression);
    const std::string bytes =
        WriteMcap(TenSeconds(), {.compression = compression, .messages_per_chunk = 37});
    const auto whole = ReadAll(folder.Write("whole.mcap", bytes));
    ASSERT_TRUE(whole.ok()) << whole.status();
    // The head is there; the rest is written over zeros, in pieces that cut records anywhere.
    const size_t head = 100;
    const std::string path = folder.Write(
        "log.mcap", bytes.substr(0, head) + std::string(bytes.size() - head + 10'000, '\0'));
    std::thread writer([&] {
      constexpr unsigned kSeed = 3;
      std::mt19937 random(kSeed);
      for (size_t at = head; at < bytes.size();) {
        const size_t size = 1 + random() % 4000;
        Overwrite(path, at, std::string_view(bytes).substr(at, size));
        at += size;
        std::this_thread::sleep_for(milliseconds(3));
      }
    });
    const auto followed = ReadAllWithEnd(path, Following(milliseconds(60'000)));
    writer.join();
    ASSERT_TRUE(followed.ok()) << followed.status();
    EXPECT_EQ(followed->order, whole->order);
    EXPECT_FALSE(HasNote(followed->info, "no whole record")) << "it has its own end";
  }
}

TEST(GrowingBag, SaysOnceThatItWaitsForWhatIsNoRecord) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(TenSeconds());
  const std::string data = bytes.substr(0, EndOfData(bytes));
  std::vector<std::string> told;
  const auto read = [&](const std::string& rest) {
    told.clear();
    LogOptions options = Following(kTellAfter + milliseconds(500));
    options.follow->tell = [&told](const std::string& sentence) { told.push_back(sentence); };
    return ReadAllWithEnd(folder.Write("log.mcap", data + rest), options);
  };
  // The last chunk may be written in part: it counts when something comes behind it.
  const auto zeros = read(std::string(5000, '\0'));
  ASSERT_TRUE(zeros.ok()) << zeros.status();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("are no whole record (zeros"), std::string::npos) << told[0];
  EXPECT_NE(told[0].find("waiting"), std::string::npos) << told[0];
  EXPECT_TRUE(HasNote(zeros->info, "are no whole record (zeros"));
  EXPECT_TRUE(HasNote(zeros->info, "were not read"));
  // A record that claims more than was written.
  const auto half = read(std::string("\x05\x00\x10\0\0\0\0\0\0 and so on", 19));
  ASSERT_TRUE(half.ok()) << half.status();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0], absl::StrCat("the 19 bytes from byte ", data.size(),
                                  " on are no whole record; waiting for what is to stand there"));
  EXPECT_TRUE(HasNote(half->info, absl::StrCat("the 19 bytes from byte ", data.size(),
                                               " on are no whole record and were not read")));
  EXPECT_GE(half->poses.size(), zeros->poses.size());
  // Nothing is said of a file that ends with a record.
  const auto clean = read("");
  ASSERT_TRUE(clean.ok()) << clean.status();
  EXPECT_TRUE(told.empty());
  EXPECT_FALSE(HasNote(clean->info, "no whole record"));
  EXPECT_EQ(clean->poses.size(), 200u);
}

TEST(GrowingBag, SaysWhatStandsInTheWayOfItsBegin) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(TenSeconds());
  ExpectMalformedFile(
      ReadAll(folder.Write("log.mcap", bytes.substr(0, 100) + std::string(5000, '\0')),
              Following(milliseconds(20)))
          .status(),
      {"within the first 3 s", "are no whole record (zeros"});
}

TEST(GrowingBag, TakesNoRecordBeforeAZero) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(TenSeconds(), {.compression = "plain"});
  const std::string path = folder.Write("log.mcap", bytes);
  const auto bag = McapFile::OpenGrowing(path);
  ASSERT_TRUE(bag.ok()) << bag.status();
  const size_t half = bytes.size() / 2;
  ASSERT_TRUE((*bag)->GrowTo(half).ok());
  EXPECT_FALSE((*bag)->zero_at().has_value());
  const uint64_t taken = (*bag)->taken_size();
  const size_t count = (*bag)->messages().size();
  EXPECT_LE(taken, half);
  // From the middle of the record behind it on, all is zeros.
  Overwrite(path, taken + 20, std::string(bytes.size() - taken - 20, '\0'));
  ASSERT_TRUE((*bag)->GrowTo(bytes.size()).ok());
  EXPECT_EQ((*bag)->messages().size(), count);
  EXPECT_EQ((*bag)->taken_size(), taken);
  ASSERT_TRUE((*bag)->zero_at().has_value());
  EXPECT_GT(*(*bag)->zero_at(), taken);
  Overwrite(path, taken, std::string_view(bytes).substr(taken));
  ASSERT_TRUE((*bag)->GrowTo(bytes.size()).ok());
  EXPECT_TRUE((*bag)->is_closed());
  EXPECT_EQ((*bag)->messages().size(), TenSeconds().size());
}

}  // namespace
}  // namespace dsg::ingest
