// SPDX-License-Identifier: Apache-2.0
#include "schema/audit/audit_log.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kKeyBytesMin = 16;
constexpr size_t kKeyBytesMax = 4096;
constexpr size_t kLineBytesMax = 64 << 10;
constexpr std::string_view kChainField = ",\"chain\":\"";
constexpr std::string_view kLineEnd = "\"}";
constexpr size_t kChainDigits = 64;

std::string FirstChain() { return std::string(kChainDigits, '0'); }

std::string ChainOf(std::string_view key, const std::string& before, std::string_view text) {
  const std::string sealed = absl::StrCat(before, absl::string_view(text.data(), text.size()));
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
       reinterpret_cast<const unsigned char*>(sealed.data()), sealed.size(), digest, &size);
  return absl::BytesToHexString(absl::string_view(reinterpret_cast<const char*>(digest), size));
}

// Without the chain, and the brace that closes the object.
std::string TextOf(const AuditEntry& entry) {
  Json line = {{"number", entry.number},   {"time", FormatRfc3339(entry.time_ns)},
               {"time_ns", entry.time_ns}, {"caller", entry.caller},
               {"peer", entry.peer},       {"method", entry.method},
               {"map", entry.map},         {"code", entry.code}};
  if (!entry.other.empty()) line["other"] = entry.other;
  if (entry.revision != 0) line["revision"] = entry.revision;
  if (entry.left_out_count != 0) line["left_out"] = entry.left_out_count;
  // Names of maps that were refused may be any bytes.
  std::string text = line.dump(-1, ' ', true, Json::error_handler_t::replace);
  text.pop_back();
  return text;
}

absl::Status Broken(const std::string& path, int64_t number, const std::string& why) {
  return MakeError(Reason::kStoreCorrupt,
                   absl::StrCat("audit log ", path, ": line ", number, " ", why,
                                "; it, or one before it, is not what was written"),
                   {{"table", "audit"}, {"key", absl::StrCat(number)}});
}

std::string TextField(const Json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_string() ? found->get<std::string>() : std::string();
}

int64_t NumberField(const Json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_number_integer() ? found->get<int64_t>() : 0;
}

// Checks one line, without its newline, and makes it the head.
absl::StatusOr<AuditEntry> TakeLine(const std::string& path, std::string_view key,
                                    std::string_view line, AuditHead* head) {
  const int64_t number = head->entry_count + 1;
  const size_t tail = kChainField.size() + kChainDigits + kLineEnd.size();
  if (line.size() < tail || line.substr(line.size() - kLineEnd.size()) != kLineEnd) {
    return Broken(path, number, "has no chain");
  }
  const std::string_view text = line.substr(0, line.size() - tail);
  if (line.substr(text.size(), kChainField.size()) != kChainField) {
    return Broken(path, number, "has no chain");
  }
  const std::string chain(line.substr(text.size() + kChainField.size(), kChainDigits));
  if (chain != ChainOf(key, head->chain, text)) {
    return Broken(path, number, "has another chain than its key and the lines before it give");
  }
  const Json object = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!object.is_object()) return Broken(path, number, "is no JSON object");
  AuditEntry entry;
  entry.number = NumberField(object, "number");
  if (entry.number != number) return Broken(path, number, "has another number");
  entry.time_ns = NumberField(object, "time_ns");
  entry.caller = TextField(object, "caller");
  entry.peer = TextField(object, "peer");
  entry.method = TextField(object, "method");
  entry.map = TextField(object, "map");
  entry.other = TextField(object, "other");
  entry.code = TextField(object, "code");
  entry.revision = NumberField(object, "revision");
  entry.left_out_count = NumberField(object, "left_out");
  entry.chain = chain;
  head->entry_count = number;
  head->chain = chain;
  return entry;
}

// Whether a line without its end is the beginning of the next one.
bool IsTornLine(const std::string& bytes, int64_t number) {
  const std::string begin = absl::StrCat("{\"number\":", number, ",\"time\":\"");
  const size_t size = std::min(bytes.size(), begin.size());
  return bytes.compare(0, size, begin, 0, size) == 0;
}

absl::Status CheckIsFile(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) == 0 && !S_ISREG(found.st_mode)) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("audit log ", path, " is no plain file; name another"),
                     {{"field", "audit"}, {"value", path}});
  }
  return absl::OkStatus();
}

// The head, and how many bytes whole lines have.
absl::StatusOr<std::pair<AuditHead, int64_t>> ReadLog(
    const std::string& path, std::string_view key,
    const std::function<void(const AuditEntry&)>& take) {
  DSG_RETURN_IF_ERROR(CheckIsFile(path));
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open()) {
    return absl::NotFoundError(
        absl::StrCat("audit log ", path, " cannot be read: ", std::strerror(errno)));
  }
  AuditHead head;
  head.chain = FirstChain();
  int64_t byte_count = 0;
  for (std::string line; std::getline(file, line);) {
    // A last line without its end was torn off.
    head.has_torn_end = file.eof();
    if (head.has_torn_end && !IsTornLine(line, head.entry_count + 1)) {
      return Broken(path, head.entry_count + 1, "is the beginning of no line of such a log");
    }
    if (head.has_torn_end) break;
    if (line.size() > kLineBytesMax) return Broken(path, head.entry_count + 1, "is too long");
    DSG_ASSIGN_OR_RETURN(const AuditEntry entry, TakeLine(path, key, line, &head));
    if (take) take(entry);
    byte_count += static_cast<int64_t>(line.size()) + 1;
  }
  if (file.bad()) return absl::UnavailableError(absl::StrCat("audit log ", path, ": read failed"));
  return std::pair(std::move(head), byte_count);
}

absl::Status WriteError(const std::string& path, int error) {
  const std::string message =
      absl::StrCat("audit log ", path, " cannot be written: ", std::strerror(error));
  if (error != ENOSPC && error != EDQUOT) return absl::UnavailableError(message);
  return MakeError(Reason::kDiskFull, message + "; free some space", {{"path", path}});
}

}  // namespace

absl::StatusOr<AuditHead> VerifyAuditLog(const std::string& path, std::string_view key,
                                         const std::function<void(const AuditEntry&)>& take) {
  DSG_ASSIGN_OR_RETURN(const auto read, ReadLog(path, key, take));
  return read.first;
}

absl::StatusOr<std::string> ReadAuditKey(const std::string& path) {
  if (path.empty()) return std::string();
  const auto refuse = [&](const std::string& why) {
    return MakeError(Reason::kFieldInvalid, absl::StrCat("audit key ", path, ": ", why),
                     {{"field", "audit-key"}, {"value", path}});
  };
  struct stat found {};
  if (stat(path.c_str(), &found) != 0) return refuse(std::strerror(errno));
  if (!S_ISREG(found.st_mode)) return refuse("is no file");
  if (found.st_uid != geteuid() && found.st_uid != 0) {
    return refuse("belongs to another user; make it yours: chown");
  }
  if ((found.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return refuse(absl::StrCat("others can use it; make it yours alone: chmod 600 ", path));
  }
  std::ifstream file(path, std::ios::binary);
  std::string key((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (key.size() < kKeyBytesMin || key.size() > kKeyBytesMax) {
    return refuse(absl::StrCat("has ", key.size(), " bytes; a key has ", kKeyBytesMin, " to ",
                               kKeyBytesMax, ": head -c 32 /dev/urandom > ", path));
  }
  return key;
}

absl::StatusOr<std::unique_ptr<AuditLog>> AuditLog::Open(const std::string& path,
                                                         const std::string& key) {
  // A pipe would wait for its reader.
  DSG_RETURN_IF_ERROR(CheckIsFile(path));
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return WriteError(path, errno);
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    close(fd);
    return MakeError(
        Reason::kWriterLocked,
        absl::StrCat("audit log ", path, " is being written by another server; give each its own"),
        {{"holder", path}});
  }
  auto read = ReadLog(path, key, {});
  const bool is_cut = read.ok() && ftruncate(fd, read->second) == 0;
  if (!is_cut) {
    const int error = errno;
    close(fd);
    return read.ok() ? WriteError(path, error) : read.status();
  }
  return std::unique_ptr<AuditLog>(
      new AuditLog(path, key, fd, std::move(read->first), read->second));
}

AuditLog::AuditLog(std::string path, std::string key, int fd, AuditHead head, int64_t byte_count)
    : path_(std::move(path)),
      key_(std::move(key)),
      fd_(fd),
      head_(std::move(head)),
      byte_count_(byte_count) {}

AuditLog::~AuditLog() { close(fd_); }

absl::Status AuditLog::Append(AuditEntry entry, bool must_last) {
  std::lock_guard lock(mutex_);
  if (!IsAtPath()) {
    return absl::UnavailableError(
        absl::StrCat("audit log ", path_,
                     " was moved or deleted; send the server a SIGHUP to begin another one"));
  }
  entry.number = head_.entry_count + 1;
  const std::string text = TextOf(entry);
  const std::string chain = ChainOf(key_, head_.chain, text);
  const std::string line =
      absl::StrCat(text, std::string(kChainField), chain, std::string(kLineEnd), "\n");
  errno = 0;
  const ssize_t written = pwrite(fd_, line.data(), line.size(), byte_count_);
  if (written != static_cast<ssize_t>(line.size()) || (must_last && fdatasync(fd_) != 0)) {
    // A part that was written has no error of its own.
    const int error = errno == 0 ? ENOSPC : errno;
    // If this fails, the next line is written over it all the same.
    static_cast<void>(ftruncate(fd_, byte_count_) == 0);
    return WriteError(path_, error);
  }
  head_ = {entry.number, chain, false};
  byte_count_ += static_cast<int64_t>(line.size());
  return absl::OkStatus();
}

bool AuditLog::IsAtPath() const {
  struct stat held {};
  struct stat named {};
  return fstat(fd_, &held) == 0 && stat(path_.c_str(), &named) == 0 &&
         held.st_ino == named.st_ino && held.st_dev == named.st_dev;
}

}  // namespace dsg
