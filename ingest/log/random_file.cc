// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/random_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {

absl::StatusOr<std::unique_ptr<RandomFile>> RandomFile::Open(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status = {};
  if (descriptor < 0 || fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    const int error = errno;
    if (descriptor >= 0) close(descriptor);
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(path, ": cannot be read: ", std::strerror(error)),
                     {{"field", "log"}, {"value", path}});
  }
  return std::unique_ptr<RandomFile>(
      new RandomFile(path, descriptor, static_cast<uint64_t>(status.st_size)));
}

RandomFile::RandomFile(std::string path, int descriptor, uint64_t size)
    : path_(std::move(path)), descriptor_(descriptor), size_(size) {}

RandomFile::~RandomFile() { close(descriptor_); }

absl::Status RandomFile::Fail(uint64_t at, const std::string& message) const {
  return MakeError(Reason::kFileMalformed, absl::StrCat(path_, ": byte ", at, ": ", message),
                   {{"file", path_}, {"offset", absl::StrCat(at)}});
}

absl::StatusOr<std::string> RandomFile::ReadBytes(uint64_t at, uint64_t size,
                                                  const std::string& remedy) const {
  const uint64_t end = size_;
  if (at > end || size > end - at) {
    return Fail(at, absl::StrCat("the bag ends at byte ", end,
                                 ", in the middle of a record; it was cut short: ", remedy));
  }
  std::string bytes(size, '\0');
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return Fail(at, "cannot be read any more; did the bag change meanwhile?");
    done += static_cast<size_t>(count);
  }
  return bytes;
}

absl::StatusOr<uint32_t> RandomFile::Crc32(uint64_t begin, uint64_t end) const {
  uLong crc = crc32(0, nullptr, 0);
  while (begin < end) {
    const uint64_t size = std::min(end - begin, uint64_t{1} << 20);
    DSG_ASSIGN_OR_RETURN(const std::string bytes, ReadBytes(begin, size, "copy it again"));
    crc = crc32(crc, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(size));
    begin += size;
  }
  return static_cast<uint32_t>(crc);
}

}  // namespace dsg::ingest
