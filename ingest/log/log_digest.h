// SPDX-License-Identifier: Apache-2.0
// The identity of a log of many files: one hash over names and contents, fed piece by piece.
// Refuses to depend on the order or the place of the files.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

struct evp_md_ctx_st;

namespace dsg::ingest {

/// SHA-256 of bytes that come piece by piece.
class Sha256Stream {
 public:
  Sha256Stream();
  void Add(std::string_view bytes);
  /// Hexadecimal; nothing may be added afterwards.
  std::string Hex();

 private:
  std::unique_ptr<evp_md_ctx_st, void (*)(evp_md_ctx_st*)> context_;
};

/// A log of a single file has that file's SHA-256.
class LogDigest {
 public:
  /// `name` is relative to the log.
  void Add(const std::string& name, std::string_view bytes);
  /// For files too large for memory.
  void AddSha256(const std::string& name, const std::string& hex) { parts_[name] = hex; }
  /// For images: hashing gigabytes of pixels at each start would help nobody, since the tables
  /// that name them are hashed whole.
  void AddSize(const std::string& name, uint64_t byte_count);
  /// SHA-256, hexadecimal.
  std::string Hex() const;

 private:
  std::map<std::string, std::string> parts_;
};

/// SHA-256 in hexadecimal of a file of any size, read in small pieces.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID when it cannot be read.
absl::StatusOr<std::string> Sha256OfFile(const std::string& path);

}  // namespace dsg::ingest
