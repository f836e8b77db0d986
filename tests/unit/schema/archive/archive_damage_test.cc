// SPDX-License-Identifier: Apache-2.0
// Archives that were cut, altered or made to harm: each is refused, and nothing comes of it.
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/archive_map.h"
#include "schema/archive/restore.h"
#include "schema/base/random.h"
#include "schema/codec/checksum.h"
#include "tests/unit/schema/archive/archive_test_util.h"

namespace dsg::test {
namespace {

constexpr int kTries = 500;

class DamagedArchiveTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto map = MakeArchivedMap(25);
    bytes_ = new std::string(OrDie(ArchiveBytes(&map->reader(), map->folder())));
  }
  static void TearDownTestSuite() { delete bytes_; }

  // What reading says of other bytes.
  absl::Status Read(const std::string& bytes) {
    WriteBytes(path(), bytes);
    return ReadArchiveFile(path(), nullptr, nullptr, nullptr).status();
  }

  static bool IsRefusal(const absl::Status& status) {
    const Reason reason = ReasonOf(status);
    return reason == Reason::kStoreCorrupt || reason == Reason::kFileMalformed;
  }

  std::string path() const { return folder_.path() + "/map.dsgz"; }

  static std::string* bytes_;
  TempFolder folder_;
};

std::string* DamagedArchiveTest::bytes_ = nullptr;

TEST_F(DamagedArchiveTest, AWholeOneIsTaken) { EXPECT_TRUE(Read(*bytes_).ok()); }

TEST_F(DamagedArchiveTest, CutAnywhereIsRefused) {
  Random random(TestSeed(11), 0);
  for (int i = 0; i < kTries; ++i) {
    const auto size = static_cast<size_t>(random.Index(static_cast<int>(bytes_->size())));
    const absl::Status status = Read(bytes_->substr(0, size));
    EXPECT_TRUE(IsRefusal(status)) << "cut at " << size << ": " << status;
  }
  for (size_t size = bytes_->size() - 60; size < bytes_->size(); ++size) {
    EXPECT_TRUE(IsRefusal(Read(bytes_->substr(0, size)))) << "cut at " << size;
  }
}

TEST_F(DamagedArchiveTest, AlteredAtAnyByteIsRefused) {
  Random random(TestSeed(12), 0);
  for (int i = 0; i < kTries; ++i) {
    std::string bytes = *bytes_;
    const auto at = static_cast<size_t>(random.Index(static_cast<int>(bytes.size())));
    bytes[at] = static_cast<char>(bytes[at] ^ random.Integer(1, 255));
    const absl::Status status = Read(bytes);
    EXPECT_TRUE(IsRefusal(status)) << "altered at " << at << ": " << status;
  }
}

TEST_F(DamagedArchiveTest, EachBitOfHeaderManifestAndEndCounts) {
  const size_t head = kArchiveHeaderBytes + OrDie(ManifestBytes("", *bytes_));
  for (size_t at = 0; at < bytes_->size(); ++at) {
    if (at == head + kArchiveFrameHeadBytes) at = bytes_->size() - kArchiveEndBytes;
    std::string bytes = *bytes_;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (at % 8)));
    EXPECT_TRUE(IsRefusal(Read(bytes))) << "altered at " << at;
  }
}

TEST_F(DamagedArchiveTest, WithMoreBytesBehindItIsRefused) {
  EXPECT_TRUE(IsRefusal(Read(*bytes_ + '\0')));
  EXPECT_TRUE(IsRefusal(Read(*bytes_ + *bytes_)));
}

TEST_F(DamagedArchiveTest, WithPartsExchangedIsRefused) {
  // Frames of the same size, each intact.
  std::string frames[2];
  AppendFrame(0, std::string(kArchiveFrameBytes, 'a'), &frames[0]);
  AppendFrame(1, std::string(kArchiveFrameBytes, 'b'), &frames[1]);
  ArchiveManifest manifest;
  manifest.spec.name = "office";
  manifest.database_bytes = 2 * static_cast<int64_t>(kArchiveFrameBytes);
  const std::string head = EncodeArchiveHead(manifest);
  for (const bool exchanged : {false, true}) {
    const std::string body = head + frames[exchanged ? 1 : 0] + frames[exchanged ? 0 : 1];
    std::string end = EncodeArchiveEnd(2, Sha256());
    end.resize(end.size() - Sha256().size());
    const absl::Status status = Read(body + EncodeArchiveEnd(2, ComputeSha256(body + end)));
    EXPECT_EQ(status.ok(), !exchanged) << status;
  }
}

// An archive of these bytes with a manifest of somebody else's making, all checksums right.
std::string Forge(ArchiveManifest manifest, const std::string& database) {
  std::string all = EncodeArchiveHead(manifest);
  const int64_t count = FrameCount(static_cast<int64_t>(database.size()));
  for (int64_t i = 0; i < count; ++i) {
    AppendFrame(i, database.substr(static_cast<size_t>(i) * kArchiveFrameBytes, kArchiveFrameBytes),
                &all);
  }
  std::string end = EncodeArchiveEnd(count, Sha256());
  end.resize(end.size() - Sha256().size());
  return all + EncodeArchiveEnd(count, ComputeSha256(all + end));
}

TEST_F(DamagedArchiveTest, ThatDeclaresMoreThanItHoldsTakesNoMemory) {
  ArchiveManifest manifest;
  manifest.spec.name = "office";
  manifest.database_bytes = int64_t{1} << 50;
  EXPECT_TRUE(IsRefusal(Read(Forge(manifest, "x"))));
  manifest.database_bytes = -1;
  EXPECT_TRUE(IsRefusal(Read(Forge(manifest, "x"))));
}

TEST_F(DamagedArchiveTest, OfANewerFormatOrWithABadNameIsRefused) {
  ArchiveManifest manifest;
  manifest.spec.name = "office";
  manifest.database_bytes = 1;
  manifest.store_format = kStoreFormatVersion + 1;
  EXPECT_EQ(ReasonOf(Read(Forge(manifest, "x"))), Reason::kFormatTooNew);
  manifest.store_format = kStoreFormatVersion;
  manifest.spec.name = "../office";
  EXPECT_EQ(ReasonOf(Read(Forge(manifest, "x"))), Reason::kMapNameInvalid);
}

TEST_F(DamagedArchiveTest, WhoseDatabaseIsNoneOrAnotherIsNotInstalled) {
  WriteBytes(path(), *bytes_);
  std::string database;
  ArchiveManifest manifest = OrDie(ReadArchiveFile(
      path(),
      [&](std::string_view bytes) {
        database += bytes;
        return absl::OkStatus();
      },
      nullptr, nullptr));
  const auto store = OrDie(GraphStore::Open(folder_.path() + "/store", {.create = true}));
  const auto restore = [&](const ArchiveManifest& forged, const std::string& forged_database) {
    WriteBytes(path(), Forge(forged, forged_database));
    return RestoreArchive(path(), store.get(), {}, nullptr, nullptr).status();
  };
  std::string flipped = database;
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 4);
  EXPECT_EQ(ReasonOf(restore(manifest, flipped)), Reason::kStoreCorrupt);
  EXPECT_FALSE(restore(manifest, std::string(database.size(), 'x')).ok());
  ArchiveManifest lying = manifest;
  lying.newest_digest[0] ^= 1;
  EXPECT_EQ(ReasonOf(restore(lying, database)), Reason::kStoreCorrupt);
  lying = manifest;
  lying.spec.name = "kitchen";
  EXPECT_FALSE(restore(lying, database).ok());
  EXPECT_EQ(NamesOf(store->folder()), "");
  EXPECT_TRUE(restore(manifest, database).ok());
}

}  // namespace
}  // namespace dsg::test
