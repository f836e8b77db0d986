// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/file_bytes.h"

#include <openssl/evp.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {

absl::Status MalformedFile(const std::string& path, const std::string& message) {
  return MakeError(Reason::kFileMalformed, absl::StrCat(path, ": ", message), {{"file", path}});
}

bool IsFile(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

absl::StatusOr<LogFile> ReadLogFile(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    return absl::NotFoundError(absl::StrCat("\"", path, "\" does not exist; check the path"));
  }
  if (status.type() != fs::file_type::regular) {
    return MalformedFile(path, "is not a regular file; give a log file or folder");
  }
  std::ifstream in(path, std::ios::binary);
  LogFile file;
  file.path = path;
  file.name = fs::path(path).filename().string();
  const uintmax_t size = fs::file_size(path, error);
  if (in && !error) {
    file.bytes.resize(size);
    in.read(file.bytes.data(), static_cast<std::streamsize>(size));
    file.bytes.resize(static_cast<size_t>(in.gcount()));
  }
  if (!in || error) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(path, ": cannot be read: ", std::strerror(errno)),
                     {{"field", "log"}, {"value", path}});
  }
  if (file.bytes.empty()) {
    return MalformedFile(path, "is empty; was the recording or the copy cut short?");
  }
  return file;
}

std::string Sha256Hex(std::string_view bytes) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  DSG_CHECK(EVP_Digest(bytes.data(), bytes.size(), digest, &size, EVP_sha256(), nullptr) == 1);
  return absl::BytesToHexString(absl::string_view(reinterpret_cast<const char*>(digest), size));
}

std::string ContentSha256(const std::vector<const LogFile*>& files) {
  if (files.size() == 1) return Sha256Hex(files.front()->bytes);
  std::string parts;
  for (const LogFile* file : files) {
    absl::StrAppend(&parts, file->name, "\n", file->bytes.size(), "\n", Sha256Hex(file->bytes),
                    "\n");
  }
  return Sha256Hex(parts);
}

LogInfo DescribeLog(std::string_view format, const LogFile& file) {
  LogInfo info;
  info.format = format;
  info.path = file.path;
  info.content_sha256 = ContentSha256({&file});
  return info;
}

LogInfo DescribeTextLog(std::string_view format, const LogFile& file) {
  LogInfo info = DescribeLog(format, file);
  if (!file.bytes.ends_with('\n')) {
    info.notes.push_back(
        "the last line has no end; if the copy was cut, its last number may be cut too");
  }
  return info;
}

}  // namespace dsg::ingest
