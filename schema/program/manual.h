// SPDX-License-Identifier: Apache-2.0
// The manual page of a program, made of its command line, so that both say the same.
#pragma once

#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace dsg {

/// Prints the manual page. The build uses it; no help shows it.
inline constexpr char kManualFlag[] = "--man";

/// The page of section 1 in the language of man(7): the program, its options by group, its verbs by
/// group with theirs, and its notes. `date` is like 2026-11-21.
std::string ManualPage(const CLI::App& app, const std::string& version, const std::string& date);

/// Adds kManualFlag, which ends parsing as a flag for the version does: with CLI::CallForVersion,
/// whose text is the page. It has all options that are there when it is asked for, and the date of
/// today, or of SOURCE_DATE_EPOCH for builds that give the same bytes again.
void AddManual(CLI::App* app, const std::string& version);

}  // namespace dsg
