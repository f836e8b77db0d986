// SPDX-License-Identifier: Apache-2.0
// A folder of a benchmark's own, removed with all that is in it when the benchmark ends.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace dsg::bench {

class ScratchFolder {
 public:
  /// Makes "<parent>/<name>-XXXXXX", and `parent` if it is missing.
  static absl::StatusOr<std::unique_ptr<ScratchFolder>> Make(const std::string& parent,
                                                             const std::string& name);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  explicit ScratchFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

/// Bytes of all files in a folder.
int64_t BytesIn(const std::string& folder);

/// Asks the kernel to forget the files of a folder, so that the next read comes from the disk.
void EvictFromPageCache(const std::string& folder);

}  // namespace dsg::bench
