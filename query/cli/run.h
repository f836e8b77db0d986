// SPDX-License-Identifier: Apache-2.0
// The program dsg without its process: a command line in, text and an exit code out.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "query/cli/arguments.h"

namespace dsg::cli {

/// `arguments` without the program's name. Answers go to `out`; errors and progress to `errors`.
/// Returns the exit code, see errors.h.
int Run(const std::vector<std::string>& arguments, const Environment& environment,
        std::ostream& out, std::ostream& errors);

}  // namespace dsg::cli
