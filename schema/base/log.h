// SPDX-License-Identifier: Apache-2.0
// Structured log lines on stderr, one per event: "time level event key=value ...".
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace dsg {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

using LogField = std::pair<std::string_view, std::string>;

/// Writes one line. Values are quoted and escaped, so text from callers cannot forge a line.
///
/// Threads: safe from any thread; lines do not interleave.
void Log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields = {});

/// Lines below `level` are dropped. Default kInfo.
void SetLogLevel(LogLevel level);

/// Sets the level by name: "debug", "info", "warning" or "error". False for any other name.
bool SetLogLevel(std::string_view name);

}  // namespace dsg
