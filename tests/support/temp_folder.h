// SPDX-License-Identifier: Apache-2.0
// A folder that a test may fill and that is gone afterwards.
#pragma once

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

/// The seed of random tests: DSG_SEED, or `fallback`. Printed, so that a failure can be repeated.
uint64_t TestSeed(uint64_t fallback);

}  // namespace dsg::test
