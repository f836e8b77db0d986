// SPDX-License-Identifier: Apache-2.0
// Whole files in memory, and the hash that is a log's identity.
// Refuses anything but regular files: a pipe or device has no end that can be checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// One file of a log.
struct LogFile {
  /// As messages print it.
  std::string path;
  /// Within the log: "tracks.csv"; part of the log's identity when the log is a folder.
  std::string name;
  std::string bytes;
  /// Of a text whose lines are read in pieces: how many are missing behind the first line.
  int64_t lines_left_out = 0;
};

/// INVALID_ARGUMENT/FILE_MALFORMED: "path: message".
absl::Status MalformedFile(const std::string& path, const std::string& message);

/// Whether `path` is a regular file; false when it cannot be told.
bool IsFile(const std::filesystem::path& path);

/// Reads a file whole.
///
/// Errors: NOT_FOUND when it is missing; INVALID_ARGUMENT/FILE_MALFORMED when it is not a regular
/// file or empty; INVALID_ARGUMENT/FIELD_INVALID naming what the system said when it cannot be
/// read.
absl::StatusOr<LogFile> ReadLogFile(const std::string& path);

/// SHA-256 in hexadecimal.
std::string Sha256Hex(std::string_view bytes);

/// The identity of a log: SHA-256 in hexadecimal over the bytes of one file, or over names, sizes
/// and bytes of several.
std::string ContentSha256(const std::vector<const LogFile*>& files);

/// The info of a log of one file: format, path and identity; the rest is left for the reader.
LogInfo DescribeLog(std::string_view format, const LogFile& file);

/// The same for a log of lines, with a note when the last line has no end: what is left of it may
/// look whole.
LogInfo DescribeTextLog(std::string_view format, const LogFile& file);

}  // namespace dsg::ingest
