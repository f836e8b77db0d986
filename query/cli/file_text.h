// SPDX-License-Identifier: Apache-2.0
// A whole file in memory, which can be given back a stretch at a time as it is read.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::cli {

/// The file's bytes in memory of their own: what becomes of the file meanwhile does not matter.
class FileText {
 public:
  /// Errors: NOT_FOUND without the file; INVALID_ARGUMENT/LIMIT_EXCEEDED beyond 512 MiB;
  /// UNAVAILABLE if it cannot be read.
  static absl::StatusOr<FileText> Read(const std::string& path);

  FileText(FileText&& other) noexcept;
  FileText& operator=(FileText&&) = delete;
  ~FileText();

  std::string_view text() const { return {data_, size_}; }
  /// A part of text() will not be read again; its pages leave memory, and read as zeros.
  void Drop(std::string_view part) const;

 private:
  FileText(char* data, size_t size) : data_(data), size_(size) {}

  char* data_ = nullptr;
  size_t size_ = 0;
};

}  // namespace dsg::cli
