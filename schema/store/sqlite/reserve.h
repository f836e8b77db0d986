// SPDX-License-Identifier: Apache-2.0
// A file that does nothing but take space: given up when the disk is full, so that what frees
// space has some to work with. Refuses to take space that is scarce.
#pragma once

#include <cstdint>
#include <string>

namespace dsg::sqlite {

/// Threads: one at a time, of the process that writes the map.
class Reserve {
 public:
  /// `folder`: of the map; `bytes`: 0 = none.
  Reserve(const std::string& folder, int64_t bytes)
      : folder_(folder), path_(folder + "/reserve"), bytes_(bytes) {}

  /// Makes the file, unless it is there or the disk has less than four times its size left.
  void Make() const;
  bool IsThere() const;
  /// Removes it; false if there was none.
  bool Release() const;

 private:
  std::string folder_;
  std::string path_;
  int64_t bytes_;
};

}  // namespace dsg::sqlite
