// SPDX-License-Identifier: Apache-2.0
// A disk that is full, for the files that this process writes.
#pragma once

#include <sys/resource.h>

#include <cstdint>

namespace dsg::test {

/// No file grows beyond `bytes` while this lives, by the limit that the system keeps of file sizes;
/// those that are larger already stay. It holds for the whole process, so keep its life short.
class FullDisk {
 public:
  explicit FullDisk(int64_t bytes = 0);
  ~FullDisk();
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit limit_before_{};
  void (*handler_before_)(int);
};

}  // namespace dsg::test
