// SPDX-License-Identifier: Apache-2.0
// Archives that were cut, altered or made to harm: each is refused, and nothing comes of it.
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/archive_map.h"
#include "schema/archive/restore.h"
#include "schema/base/random.h"
#include "schema/codec/checksum.h"
#include "schema/store/sqlite/database.h"
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
    return reason == Reason::kStoreCorrupt || reason == Reason::kFileMalformed ||
           reason == Reason::kFormatTooNew;
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

TEST_F(DamagedArchiveTest, OfANewerVersionSaysWhichAndWhatIsKnown) {
  std::string bytes = *bytes_;
  bytes[8] = static_cast<char>(kArchiveVersion + 1);
  const absl::Status newer = Read(bytes);
  EXPECT_EQ(ReasonOf(newer), Reason::kFormatTooNew);
  EXPECT_TRUE(absl::StrContains(newer.message(), "version 3")) << newer;
  EXPECT_TRUE(absl::StrContains(newer.message(), "reads up to 2")) << newer;
  bytes[8] = 0;
  EXPECT_EQ(ReasonOf(Read(bytes)), Reason::kFileMalformed);
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

class ForgedArchiveTest : public DamagedArchiveTest {
 protected:
  ForgedArchiveTest() {
    WriteBytes(path(), *bytes_);
    manifest_ = OrDie(ReadArchiveFile(
        path(),
        [&](std::string_view bytes) {
          database_ += bytes;
          return absl::OkStatus();
        },
        nullptr, nullptr));
  }

  ArchiveManifest manifest_;
  std::string database_;
};

TEST_F(ForgedArchiveTest, WhoseManifestSaysOtherThanItsMapIsRefusedByName) {
  const auto refusal = [&](auto forge) {
    ArchiveManifest forged = manifest_;
    forge(&forged);
    WriteBytes(path(), Forge(forged, database_));
    return VerifyArchive(path(), nullptr, nullptr).status();
  };
  const auto expect_named = [&](const std::string& field, const absl::Status& status) {
    EXPECT_TRUE(absl::IsDataLoss(status)) << field << ": " << status;
    EXPECT_TRUE(absl::StrContains(status.message(), absl::StrCat("says ", field))) << status;
    EXPECT_NE(MetadataOf(status)["expected"], MetadataOf(status)["found"]);
  };
  using Manifest = ArchiveManifest;
  expect_named("frame", refusal([](Manifest* m) { m->spec.frame = "attic"; }));
  expect_named("epoch_ns", refusal([](Manifest* m) { m->spec.epoch_ns += 1; }));
  expect_named("clock", refusal([](Manifest* m) {
                 m->spec.clock = m->spec.clock == Clock::kUnix ? Clock::kMonotonic : Clock::kUnix;
               }));
  expect_named("codec", refusal([](Manifest* m) {
                 m->spec.codec = m->spec.codec == TrajectoryCodec::kLossless
                                     ? TrajectoryCodec::kQuantized
                                     : TrajectoryCodec::kLossless;
               }));
  expect_named("gap_ns_max", refusal([](Manifest* m) { m->spec.gap_ns_max += 1; }));
  expect_named("mesh_block_size_m",
               refusal([](Manifest* m) { m->spec.mesh_block_size_m += 1e-12; }));
  expect_named("store_format", refusal([](Manifest* m) { m->store_format -= 1; }));
  expect_named("newest_revision", refusal([](Manifest* m) { m->newest_revision += 1; }));
  expect_named("newest_digest", refusal([](Manifest* m) { m->newest_digest[5] ^= 1; }));
  expect_named("oldest_revision", refusal([](Manifest* m) { m->oldest_revision += 1; }));
  expect_named("state", refusal([](Manifest* m) { m->state[5] ^= 1; }));
  EXPECT_TRUE(refusal([](Manifest*) {}).ok());
}

TEST_F(ForgedArchiveTest, WhoseDatabaseHasTriggersOrViewsFailsVerifyAndRestore) {
  const auto store = OrDie(GraphStore::Open(folder_.path() + "/store", {.create = true}));
  for (const char* foreign : {"CREATE VIEW spy AS SELECT 1",
                              "CREATE TRIGGER spy AFTER INSERT ON node BEGIN SELECT 1; END"}) {
    const std::string file = folder_.path() + "/forged.db";
    WriteBytes(file, database_);
    OrDie(
        OrDie(sqlite::Database::Open(file, sqlite::Database::Mode::kWrite, "m"))->Execute(foreign));
    ArchiveManifest forged = manifest_;
    forged.database_bytes = static_cast<int64_t>(ReadBytes(file).size());
    WriteBytes(path(), Forge(forged, ReadBytes(file)));
    const auto report = VerifyArchive(path(), nullptr, nullptr);
    ASSERT_TRUE(report.ok()) << report.status();
    ASSERT_EQ(report->problems.size(), 1U) << foreign;
    EXPECT_TRUE(absl::StrContains(report->problems.front(), "\"spy\""));
    const absl::Status refused = RestoreArchive(path(), store.get(), {}, nullptr, nullptr).status();
    EXPECT_EQ(ReasonOf(refused), Reason::kNotAStore) << refused;
    EXPECT_TRUE(absl::StrContains(refused.message(), path())) << refused;
  }
}

TEST_F(ForgedArchiveTest, WhoseDatabaseIsNoneOrAnotherIsNotInstalled) {
  const std::string& database = database_;
  const ArchiveManifest& manifest = manifest_;
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
