// SPDX-License-Identifier: Apache-2.0
// The numbers of tables of options as flags of a program, in groups of their own.
#pragma once

#include <span>
#include <string>

#include "absl/status/status.h"
#include "ingest/config/option_field.h"

namespace CLI {
class App;
}

namespace dsg::ingest {

/// --help names the groups of AddTuning, and --help-all shows them.
void UseShortHelp(CLI::App* app);

/// A flag for each number, which refuses what is out of its range.
void AddTuning(std::span<const OptionGroup> groups, CLI::App* app);

/// Of a flag that says nothing without another one, which was not given.
absl::Status NeedsOther(const std::string& flag, const std::string& other);

}  // namespace dsg::ingest
