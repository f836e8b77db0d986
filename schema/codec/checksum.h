// SPDX-License-Identifier: Apache-2.0
// Checksums of stored bytes and the additive content digest of a map.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "schema/model/node.h"

namespace dsg {

/// XXH3 of the bytes, seeded, so that equal bytes under different keys differ.
int64_t Checksum(std::string_view bytes, uint64_t seed = 0);

/// A 128-bit sum of row hashes modulo 2^128. Adding and removing rows in any order gives the same
/// digest for the same set of rows, so a revision's digest costs only its own change, and a scan
/// of all rows with their revisions re-derives the digest of every revision (ADR 0002).
/// Detects accidents, not forgery.
class ContentDigest {
 public:
  void Add(std::string_view row);
  void Remove(std::string_view row);
  ContentDigest& operator+=(const ContentDigest& other);
  ContentDigest& operator-=(const ContentDigest& other);

  /// 16 bytes.
  std::string bytes() const;
  static ContentDigest FromBytes(std::string_view bytes);
  bool operator==(const ContentDigest&) const = default;

 private:
  uint64_t low_ = 0;
  uint64_t high_ = 0;
};

Sha256 ComputeSha256(std::string_view bytes);
std::string ToHex(const Sha256& digest);

}  // namespace dsg
