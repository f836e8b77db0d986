// SPDX-License-Identifier: Apache-2.0
#include "tests/support/open_files.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace dsg::test {

std::vector<int> OpenFilesIn(const std::string& folder) {
  std::vector<int> open;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code error;
    const std::string target = std::filesystem::read_symlink(entry.path(), error).string();
    if (error || target.rfind(folder + "/", 0) != 0) continue;
    open.push_back(std::stoi(entry.path().filename().string()));
  }
  std::sort(open.begin(), open.end());
  return open;
}

}  // namespace dsg::test
