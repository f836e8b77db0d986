// SPDX-License-Identifier: Apache-2.0
#include "query/cli/file_text.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

constexpr int64_t kFileBytesMax = int64_t{512} << 20;

}  // namespace

absl::StatusOr<FileText> FileText::Read(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return absl::NotFoundError(absl::StrCat(path, " is not a file; check the path"));
  }
  const uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size > static_cast<uintmax_t>(kFileBytesMax)) {
    return MakeError(
        Reason::kLimitExceeded,
        absl::StrCat(path, " has ", size, " bytes; the largest file is ", kFileBytesMax, " bytes"));
  }
  if (size == 0) return FileText(nullptr, 0);
  // A string's memory could only be given back whole.
  void* const memory =
      mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    return absl::UnavailableError(
        absl::StrCat("there is no memory for the ", size, " bytes of ", path));
  }
  FileText read(static_cast<char*>(memory), size);
  std::ifstream file(path, std::ios::binary);
  if (!file.read(read.data_, static_cast<std::streamsize>(size))) {
    return absl::UnavailableError(absl::StrCat(path, " cannot be read; check its permissions"));
  }
  return read;
}

FileText::FileText(FileText&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

FileText::~FileText() {
  if (data_ != nullptr) munmap(data_, size_);
}

void FileText::Drop(std::string_view part) const {
  static const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  // Pages that the part shares with its neighbours stay.
  const auto offset = static_cast<size_t>(part.data() - data_);
  const size_t begin = (offset + page - 1) / page * page;
  const size_t end = (offset + part.size()) / page * page;
  if (begin < end) madvise(data_ + begin, end - begin, MADV_DONTNEED);
}

}  // namespace dsg::cli
