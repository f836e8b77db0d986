// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "schema/archive/backup_folder.h"
#include "schema/codec/checksum.h"
#include "tests/unit/schema/archive/archive_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

BackupManifest SomeManifest() {
  BackupManifest manifest;
  manifest.maps.push_back({.map = "a", .file = "a-r1-00.dsgz", .byte_count = 3});
  manifest.maps.push_back({.map = "b", .file = "b-r2-00.dsgz", .byte_count = 4});
  manifest.maps[1].sha256[0] = 7;
  return manifest;
}

// With the last line made right again, as an attacker would.
std::string Seal(const std::string& body) {
  return absl::StrCat(body, "sha256 ", ToHex(ComputeSha256(body)), "\n");
}

TEST(BackupManifest, IsReadAsItWasWritten) {
  const auto read = DecodeBackupManifest("M", EncodeBackupManifest(SomeManifest()));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->maps.size(), 2U);
  EXPECT_EQ(read->maps[1].sha256, SomeManifest().maps[1].sha256);
  EXPECT_EQ(read->Find("b")->file, "b-r2-00.dsgz");
  EXPECT_EQ(read->Find("c"), nullptr);
  EXPECT_TRUE(DecodeBackupManifest("M", EncodeBackupManifest({})).ok());
}

TEST(BackupManifest, AnyAlteredOrMissingByteIsDataLoss) {
  const std::string text = EncodeBackupManifest(SomeManifest());
  for (size_t at = 0; at < text.size(); ++at) {
    std::string altered = text;
    altered[at] = static_cast<char>(altered[at] ^ 1);
    EXPECT_EQ(ReasonOf(DecodeBackupManifest("M", altered).status()), Reason::kStoreCorrupt) << at;
    EXPECT_EQ(ReasonOf(DecodeBackupManifest("M", text.substr(0, at)).status()),
              Reason::kStoreCorrupt)
        << at;
  }
}

TEST(BackupManifest, NamesThatLeadOutOfTheFolderAreRefused) {
  const std::string text = EncodeBackupManifest(SomeManifest());
  const std::string body = text.substr(0, text.rfind("sha256 "));
  ASSERT_TRUE(DecodeBackupManifest("M", Seal(body)).ok());
  for (const char* name : {"../a-r1-00.dsgz", "/a.dsgz", ".dsgz", "a.db", "x/y.dsgz", ""}) {
    const std::string forged = absl::StrReplaceAll(body, {{"a-r1-00.dsgz", name}});
    EXPECT_FALSE(DecodeBackupManifest("M", Seal(forged)).ok()) << name;
  }
  EXPECT_FALSE(
      DecodeBackupManifest("M", Seal(absl::StrReplaceAll(body, {{"\"b\"", "\"a\""}}))).ok());
}

TEST(BackupManifest, SaysWhichFieldOfWhichEntryIsWrong) {
  const std::string text = EncodeBackupManifest(SomeManifest());
  const std::string body = text.substr(0, text.rfind("sha256 "));
  const auto refusal = [&](const std::string& from, const std::string& to) {
    const std::string forged = Seal(absl::StrReplaceAll(body, {{from, to}}));
    return std::string(DecodeBackupManifest("M", forged).status().message());
  };
  using testing::HasSubstr;
  EXPECT_THAT(refusal("\"4\"", "4"), HasSubstr("entry 2: field \"byte_count\" is not a text"));
  EXPECT_THAT(refusal("\"4\"", "\"4x\""), HasSubstr("\"byte_count\" is not a whole number"));
  EXPECT_THAT(refusal("\"4\"", "\"-4\""), HasSubstr("\"byte_count\" is negative"));
  EXPECT_THAT(refusal("\"state\"", "\"estate\""), HasSubstr("entry 1: field \"state\" is missing"));
  EXPECT_THAT(refusal("0700", "07g0"), HasSubstr("entry 2: field \"sha256\""));
  EXPECT_THAT(refusal("\"maps\"", "\"map\""), HasSubstr("field \"maps\" is missing"));
  EXPECT_THAT(refusal("}", ""), HasSubstr("not one JSON object"));
  EXPECT_THAT(refusal("[", "[1,"), HasSubstr("\"maps\" is not a list of objects"));
  const std::string deep = std::string(1'000'000, '[') + std::string(1'000'000, ']');
  EXPECT_THAT(refusal("\"b\"", deep), HasSubstr("nested too deeply"));
  // Nothing of the library that reads JSON.
  EXPECT_EQ(refusal("}", "").find("json.exception"), std::string::npos);
  const std::string newer = Seal(absl::StrReplaceAll(body, {{"backup\": 1", "backup\": 2"}}));
  EXPECT_EQ(ReasonOf(DecodeBackupManifest("M", newer).status()), Reason::kFormatTooNew);
}

class BackupFolderTest : public testing::Test {
 protected:
  BackupEntry Save(const std::string& folder) {
    BackupFile file = OrDie(BackupFile::Create(folder, kMap));
    OrDie(file.Write(OrDie(ArchiveBytes(&map_->reader(), map_->folder()))));
    return OrDie(file.Commit(nullptr));
  }

  std::string path() const { return folder_.path() + "/backup"; }

  const std::unique_ptr<TestMap> map_ = MakeArchivedMap(5);
  TempFolder folder_;
};

TEST_F(BackupFolderTest, IsNoneUntilItsManifestIsThere) {
  const auto folder = OrDie(BackupFolder::Open(path()));
  const BackupEntry entry = Save(path());
  EXPECT_TRUE(absl::IsNotFound(ReadBackupManifest(path()).status()));
  OrDie(folder->Finish({.maps = {entry}}));
  EXPECT_EQ(OrDie(ReadBackupManifest(path())).maps.size(), 1U);
  EXPECT_TRUE(CheckBackupFile(path(), entry, nullptr, nullptr).ok());
  EXPECT_EQ(NamesOf(path()), "MANIFEST " + entry.file);
}

TEST_F(BackupFolderTest, IsTheOldOneUntilTheNewOneIsWhole) {
  BackupEntry first;
  {
    const auto folder = OrDie(BackupFolder::Open(path()));
    first = Save(path());
    OrDie(folder->Finish({.maps = {first}}));
  }
  OrDie(map_->writer().SetTag("more", 5, ""));
  const auto folder = OrDie(BackupFolder::Open(path()));
  EXPECT_EQ(folder->last().maps.size(), 1U);
  const BackupEntry second = Save(path());
  EXPECT_NE(second.file, first.file);
  EXPECT_TRUE(
      CheckBackupFile(path(), OrDie(ReadBackupManifest(path())).maps[0], nullptr, nullptr).ok());
  OrDie(folder->Finish({.maps = {second}}));
  EXPECT_EQ(NamesOf(path()), "MANIFEST " + second.file);
}

TEST_F(BackupFolderTest, WhatIsCutOrAlteredIsFound) {
  const auto folder = OrDie(BackupFolder::Open(path()));
  const BackupEntry entry = Save(path());
  const std::string file = path() + "/" + entry.file;
  const std::string bytes = ReadBytes(file);
  std::string altered = bytes;
  altered[bytes.size() / 3] ^= 16;
  for (const std::string& other : {altered, bytes.substr(1), std::string()}) {
    WriteBytes(file, other);
    EXPECT_EQ(ReasonOf(CheckBackupFile(path(), entry, nullptr, nullptr)), Reason::kStoreCorrupt);
  }
  fs::remove(file);
  EXPECT_EQ(ReasonOf(CheckBackupFile(path(), entry, nullptr, nullptr)), Reason::kStoreCorrupt);
}

TEST_F(BackupFolderTest, AnArchiveOfAnotherMapOrRevisionIsFound) {
  const auto folder = OrDie(BackupFolder::Open(path()));
  const BackupEntry entry = Save(path());
  const auto found = [&](auto forge) {
    BackupEntry forged = entry;
    forge(&forged);
    const absl::Status status = CheckBackupFile(path(), forged, nullptr, nullptr);
    EXPECT_EQ(ReasonOf(status), Reason::kStoreCorrupt);
    return std::string(status.message());
  };
  using testing::HasSubstr;
  EXPECT_THAT(found([](BackupEntry* e) { e->map = "kitchen"; }), HasSubstr("its map is"));
  EXPECT_THAT(found([](BackupEntry* e) { ++e->newest_revision; }),
              HasSubstr("its newest_revision is 5, not 6"));
  EXPECT_THAT(found([](BackupEntry* e) { e->newest_digest[0] ^= 1; }), HasSubstr("newest_digest"));
  EXPECT_THAT(found([](BackupEntry* e) { e->state[0] ^= 1; }), HasSubstr("its state is"));
}

TEST_F(BackupFolderTest, WhatIsNotAWholeArchiveOfTheMapIsNotTaken) {
  const auto folder = OrDie(BackupFolder::Open(path()));
  const std::string bytes = OrDie(ArchiveBytes(&map_->reader(), map_->folder()));
  BackupFile cut = OrDie(BackupFile::Create(path(), kMap));
  OrDie(cut.Write(bytes.substr(0, bytes.size() - 1)));
  EXPECT_FALSE(cut.Commit(nullptr).ok());
  BackupFile other = OrDie(BackupFile::Create(path(), "kitchen"));
  OrDie(other.Write(bytes));
  EXPECT_FALSE(other.Commit(nullptr).ok());
}

TEST_F(BackupFolderTest, FoldersOfOtherThingsAreLetAlone) {
  fs::create_directories(path());
  WriteBytes(path() + "/holiday.jpg", "x");
  EXPECT_EQ(ReasonOf(BackupFolder::Open(path()).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(BackupFolder::Open(path() + "/holiday.jpg").status()), Reason::kFieldInvalid);
  EXPECT_EQ(NamesOf(path()), "holiday.jpg");
}

TEST_F(BackupFolderTest, ArchivesOfOthersAreLetAlone) {
  for (const char* name :
       {"office-2025.dsgz", "office-r12-0123456789abcde.dsgz", "office-r-0123456789abcdef.dsgz",
        "office-r12_0123456789abcdef.dsgz", "-r12-0123456789abcdef.dsgz",
        "office-r12-0123456789abcdeF.dsgz", "office-r12-0123456789abcdef.dsgz.part", ".coming.dsgz",
        "MANIFEST.old"}) {
    fs::create_directories(path());
    WriteBytes(path() + "/" + name, "exported");
    EXPECT_EQ(ReasonOf(BackupFolder::Open(path()).status()), Reason::kFieldInvalid) << name;
    EXPECT_EQ(NamesOf(path()), name);
    fs::remove_all(path());
  }
}

TEST_F(BackupFolderTest, WhatAKilledBackupLeftIsNoOtherThing) {
  for (const char* name : {"a-r1-b-r12-0123456789abcdef.dsgz", "office.coming.dsgz",
                           "office.coming.dsgz.part", "MANIFEST.part"}) {
    fs::create_directories(path());
    WriteBytes(path() + "/" + name, "x");
    EXPECT_TRUE(BackupFolder::Open(path()).ok()) << name;
    fs::remove_all(path());
  }
}

TEST_F(BackupFolderTest, OneProcessWritesAtATime) {
  const auto folder = OrDie(BackupFolder::Open(path()));
  EXPECT_TRUE(absl::IsUnavailable(BackupFolder::Open(path()).status()));
}

}  // namespace
}  // namespace dsg::test
