// SPDX-License-Identifier: Apache-2.0
// Who may read what a program writes: people's data is for whom its folder is for, and a folder of
// its own for its user alone.
#pragma once

#include <sys/types.h>

#include <string>

#include "absl/status/status.h"

namespace dsg {

/// Permissions of a new file in a folder, for open(): nobody gets more than the folder gives. The
/// umask of the process takes more away.
mode_t FileModeIn(const std::string& folder);
/// The same of a new folder in it, for mkdir().
mode_t FolderModeIn(const std::string& folder);

/// Makes a folder that only its user may enter, and missing ones above it as usual. One that is
/// there stays as it is.
///
/// Errors: UNAVAILABLE naming the folder and what the system says.
absl::Status MakePrivateFolder(const std::string& path);

}  // namespace dsg
