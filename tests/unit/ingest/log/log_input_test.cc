// SPDX-License-Identifier: Apache-2.0
// Logs that are packed, or come from standard input.
#include "ingest/log/log_input.h"

#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include <cstdio>
#include <random>

#include "absl/strings/str_cat.h"
#include "ingest/log/packed_bytes.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

std::string Gzip(const std::string& plain) {
  z_stream stream = {};
  EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, plain.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(plain.data()));
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(out.size() - stream.avail_out);
  deflateEnd(&stream);
  return out;
}

std::string Zstd(const std::string& plain) {
  std::string out(ZSTD_compressBound(plain.size()), '\0');
  out.resize(ZSTD_compress(out.data(), out.size(), plain.data(), plain.size(), 3));
  return out;
}

std::string Rows(int count) {
  std::string rows;
  for (int i = 0; i < count; ++i) absl::StrAppend(&rows, i, " 1 ", i * 0.37, " 2.5\n");
  return rows;
}

TEST(LogInput, PackedLogsAreTheSameLogs) {
  const TempFolder folder;
  const std::string rows = Rows(10'000);
  const auto plain = ReadAll(folder.Write("plain", rows));
  ASSERT_TRUE(plain.ok()) << plain.status();
  // Two parts one after another are one file, as `cat a.gz b.gz` makes it.
  const std::string begin = rows.substr(0, 5'000);
  const std::string end = rows.substr(5'000);
  for (const std::string& packed : {Gzip(rows), Zstd(rows), Gzip(begin) + Gzip(end),
                                    Zstd(begin) + Zstd(end), Gzip(rows) + std::string(512, '\0')}) {
    const auto log = ReadAll(folder.Write("packed", packed));
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->info.format, "trajnet");
    EXPECT_EQ(log->order, plain->order);
    EXPECT_EQ(log->info.content_sha256, plain->info.content_sha256);
  }
}

TEST(LogInput, UnpacksPoseFilesToo) {
  const TempFolder folder;
  folder.Write("mav0/imu0/data.csv",
               "#timestamp,w_x,w_y,w_z,a_x,a_y,a_z\n1600000010000000000,0,0,0,0,0,0\n");
  LogOptions options;
  options.pose_file =
      folder.Write("poses.gz", Gzip("1600000010 1 2 3 0 0 0 1\n1600000011 1 2 3 0 0 0 1\n"));
  const auto log = ReadAll(folder.Path(""), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 2u);
}

TEST(LogInput, RefusesEachCutAndEachFlippedBitWithoutACrash) {
  const TempFolder folder;
  const std::string rows = Rows(40);
  for (const std::string& packed : {Gzip(rows), Zstd(rows)}) {
    for (size_t size = 0; size < packed.size(); ++size) {
      const absl::Status status = ReadAll(folder.Write("log", packed.substr(0, size))).status();
      EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << size;
      if (size >= 4) ExpectMalformedFile(status, {"copy it again"});
    }
    std::mt19937 random(7);
    for (int i = 0; i < 200; ++i) {
      std::string changed = packed;
      const size_t at = random() % changed.size();
      changed[at] = static_cast<char>(changed[at] ^ 1 << random() % 8);
      const auto log = ReadAll(folder.Write("log", changed));
      EXPECT_TRUE(log.ok() || ReasonOf(log.status()) == Reason::kFileMalformed) << log.status();
    }
  }
  ExpectMalformedFile(ReadAll(folder.Write("log", Gzip(rows) + "tail")).status(), {"follows"});
}

TEST(LogInput, StopsABombAtItsBound) {
  const std::string zeros(size_t{4} << 20, '\0');
  for (const std::string& bomb : {Gzip(zeros), Zstd(zeros)}) {
    EXPECT_LT(bomb.size(), 8192u);
    ExpectMalformedFile(Unpack(bomb, "bomb", size_t{1} << 20).status(), {"bomb", "than 1 MiB"});
    ExpectMalformedFile(Unpack(bomb, "bomb", zeros.size() - 1).status(), {"unpacks to more"});
    const auto whole = Unpack(bomb, "bomb", zeros.size());
    ASSERT_TRUE(whole.ok()) << whole.status();
    EXPECT_EQ(*whole, zeros);
  }
}

TEST(LogInput, SendsPackedBagsBack) {
  const TempFolder folder;
  for (const std::string& begin : {std::string("#ROSBAG V2.0\n"), std::string("\x89MCAP0\r\n")}) {
    ExpectMalformedFile(ReadAll(folder.Write("log.bag.gz", Gzip(begin + "rest"))).status(),
                        {"log.bag.gz", "is a bag", "unpack"});
  }
}

// The input is read once in the life of a program, hence the one test.
TEST(LogInput, ReadsStandardInputOnceAndAgain) {
  const TempFolder folder;
  const std::string rows = "time,id,x,y\n0.5,1,2,3\n1.5,1,2,4\n";
  const std::string path = folder.Write("rows.zst", Zstd(rows));
  const int before = dup(STDIN_FILENO);
  ASSERT_NE(std::freopen(path.c_str(), "rb", stdin), nullptr);
  for (int i = 0; i < 2; ++i) {
    LogOptions options;
    options.epoch_ns = i;
    const auto log = ReadAll("-", options);
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->info.format, "csv");
    EXPECT_EQ(log->info.path, "standard input");
    EXPECT_EQ(log->poses.at(0).pose.time_ns, 500'000'000 + i);
  }
  LogOptions options;
  options.format = "trajnet";
  ExpectMalformedFile(ReadAll("-", options).status(), {"standard input:1"});
  dup2(before, STDIN_FILENO);
  close(before);
}

}  // namespace
}  // namespace dsg::ingest
