// SPDX-License-Identifier: Apache-2.0
// Who did what to which map: a file of lines that are only ever added, each of which seals those
// before it, so that a line that was changed, moved or taken out shows.
// Refuses to hold what calls said: names of callers, methods and maps, and nothing of people.
//
// A line is a JSON object; its last field is "chain", the HMAC-SHA256 (RFC 2104) over the chain of
// the line before it (64 zeros for the first) and the line's text up to that field. The key is that
// of a file, or empty: then who can write the log can make it anew. Lines that are cut off at the
// end show only to those who noted the chain of a later one.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/base/time.h"

namespace dsg {

struct AuditEntry {
  /// From 1 on; set by Append.
  int64_t number = 0;
  /// By the wall clock, nanoseconds since 1970 UTC.
  TimeNs time_ns = 0;
  /// Empty: nobody knows.
  std::string caller;
  /// Address of the peer.
  std::string peer;
  std::string method;
  /// Empty for calls that name none, or that were refused before they were read.
  std::string map;
  /// Another map that the call names: the one that is merged, the new name. Empty for none.
  std::string other;
  /// "OK", or the name of the status code, "PERMISSION_DENIED"; "BEGUN" before long work.
  std::string code;
  /// That a change made; 0 = none.
  int64_t revision = 0;
  /// Refused calls before this one that stand in no line: there were too many at once.
  int64_t left_out_count = 0;
  /// 64 hexadecimal digits; of what was read.
  std::string chain;
};

/// Where a log ends.
struct AuditHead {
  int64_t entry_count = 0;
  /// 64 hexadecimal digits: the chain of the last line.
  std::string chain;
  /// The last line is not whole: a crash, or a full disk.
  bool has_torn_end = false;
};

/// Reads a whole log; `take`, which may be empty, gets each entry.
///
/// Errors: DATA_LOSS/STORE_CORRUPT naming the line that is not what was written; NOT_FOUND and
/// UNAVAILABLE of the file.
absl::StatusOr<AuditHead> VerifyAuditLog(const std::string& path, std::string_view key,
                                         const std::function<void(const AuditEntry&)>& take = {});

/// The key in a file: all of its bytes, at least 16.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID: it cannot be read, is too short, or others than its
/// owner can use it. An empty path is an empty key.
absl::StatusOr<std::string> ReadAuditKey(const std::string& path);

/// Threads: safe from any thread.
class AuditLog {
 public:
  /// Goes on behind the last line; makes the file, for its user alone, if it is missing. An end
  /// that a crash tore off is cut, if it is the beginning of a line: a file of something else
  /// stays.
  ///
  /// Errors: those of VerifyAuditLog: nothing is added to a log that is not right;
  /// UNAVAILABLE/WRITER_LOCKED if another process has it open.
  static absl::StatusOr<std::unique_ptr<AuditLog>> Open(const std::string& path,
                                                        const std::string& key);
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  /// Adds a line, on disk when this returns if `must_last`.
  ///
  /// Errors: RESOURCE_EXHAUSTED/DISK_FULL; UNAVAILABLE, also when the file is not at its path any
  /// more (IsAtPath); then nothing of the line stays.
  absl::Status Append(AuditEntry entry, bool must_last);

  /// False once it was moved or deleted: then a log is to be opened anew.
  bool IsAtPath() const;

 private:
  AuditLog(std::string path, std::string key, int fd, AuditHead head, int64_t byte_count);

  const std::string path_;
  const std::string key_;
  const int fd_;
  mutable std::mutex mutex_;
  /// Guarded by `mutex_`, as is the file's end.
  AuditHead head_;
  int64_t byte_count_;
};

}  // namespace dsg
