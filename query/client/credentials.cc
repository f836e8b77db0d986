// SPDX-License-Identifier: Apache-2.0
#include "query/client/credentials.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::client {
namespace {

constexpr off_t kFileBytesMax = off_t{1} << 20;

absl::Status BadFile(const std::string& what, const std::string& path, const std::string& why) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat(what, " ", path, ": ", why),
                   {{"field", what}, {"value", path}});
}

absl::StatusOr<std::string> ReadSmallFile(const std::string& what, const std::string& path,
                                          bool is_secret) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0) return BadFile(what, path, std::strerror(errno));
  if (!S_ISREG(found.st_mode)) return BadFile(what, path, "is no file");
  if (is_secret && (found.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return BadFile(what, path,
                   absl::StrCat("others can use it; make it yours alone: chmod 600 ", path));
  }
  if (found.st_size > kFileBytesMax) return BadFile(what, path, "is longer than 1 MiB");
  std::ifstream file(path, std::ios::binary);
  std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file.good() && !file.eof()) return BadFile(what, path, "cannot be read");
  if (content.empty()) return BadFile(what, path, "is empty");
  return content;
}

absl::StatusOr<std::string> ReadToken(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const std::string content,
                       ReadSmallFile("token file", path, /*is_secret=*/true));
  const std::string line(
      absl::StripAsciiWhitespace(absl::string_view(content).substr(0, content.find('\n'))));
  const bool is_word = !line.empty() && std::all_of(line.begin(), line.end(), [](char letter) {
    return absl::ascii_isgraph(static_cast<unsigned char>(letter));
  });
  if (!is_word) return BadFile("token file", path, "its first line is no token");
  return line;
}

}  // namespace

absl::StatusOr<Credentials> ReadCredentials(const CredentialFiles& files) {
  Credentials read;
  if (!files.token.empty()) {
    DSG_ASSIGN_OR_RETURN(read.token, ReadToken(files.token));
  }
  if (files.certificate.empty() != files.key.empty()) {
    const std::string& lone = files.certificate.empty() ? files.key : files.certificate;
    return BadFile("certificate", lone, "give a certificate and its key together");
  }
  if (!files.certificate.empty() && files.authorities.empty()) {
    return BadFile("certificate", files.certificate,
                   "give the authorities that vouch for the server, too: nothing is encrypted "
                   "without them");
  }
  if (!files.authorities.empty()) {
    DSG_ASSIGN_OR_RETURN(read.authorities_pem,
                         ReadSmallFile("authorities", files.authorities, /*is_secret=*/false));
  }
  if (!files.certificate.empty()) {
    DSG_ASSIGN_OR_RETURN(read.certificate_pem,
                         ReadSmallFile("certificate", files.certificate, /*is_secret=*/false));
    DSG_ASSIGN_OR_RETURN(read.key_pem, ReadSmallFile("key", files.key, /*is_secret=*/true));
  }
  return read;
}

}  // namespace dsg::client
