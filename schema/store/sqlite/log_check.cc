// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/log_check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <vector>

#include "absl/strings/str_cat.h"

namespace dsg::sqlite {
namespace {

// The layout is SQLite's: a header of 32 bytes, then frames of 24 bytes and a page each. Numbers
// are big-endian; the magic number tells the byte order of the words that are summed.
constexpr size_t kHeaderBytes = 32;
constexpr size_t kFrameHeaderBytes = 24;
constexpr uint32_t kMagic = 0x377f0682;
constexpr uint32_t kPageBytesMax = 65536;

uint32_t BigEndian(const char* at) {
  uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(at[i]);
  return value;
}

uint32_t LittleEndian(const char* at) {
  uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<uint8_t>(at[i]);
  return value;
}

// The running sum over all that came before, as SQLite keeps it.
class LogSum {
 public:
  explicit LogSum(bool is_big_endian) : is_big_endian_(is_big_endian) {}
  void Add(const char* bytes, size_t size) {
    for (size_t i = 0; i + 8 <= size; i += 8) {
      first_ += Word(bytes + i) + second_;
      second_ += Word(bytes + i + 4) + first_;
    }
  }
  bool Equals(const char* stored) const {
    return BigEndian(stored) == first_ && BigEndian(stored + 4) == second_;
  }

 private:
  uint32_t Word(const char* at) const { return is_big_endian_ ? BigEndian(at) : LittleEndian(at); }

  bool is_big_endian_;
  uint32_t first_ = 0;
  uint32_t second_ = 0;
};

// Number, from 1, of a bad frame that whole commits of the same log follow; 0 if there is none.
int64_t FindBadFrame(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, kHeaderBytes> header{};
  if (!file.read(header.data(), kHeaderBytes)) return 0;
  const uint32_t magic = BigEndian(header.data());
  const uint32_t page_bytes = BigEndian(header.data() + 8);
  if ((magic & ~1u) != kMagic || page_bytes == 0 || page_bytes > kPageBytesMax) return 1;
  LogSum sum((magic & 1) != 0);
  sum.Add(header.data(), 24);
  if (!sum.Equals(header.data() + 24)) return 1;
  int64_t bad = 0;
  std::vector<char> frame(kFrameHeaderBytes + page_bytes);
  for (int64_t number = 1; file.read(frame.data(), static_cast<std::streamsize>(frame.size()));
       ++number) {
    const bool is_of_this_log = std::equal(frame.data() + 8, frame.data() + 16, &header[16]);
    const bool is_commit = BigEndian(frame.data() + 4) != 0;
    if (bad != 0) {
      // Frames of earlier logs may stand here; they bear other salts.
      if (is_of_this_log && is_commit) return bad;
      continue;
    }
    sum.Add(frame.data(), 8);
    sum.Add(frame.data() + kFrameHeaderBytes, page_bytes);
    if (!is_of_this_log || !sum.Equals(frame.data() + 16)) bad = number;
  }
  return 0;
}

}  // namespace

std::optional<std::string> FindLogDamage(const std::string& path) {
  // A frame that was read while it was being written is whole the next time; a log that was begun
  // anew has another bad frame, or none.
  int64_t bad = FindBadFrame(path);
  for (int tries = 0; bad != 0 && tries < 3; ++tries) {
    const int64_t again = FindBadFrame(path);
    bad = again;
  }
  if (bad == 0) return std::nullopt;
  return absl::StrCat("write-ahead log: frame ", bad,
                      " is not what was written, and the commits after it are lost");
}

}  // namespace dsg::sqlite
