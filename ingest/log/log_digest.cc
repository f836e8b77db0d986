// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/log_digest.h"

#include <openssl/evp.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {

Sha256Stream::Sha256Stream() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
  DSG_CHECK(context_ != nullptr);
  DSG_CHECK(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
}

void Sha256Stream::Add(std::string_view bytes) {
  DSG_CHECK(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1);
}

std::string Sha256Stream::Hex() {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  DSG_CHECK(EVP_DigestFinal_ex(context_.get(), digest, &size) == 1);
  return absl::BytesToHexString(absl::string_view(reinterpret_cast<const char*>(digest), size));
}

void LogDigest::Add(const std::string& name, std::string_view bytes) {
  parts_[name] = Sha256Hex(bytes);
}

void LogDigest::AddSize(const std::string& name, uint64_t byte_count) {
  parts_[name] = absl::StrCat("bytes ", byte_count);
}

std::string LogDigest::Hex() const {
  if (parts_.size() == 1) return parts_.begin()->second;
  std::string all;
  for (const auto& [name, part] : parts_) absl::StrAppend(&all, name, "\n", part, "\n");
  return Sha256Hex(all);
}

absl::StatusOr<std::string> Sha256OfFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  Sha256Stream hash;
  std::vector<char> buffer(size_t{1} << 20);
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    hash.Add({buffer.data(), static_cast<size_t>(in.gcount())});
  }
  if (!in.eof()) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(path, ": cannot be read: ", std::strerror(errno)),
                     {{"field", "log"}, {"value", path}});
  }
  return hash.Hex();
}

}  // namespace dsg::ingest
