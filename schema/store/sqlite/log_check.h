// SPDX-License-Identifier: Apache-2.0
// Whether a write-ahead log was damaged after it was written. SQLite takes the first bad frame for
// the torn end of a crash and forgets all that follows; but no crash leaves whole commits behind
// it.
#pragma once

#include <optional>
#include <string>

namespace dsg::sqlite {

/// What is wrong with the log at `path`, in a sentence; nullopt when nothing is, or when there is
/// no log. Safe while a writer appends.
std::optional<std::string> FindLogDamage(const std::string& path);

}  // namespace dsg::sqlite
