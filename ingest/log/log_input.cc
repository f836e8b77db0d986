// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/log_input.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/packed_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr char kInputName[] = "standard input";

absl::Status Unreadable(const std::string& why) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat(kInputName, ": ", why),
                   {{"field", "log"}, {"value", "-"}});
}

absl::StatusOr<std::string> ReadToEnd() {
  if (isatty(STDIN_FILENO) == 1) {
    return Unreadable("is a terminal; pipe a log into it, as in: zcat log.gz | dsg-ingest ... -");
  }
  std::string bytes;
  size_t done = 0;
  while (true) {
    if (done == bytes.size()) bytes.resize(std::max(size_t{65536}, 2 * bytes.size()));
    const ssize_t count = read(STDIN_FILENO, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return Unreadable(absl::StrCat("cannot be read: ", std::strerror(errno)));
    if (count == 0) break;
    done += static_cast<size_t>(count);
    if (done > kInputBytesMax) {
      return MalformedFile(kInputName, absl::StrCat("gives more than ", kInputBytesMax >> 20,
                                                    " MiB; save it and give the file"));
    }
  }
  bytes.resize(done);
  if (bytes.empty()) {
    return MalformedFile(kInputName, "is empty; did the program before the pipe fail?");
  }
  return bytes;
}

absl::StatusOr<std::string> InputBytes() {
  static std::mutex mutex;
  static auto* const kept = new std::optional<std::string>();
  const std::lock_guard<std::mutex> lock(mutex);
  if (!kept->has_value()) {
    DSG_ASSIGN_OR_RETURN(*kept, ReadToEnd());
  }
  return **kept;
}

}  // namespace

absl::StatusOr<LogFile> ReadInput(const std::string& path) {
  LogFile file;
  if (path == kStandardInput) {
    file.path = kInputName;
    file.name = kInputName;
    DSG_ASSIGN_OR_RETURN(file.bytes, InputBytes());
  } else {
    DSG_ASSIGN_OR_RETURN(file, ReadLogFile(path));
  }
  if (IsPacked(file.bytes)) {
    DSG_ASSIGN_OR_RETURN(file.bytes, Unpack(file.bytes, file.path, kInputBytesMax));
  }
  return file;
}

}  // namespace dsg::ingest
