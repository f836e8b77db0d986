// SPDX-License-Identifier: Apache-2.0
// One way to say what is wrong with a file. It refuses to say so without naming where.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace dsg {

/// INVALID_ARGUMENT/FILE_MALFORMED "`file`: `where`: `what`"; `where` is a field or a byte offset.
absl::Status FileError(const std::string& file, const std::string& where, std::string_view what);

}  // namespace dsg
