// SPDX-License-Identifier: Apache-2.0
#include "ingest/files/spill_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "absl/hash/hash.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Pieces change their size a little; room in steps lets most of them stay where they are.
constexpr uint32_t kRoomStep = 1024;

uint32_t RoomFor(size_t byte_count) {
  return static_cast<uint32_t>((byte_count + kRoomStep - 1) / kRoomStep * kRoomStep);
}

std::string FolderOr(std::string folder) {
  if (!folder.empty()) return folder;
  const char* temporary = std::getenv("TMPDIR");
  return temporary == nullptr || *temporary == '\0' ? "/tmp" : temporary;
}

// Kept apart from the file, so its own bytes need no protection.
uint64_t DigestOf(std::string_view bytes) { return absl::HashOf(bytes); }

}  // namespace

SpillFile::SpillFile(std::string folder) : folder_(FolderOr(std::move(folder))) {}

SpillFile::~SpillFile() {
  if (file_ >= 0) close(file_);
}

absl::Status SpillFile::Failure(const char* what, int error) const {
  const std::string message =
      absl::StrCat("cannot ", what, " working memory on disk in ", folder_, ": ",
                   std::strerror(error), "; name a folder with --spill-folder or TMPDIR");
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    return MakeError(Reason::kDiskFull, message, {{"path", folder_}});
  }
  return absl::UnavailableError(message);
}

absl::Status SpillFile::Open() {
  if (file_ >= 0) return absl::OkStatus();
  file_ = open(folder_.c_str(), O_TMPFILE | O_EXCL | O_RDWR | O_CLOEXEC, 0600);
  if (file_ >= 0) return absl::OkStatus();
  // Not every file system can make files without a name.
  if (errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT && errno != EINVAL) {
    return Failure("make a file for", errno);
  }
  std::string path = absl::StrCat(folder_, "/dsg-spill-XXXXXX");
  file_ = mkostemp(path.data(), O_CLOEXEC);
  if (file_ < 0) return Failure("make a file for", errno);
  unlink(path.c_str());
  return absl::OkStatus();
}

absl::Status SpillFile::Write(std::string_view bytes, SpillPiece* piece) {
  const uint64_t digest = DigestOf(bytes);
  if (!piece->empty() && piece->byte_count == bytes.size() && piece->digest == digest) {
    return absl::OkStatus();
  }
  DSG_RETURN_IF_ERROR(Open());
  SpillPiece next = *piece;
  if (piece->empty() || piece->capacity < bytes.size()) {
    next.capacity = RoomFor(bytes.size());
    std::vector<int64_t>& free = free_[next.capacity];
    next.offset = free.empty() ? end_ : free.back();
  }
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t count = pwrite(file_, bytes.data() + done, bytes.size() - done,
                                 next.offset + static_cast<int64_t>(done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = count < 0 ? errno : ENOSPC;
      // What was there is gone.
      if (next.offset == piece->offset) Free(piece);
      return Failure("write", error);
    }
    done += static_cast<size_t>(count);
  }
  if (next.offset != piece->offset) {
    if (next.offset == end_) {
      end_ += next.capacity;
    } else {
      free_[next.capacity].pop_back();
    }
    Free(piece);
  }
  next.byte_count = static_cast<uint32_t>(bytes.size());
  next.digest = digest;
  *piece = next;
  return absl::OkStatus();
}

absl::Status SpillFile::Read(const SpillPiece& piece, std::string* bytes) const {
  bytes->resize(piece.byte_count);
  size_t done = 0;
  while (done < bytes->size()) {
    const ssize_t count = pread(file_, bytes->data() + done, bytes->size() - done,
                                piece.offset + static_cast<int64_t>(done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return Failure("read", errno);
    if (count == 0) break;
    done += static_cast<size_t>(count);
  }
  if (done == bytes->size() && DigestOf(*bytes) == piece.digest) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(
      "working memory on disk in ", folder_, " holds other bytes at ", piece.offset,
      " than were written there: the disk is not to be trusted; nothing of them was used"));
}

void SpillFile::Free(SpillPiece* piece) {
  if (!piece->empty()) free_[piece->capacity].push_back(piece->offset);
  *piece = SpillPiece();
}

}  // namespace dsg::ingest
