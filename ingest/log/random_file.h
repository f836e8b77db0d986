// SPDX-License-Identifier: Apache-2.0
// A file of any size that is read in pieces.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace dsg::ingest {

/// Threads: any number of callers, of GrowTo one.
class RandomFile {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming what the system said when it is no regular file
  /// or cannot be read.
  static absl::StatusOr<std::unique_ptr<RandomFile>> Open(const std::string& path);
  ~RandomFile();
  RandomFile(const RandomFile&) = delete;
  RandomFile& operator=(const RandomFile&) = delete;

  const std::string& path() const { return path_; }
  uint64_t size() const { return size_; }
  /// Of a file that grows: bytes before `size` may be read from now on.
  void GrowTo(uint64_t size) { size_ = size; }

  /// Errors: of Fail, when the bytes are not there; `remedy` is what the user can do then.
  absl::StatusOr<std::string> ReadBytes(uint64_t at, uint64_t size,
                                        const std::string& remedy) const;
  /// CRC-32 of zlib over [begin, end), read in small pieces.
  absl::StatusOr<uint32_t> Crc32(uint64_t begin, uint64_t end) const;

  /// INVALID_ARGUMENT/FILE_MALFORMED: "path: byte 17: message".
  absl::Status Fail(uint64_t at, const std::string& message) const;

 private:
  RandomFile(std::string path, int descriptor, uint64_t size);

  std::string path_;
  int descriptor_;
  std::atomic<uint64_t> size_;
};

}  // namespace dsg::ingest
