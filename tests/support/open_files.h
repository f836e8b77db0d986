// SPDX-License-Identifier: Apache-2.0
// The files without a name that this process has open, for tests that look into them.
#pragma once

#include <string>
#include <vector>

namespace dsg::test {

/// Descriptors of open files that are, or were, in a folder; files, and not folders. They are the
/// process's own: do not close them.
std::vector<int> OpenFilesIn(const std::string& folder);

}  // namespace dsg::test
