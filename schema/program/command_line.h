// SPDX-License-Identifier: Apache-2.0
// What all programs say of a command line that they do not take, and how they end.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace dsg {

/// What is wrong with the words that `app` refused with `error`, and where help is:
/// `not understood: --stor x; near in spelling: "--store"; see dsg stats --help`. Words that nobody
/// knows come first: a misspelt option is also missing.
std::string UsageMessage(const CLI::App& app, const CLI::ParseError& error);

/// The first of the words that is an option with "=" and no value, as "--store"; CLI11 would take
/// the next word for its value. Empty if there is none.
std::string OptionWithoutValue(const std::vector<std::string>& words);

/// The help of a program with verbs says "Usage: dsg VERB [OPTIONS]".
void UseVerbUsage(CLI::App* app);

/// Reads a command line. Without a value the program goes on. Else it ends with this exit code: 0
/// after a help, a version or a manual was printed; 2 after a mistake, which was told on stderr.
/// Checks of options that depend on each other are a callback of `app` that throws
/// CLI::ParseError.
std::optional<int> ReadCommandLine(int argc, char** argv, CLI::App* app);

/// Tells an error on stderr, "dsg-server: ...", and what a log or another file makes notable,
/// "log.csv: note: ...": in one line that cannot control the terminal.
void TellError(const std::string& program, const std::string& message);
void TellNote(const std::string& about, const std::string& note);

/// The same, "dsg-align: NOT_FOUND: ...". Returns the exit code, also of OK.
int TellError(const CLI::App& app, const absl::Status& status);

/// The whole of a program: reads its command line, runs, tells the error. What was printed and did
/// not arrive is an error, too. Returns the exit code.
int RunProgram(int argc, char** argv, CLI::App* app, const std::function<absl::Status()>& run);

}  // namespace dsg
