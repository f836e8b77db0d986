// SPDX-License-Identifier: Apache-2.0
// Files that are read in pieces, and digests of bytes that come in pieces. Refuses to wait on what
// is no plain file.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/model/node.h"

namespace dsg {

/// A plain file open for reading from its begin to its end.
///
/// Threads: one caller at a time.
class InputFile {
 public:
  /// Errors: NOT_FOUND without the file; INVALID_ARGUMENT/FILE_MALFORMED for what is no plain file;
  /// UNAVAILABLE with what the system says.
  static absl::StatusOr<InputFile> Open(const std::string& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&&) = delete;
  ~InputFile();

  /// The next bytes, `size` of them or what is left. Errors: UNAVAILABLE.
  absl::Status Read(size_t size, std::string* bytes);

  const std::string& path() const { return path_; }
  /// As it was when the file was opened.
  int64_t byte_count() const { return byte_count_; }

 private:
  InputFile(std::string path, int fd, int64_t byte_count)
      : path_(std::move(path)), fd_(fd), byte_count_(byte_count) {}

  std::string path_;
  int fd_;
  int64_t byte_count_;
};

/// RESOURCE_EXHAUSTED/DISK_FULL if `error` (an errno) says so, else UNAVAILABLE.
absl::Status SystemError(const std::string& what, const std::string& path, int error);

/// SHA-256 of bytes that come piece by piece.
///
/// Threads: one caller at a time.
class Sha256Stream {
 public:
  Sha256Stream();
  ~Sha256Stream();
  Sha256Stream(Sha256Stream&&) noexcept;
  Sha256Stream& operator=(Sha256Stream&&) noexcept;

  void Add(std::string_view bytes);
  /// Of all that was added. The last call.
  Sha256 Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dsg
