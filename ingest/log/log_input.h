// SPDX-License-Identifier: Apache-2.0
// The bytes of a log that is read whole: a file, packed or not, or standard input.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"

namespace dsg::ingest {

/// The path that means standard input.
inline constexpr std::string_view kStandardInput = "-";

/// What is unpacked, or comes from standard input, is refused beyond this: both come from
/// elsewhere, and nobody saw how large they are.
inline constexpr size_t kInputBytesMax = size_t{1} << 30;

/// ReadLogFile, and besides: "-" is standard input, which is read once and kept, since a log may
/// be opened again; what gzip or Zstandard packed is unpacked. The bytes, and so the identity of
/// the log, are the same packed or not.
///
/// Errors: of ReadLogFile and Unpack; INVALID_ARGUMENT/FIELD_INVALID when standard input is a
/// terminal or cannot be read; FILE_MALFORMED when it is empty or larger than kInputBytesMax.
/// Threads: any.
absl::StatusOr<LogFile> ReadInput(const std::string& path);

}  // namespace dsg::ingest
