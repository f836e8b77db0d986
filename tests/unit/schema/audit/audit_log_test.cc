// SPDX-License-Identifier: Apache-2.0
// An audit log goes on after crashes, and tells of every line that is not what was written.
#include "schema/audit/audit_log.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

constexpr char kKey[] = "thirty-two bytes that nobody knows";

class AuditLogTest : public testing::Test {
 protected:
  void Add(int count, const std::string& key = kKey) {
    auto log = AuditLog::Open(path_, key);
    ASSERT_TRUE(log.ok()) << log.status();
    for (int i = 0; i < count; ++i) {
      AuditEntry entry;
      entry.time_ns = 1'700'000'000 * kNsPerSecond + i;
      entry.caller = "robot-7";
      entry.peer = "ipv4:10.0.0.7:4411";
      entry.method = "Commit";
      entry.map = i % 3 == 0 ? "hall \"x\"\n\xff" : "hall";
      entry.code = "OK";
      entry.revision = i;
      ASSERT_TRUE((*log)->Append(entry, i % 2 == 0).ok());
    }
  }
  std::string Read() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  void Write(const std::string& bytes) const {
    // File systems put on disk at once what is written over something.
    std::filesystem::remove(path_);
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  bool IsRight(const std::string& key = kKey) const { return VerifyAuditLog(path_, key).ok(); }

  test::TempFolder folder_;
  const std::string path_ = folder_.path() + "/audit.jsonl";
};

TEST_F(AuditLogTest, TellsWhatWasAddedAlsoAcrossRuns) {
  Add(3);
  Add(4);
  std::vector<AuditEntry> entries;
  const auto head =
      VerifyAuditLog(path_, kKey, [&](const AuditEntry& entry) { entries.push_back(entry); });
  ASSERT_TRUE(head.ok()) << head.status();
  EXPECT_EQ(head->entry_count, 7);
  EXPECT_FALSE(head->has_torn_end);
  ASSERT_EQ(entries.size(), 7u);
  EXPECT_EQ(entries[4].number, 5);
  EXPECT_EQ(entries[4].caller, "robot-7");
  EXPECT_EQ(entries[4].method, "Commit");
  EXPECT_EQ(entries[4].map, "hall");
  EXPECT_EQ(entries[4].revision, 1);
  EXPECT_EQ(entries.back().chain, head->chain);
  // Bytes that are no text stay in one line.
  const std::string bytes = Read();
  EXPECT_EQ(std::count(bytes.begin(), bytes.end(), '\n'), 7);
  struct stat found {};
  ASSERT_EQ(stat(path_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600u);
}

// Whoever can write the file but has not the key.
TEST_F(AuditLogTest, FindsEveryChange) {
  Add(40);
  const std::string right = Read();
  std::vector<std::string> lines = absl::StrSplit(right, '\n');
  lines.pop_back();
  Random random(1, 0);
  int found_count = 0;
  int count = 0;
  const auto expect_found = [&](const std::string& bytes, const std::string& what) {
    if (bytes == right) return;
    Write(bytes);
    ++count;
    const absl::Status status = VerifyAuditLog(path_, kKey).status();
    EXPECT_EQ(ReasonOf(status), Reason::kStoreCorrupt) << what << ": " << status;
    if (!status.ok()) ++found_count;
  };
  for (int i = 0; i < 300; ++i) {
    // All but the last newline, without which the last line is one that was torn off.
    std::string bytes = right;
    const size_t at =
        static_cast<size_t>(random.Uniform(0.0, static_cast<double>(right.size() - 1)));
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (i % 7)));
    expect_found(bytes, absl::StrCat("byte ", at));
  }
  for (size_t i = 0; i + 1 < lines.size(); ++i) {
    std::vector<std::string> without = lines;
    without.erase(without.begin() + static_cast<ptrdiff_t>(i));
    expect_found(absl::StrJoin(without, "\n") + "\n", "taken out");
    std::vector<std::string> twice = lines;
    twice.insert(twice.begin() + static_cast<ptrdiff_t>(i), lines[i]);
    expect_found(absl::StrJoin(twice, "\n") + "\n", "twice");
    std::vector<std::string> swapped = lines;
    std::swap(swapped[i], swapped[i + 1]);
    expect_found(absl::StrJoin(swapped, "\n") + "\n", "swapped");
    std::vector<std::string> blank = lines;
    blank[i].clear();
    expect_found(absl::StrJoin(blank, "\n") + "\n", "emptied");
    std::vector<std::string> other = lines;
    const size_t name = other[i].find("robot-7");
    other[i].replace(name, 7, "robot-8");
    expect_found(absl::StrJoin(other, "\n") + "\n", "another caller");
  }
  std::cout << "tampers: " << found_count << " of " << count << " found\n";
  EXPECT_GE(count, 450);
  EXPECT_EQ(found_count, count);
  Write(right);
  EXPECT_TRUE(IsRight());
  // With another key, or none, nothing fits.
  EXPECT_FALSE(IsRight("another key that is long enough"));
  EXPECT_FALSE(IsRight(""));
}

TEST_F(AuditLogTest, WhatIsCutOffAtTheEndShowsByANotedChain) {
  Add(5);
  std::string noted;
  ASSERT_TRUE(
      VerifyAuditLog(path_, kKey, [&](const AuditEntry& entry) { noted = entry.chain; }).ok());
  const std::string right = Read();
  Write(right.substr(0, right.rfind('\n', right.size() - 2) + 1));
  bool has_noted = false;
  const auto head = VerifyAuditLog(
      path_, kKey, [&](const AuditEntry& entry) { has_noted = has_noted || entry.chain == noted; });
  ASSERT_TRUE(head.ok());
  EXPECT_EQ(head->entry_count, 4);
  EXPECT_FALSE(has_noted);
}

TEST_F(AuditLogTest, AnEndThatACrashToreOffIsCutAndTold) {
  Add(5);
  const std::string right = Read();
  for (const size_t cut : {size_t{1}, size_t{20}, size_t{100}}) {
    Write(right.substr(0, right.size() - cut));
    const auto head = VerifyAuditLog(path_, kKey);
    ASSERT_TRUE(head.ok()) << head.status();
    EXPECT_EQ(head->entry_count, 4);
    EXPECT_TRUE(head->has_torn_end);
    Add(1);
    const auto after = VerifyAuditLog(path_, kKey);
    ASSERT_TRUE(after.ok()) << after.status();
    EXPECT_EQ(after->entry_count, 5);
    EXPECT_FALSE(after->has_torn_end);
  }
}

TEST_F(AuditLogTest, NothingIsAddedToALogThatIsNotRightOrIsAnothers) {
  Add(5);
  const auto held = AuditLog::Open(path_, kKey);
  ASSERT_TRUE(held.ok());
  EXPECT_EQ(ReasonOf(AuditLog::Open(path_, kKey).status()), Reason::kWriterLocked);
  const std::string other = folder_.path() + "/other.jsonl";
  std::filesystem::copy_file(path_, other);
  EXPECT_EQ(ReasonOf(AuditLog::Open(other, "another key that is long enough").status()),
            Reason::kStoreCorrupt);
  EXPECT_FALSE(AuditLog::Open(folder_.path() + "/none/audit.jsonl", kKey).ok());
}

TEST_F(AuditLogTest, AFileOfSomethingElseStaysAsItIs) {
  for (const char* text : {"one line without its end", "lines\nof text\n", "{\"number\":2,"}) {
    Write(text);
    EXPECT_FALSE(AuditLog::Open(path_, kKey).ok()) << text;
    EXPECT_EQ(Read(), text);
  }
  std::filesystem::remove(path_);
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  const absl::Status status = AuditLog::Open(path_, kKey).status();
  EXPECT_NE(status.message().find("no plain file"), std::string::npos) << status;
}

TEST_F(AuditLogTest, KeysArePrivateAndLongEnough) {
  const std::string path = folder_.path() + "/key";
  std::ofstream(path) << kKey;
  chmod(path.c_str(), 0600);
  EXPECT_EQ(*ReadAuditKey(path), kKey);
  chmod(path.c_str(), 0640);
  EXPECT_NE(ReadAuditKey(path).status().message().find("chmod 600"), std::string::npos);
  std::ofstream(path) << "short";
  chmod(path.c_str(), 0600);
  EXPECT_NE(ReadAuditKey(path).status().message().find("5 bytes"), std::string::npos);
  EXPECT_EQ(*ReadAuditKey(""), "");
}

}  // namespace
}  // namespace dsg
