// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/archive_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "schema/archive/archive_map.h"
#include "schema/base/random.h"
#include "tests/unit/schema/archive/archive_test_util.h"

namespace dsg::test {
namespace {

TEST(ArchiveFile, GivesBackTheDatabaseByteForByte) {
  const auto map = MakeArchivedMap(20);
  const std::string copy = map->folder() + "/copy.db";
  OrDie(map->reader().CopyTo(copy, nullptr, nullptr));
  const std::string path = map->folder() + "/map.dsgz";
  WriteBytes(path, OrDie(ArchiveBytes(&map->reader(), map->folder())));
  std::string database;
  const auto manifest = ReadArchiveFile(
      path,
      [&](std::string_view bytes) {
        database += bytes;
        return absl::OkStatus();
      },
      nullptr, nullptr);
  ASSERT_TRUE(manifest.ok()) << manifest.status();
  EXPECT_EQ(database, ReadBytes(copy));
  EXPECT_EQ(manifest->spec.name, kMap);
  EXPECT_EQ(manifest->newest_revision, 20);
  EXPECT_EQ(manifest->newest_digest, OrDie(map->reader().Head()).digest);
  EXPECT_EQ(manifest->database_bytes, static_cast<int64_t>(database.size()));
}

TEST(ArchiveFile, OfTheSameMapHasTheSameBytesWheneverItIsMade) {
  const auto map = MakeArchivedMap(10);
  const std::string first = OrDie(ArchiveBytes(&map->reader(), map->folder()));
  EXPECT_EQ(OrDie(ArchiveBytes(&map->reader(), map->folder())), first);
  map->Close();
  map->Reopen();
  EXPECT_EQ(OrDie(ArchiveBytes(&map->reader(), map->folder())), first);
}

TEST(ArchiveFile, IsOfOneRevisionWhileOthersAreCommitted) {
  const auto map = MakeArchivedMap(10);
  auto encoder = OrDie(ArchiveMap(&map->reader(), map->folder(), nullptr, nullptr));
  GraphDelta delta = DeltaOfPoses(NodeId('H', 99), {});
  delta.appends.clear();
  delta.nodes = {MakeHuman(99, "late")};
  OrDie(map->Commit(delta));
  EXPECT_EQ(encoder->manifest().newest_revision, 10);
  std::string all;
  while (!encoder->done()) all += OrDie(encoder->Next(nullptr));
  const std::string path = map->folder() + "/map.dsgz";
  WriteBytes(path, all);
  EXPECT_EQ(OrDie(ReadArchiveFile(path, nullptr, nullptr, nullptr)).newest_revision, 10);
}

TEST(ArchiveFile, LeavesNothingBesideTheMap) {
  const auto map = MakeArchivedMap(3);
  const std::string before = NamesOf(map->folder());
  auto encoder = OrDie(ArchiveMap(&map->reader(), map->folder(), nullptr, nullptr));
  EXPECT_EQ(NamesOf(map->folder()), before);
}

TEST(ArchiveFile, StopsWhenItIsTold) {
  const auto map = MakeArchivedMap(3);
  const std::string before = NamesOf(map->folder());
  const auto stop = [] { return absl::CancelledError("enough"); };
  EXPECT_TRUE(absl::IsCancelled(ArchiveMap(&map->reader(), map->folder(), stop, nullptr).status()));
  EXPECT_EQ(NamesOf(map->folder()), before);
  const std::string path = map->folder() + "/map.dsgz";
  WriteBytes(path, OrDie(ArchiveBytes(&map->reader(), map->folder())));
  EXPECT_TRUE(absl::IsCancelled(ReadArchiveFile(path, nullptr, stop, nullptr).status()));
}

TEST(ArchiveFile, FramesOfNoiseAndOfZerosComeBack) {
  Random random(7, 0);
  std::string noise(kArchiveFrameBytes, '\0');
  for (char& c : noise) c = static_cast<char>(random.Integer(0, 255));
  for (const std::string& bytes :
       {noise, std::string(kArchiveFrameBytes, '\0'), noise.substr(0, 5), std::string(1, 'x')}) {
    std::string frame;
    AppendFrame(3, bytes, &frame);
    EXPECT_GE(frame.size() * kArchiveRatioMax, bytes.size());
    const std::string head = frame.substr(0, kArchiveFrameHeadBytes);
    ASSERT_EQ(StoredBytes(head), frame.size() - kArchiveFrameHeadBytes);
    std::string back;
    const std::string stored = frame.substr(kArchiveFrameHeadBytes);
    ASSERT_TRUE(DecodeFrame(3, head, stored, bytes.size(), &back).ok());
    EXPECT_EQ(back, bytes);
    EXPECT_FALSE(DecodeFrame(4, head, stored, bytes.size(), &back).ok());
  }
}

TEST(ArchiveFile, WhatIsNoFileIsRefused) {
  const TempFolder folder;
  EXPECT_TRUE(absl::IsNotFound(ReadArchiveManifest(folder.path() + "/none").status()));
  EXPECT_EQ(ReasonOf(ReadArchiveManifest(folder.path()).status()), Reason::kFileMalformed);
  const std::string pipe = folder.path() + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(ReasonOf(ReadArchiveManifest(pipe).status()), Reason::kFileMalformed);
  for (const char* text : {"", "D", "DSGZ", "SQLite format 3 and what comes after it"}) {
    WriteBytes(folder.path() + "/text", text);
    EXPECT_EQ(ReasonOf(ReadArchiveManifest(folder.path() + "/text").status()),
              Reason::kFileMalformed)
        << text;
  }
}

}  // namespace
}  // namespace dsg::test
