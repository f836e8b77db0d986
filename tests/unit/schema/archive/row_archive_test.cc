// SPDX-License-Identifier: Apache-2.0
// Archives of rows: out of one backend and into the other with the same bytes, and refused where
// anything of them is another.
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/archive_map.h"
#include "schema/archive/restore.h"
#include "schema/archive/row_file.h"
#include "schema/base/random.h"
#include "schema/codec/checksum.h"
#include "tests/unit/schema/archive/archive_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

// An archive of these rows with a manifest of somebody else's making, all checksums right.
std::string ForgeRows(ArchiveManifest manifest, const std::string& rows) {
  manifest.database_bytes = static_cast<int64_t>(rows.size());
  std::string all = EncodeArchiveHead(manifest);
  const int64_t count = FrameCount(manifest.database_bytes);
  for (int64_t i = 0; i < count; ++i) {
    AppendFrame(i, rows.substr(static_cast<size_t>(i) * kArchiveFrameBytes, kArchiveFrameBytes),
                &all);
  }
  std::string end = EncodeArchiveEnd(count, Sha256());
  end.resize(end.size() - Sha256().size());
  return all + EncodeArchiveEnd(count, ComputeSha256(all + end));
}

class RowArchive : public OnEveryBackend {
 protected:
  void SetUp() override {
    bytes_ = OrDie(RowArchiveBytes(&map_->reader(), folder_.path()));
    WriteBytes(path(), bytes_);
    store_ = OrDie(OpenStore(UriOf(GetParam(), folder_.path() + "/store"), {.create = true}));
  }

  absl::Status Restore(const RestoreOptions& options = {}, const StopCheck& stop = nullptr) {
    return RestoreArchive(path(), store_.get(), options, stop, nullptr).status();
  }
  absl::Status RestoreBytes(const std::string& bytes) {
    WriteBytes(path(), bytes);
    return Restore();
  }
  std::string path() const { return folder_.path() + "/map.dsgz"; }
  void ExpectNoMap() {
    EXPECT_EQ(OrDie(store_->MapNames()), std::vector<std::string>());
    if (!store_->folder().empty()) {
      EXPECT_EQ(NamesOf(store_->folder()), "");
    }
  }

  const std::unique_ptr<TestMap> map_ = MakeArchivedMap(30);
  TempFolder folder_;
  std::string bytes_;
  std::unique_ptr<GraphStore> store_;
};
DSG_ON_EVERY_BACKEND(RowArchive);

TEST_P(RowArchive, GoesIntoAnyBackendAndComesBackWithTheSameBytes) {
  ASSERT_TRUE(Restore().ok()) << Restore();
  const auto restored = OrDie(store_->OpenMap(kMap));
  for (Revision r = 0; r <= 30; r += 5) {
    EXPECT_TRUE(OrDie(Dump(*OrDie(restored->At(r)))) == OrDie(Dump(*map_->At(r)))) << r;
  }
  EXPECT_EQ(OrDie(restored->Tags()).size(), 2U);
  EXPECT_TRUE(OrDie(RowArchiveBytes(restored.get(), folder_.path())) == bytes_);
  if (!store_->folder().empty()) {
    EXPECT_EQ(NamesOf(store_->folder()), kMap);
  }
  EXPECT_FALSE(absl::StrContains(NamesOf(folder_.path()), ".archive"));
}

TEST_P(RowArchive, MayBeNamedAnewAndReplace) {
  ASSERT_TRUE(Restore({.name = "copy"}).ok());
  EXPECT_EQ(OrDie(store_->OpenMap("copy"))->spec().name, "copy");
  const auto old = OrDie(store_->OpenMap("copy"));
  EXPECT_EQ(ReasonOf(Restore({.name = "copy"})), Reason::kMapExists);
  EXPECT_TRUE(old->IsCurrent());
  ASSERT_TRUE(Restore({.name = "copy", .replace = true}).ok());
  EXPECT_FALSE(old->IsCurrent());
}

TEST_P(RowArchive, StoppedAnywhereLeavesNothing) {
  int question_count = 0;
  const auto count = [&] {
    ++question_count;
    return absl::OkStatus();
  };
  ASSERT_TRUE(Restore({.name = "whole"}, count).ok());
  ASSERT_GT(question_count, 100);
  store_ = OrDie(OpenStore(UriOf(GetParam(), folder_.path() + "/other"), {.create = true}));
  Random random(TestSeed(21), 0);
  for (int i = 0; i < 10; ++i) {
    const int last = random.Index(question_count);
    int asked = 0;
    const auto stop = [&] {
      return asked++ < last ? absl::OkStatus() : absl::CancelledError("enough");
    };
    const absl::Status status = Restore({}, stop);
    EXPECT_TRUE(absl::IsCancelled(status)) << last << ": " << status;
    ExpectNoMap();
  }
}

TEST_P(RowArchive, CutOrAlteredAnywhereIsRefused) {
  Random random(TestSeed(22), 0);
  for (int i = 0; i < 60; ++i) {
    const auto at = static_cast<size_t>(random.Index(static_cast<int>(bytes_.size())));
    std::string altered = bytes_;
    altered[at] = static_cast<char>(altered[at] ^ random.Integer(1, 255));
    for (const std::string& bytes : {bytes_.substr(0, at), altered}) {
      const absl::Status status = RestoreBytes(bytes);
      const Reason reason = ReasonOf(status);
      EXPECT_TRUE(reason == Reason::kStoreCorrupt || reason == Reason::kFileMalformed ||
                  reason == Reason::kFormatTooNew)
          << "at " << at << ": " << status;
    }
  }
  ExpectNoMap();
}

// All checksums of the archive are right, and its rows are not.
TEST_P(RowArchive, WhoseRowsWereMadeUpIsRefused) {
  std::string rows;
  const ArchiveManifest manifest = OrDie(ReadArchiveFile(
      path(),
      [&](std::string_view bytes) {
        rows += bytes;
        return absl::OkStatus();
      },
      nullptr, nullptr));
  EXPECT_TRUE(ForgeRows(manifest, rows) == bytes_);
  Random random(TestSeed(23), 0);
  for (int i = 0; i < 20; ++i) {
    const auto at = static_cast<size_t>(random.Index(static_cast<int>(rows.size())));
    std::string altered = rows;
    altered[at] = static_cast<char>(altered[at] ^ random.Integer(1, 255));
    // Times of commits, notes and the like count in no digest; what is taken is a sound map.
    if (RestoreBytes(ForgeRows(manifest, altered)).ok()) {
      ASSERT_TRUE(OrDie(OrDie(store_->OpenMap(kMap))->Verify({}, {})).problems.empty()) << at;
      store_ = OrDie(
          OpenStore(UriOf(GetParam(), absl::StrCat(folder_.path(), "/", i)), {.create = true}));
    }
    EXPECT_FALSE(RestoreBytes(ForgeRows(manifest, rows.substr(0, at))).ok()) << at;
  }
  // A length that nobody has memory for.
  EXPECT_FALSE(
      RestoreBytes(ForgeRows(manifest, "L\x02\x02\x02\xff\xff\xff\xff\xff\xff\xff\x7f")).ok());
  EXPECT_FALSE(RestoreBytes(ForgeRows(manifest, std::string(1000, 'O'))).ok());
  ExpectNoMap();
}

TEST_P(RowArchive, WhoseManifestSaysOtherThanItsRowsIsRefusedByName) {
  std::string rows;
  const ArchiveManifest manifest = OrDie(ReadArchiveFile(
      path(),
      [&](std::string_view bytes) {
        rows += bytes;
        return absl::OkStatus();
      },
      nullptr, nullptr));
  const auto expect_named = [&](const std::string& field, auto forge) {
    ArchiveManifest forged = manifest;
    forge(&forged);
    const absl::Status status = RestoreBytes(ForgeRows(forged, rows));
    EXPECT_TRUE(absl::IsDataLoss(status)) << field << ": " << status;
    EXPECT_TRUE(absl::StrContains(status.message(), absl::StrCat("says ", field))) << status;
  };
  expect_named("newest_revision", [](ArchiveManifest* m) { ++m->newest_revision; });
  expect_named("newest_digest", [](ArchiveManifest* m) { m->newest_digest[5] ^= 1; });
  expect_named("oldest_revision", [](ArchiveManifest* m) { ++m->oldest_revision; });
  expect_named("state", [](ArchiveManifest* m) { m->spec.frame = "attic"; });
  ExpectNoMap();
  ArchiveManifest older = manifest;
  older.store_format = 1;
  EXPECT_TRUE(RestoreBytes(ForgeRows(older, rows)).ok());
  ArchiveManifest newer = manifest;
  newer.store_format = kStoreFormatVersion + 1;
  EXPECT_EQ(ReasonOf(RestoreBytes(ForgeRows(newer, rows))), Reason::kFormatTooNew);
  ArchiveManifest database = manifest;
  database.content = ArchiveContent::kDatabase;
  EXPECT_FALSE(RestoreBytes(ForgeRows(database, rows)).ok());
}

TEST_P(RowArchive, IsVerifiedWithoutAStore) {
  const auto report = VerifyArchive(path(), nullptr, nullptr);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->revision_count, 30);
  EXPECT_TRUE(report->problems.empty());
}

}  // namespace
}  // namespace dsg::test
