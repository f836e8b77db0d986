// SPDX-License-Identifier: Apache-2.0
// A folder that a test may fill and that is gone afterwards, the bytes of files, and seeds.
#pragma once

#include <cstdint>
#include <string>

namespace dsg::test {

class TempFolder {
 public:
  TempFolder();
  ~TempFolder();
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// The bytes of a file; empty if it cannot be read.
std::string ReadFile(const std::string& path);

/// The bytes of all files of a folder and of those in it, one after the other, in any order.
std::string ReadFolder(const std::string& folder);

/// The seed of random tests: DSG_SEED, or `fallback`. Printed, so that a failure can be repeated.
uint64_t TestSeed(uint64_t fallback);

}  // namespace dsg::test
