// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/checksum.h"

#include <openssl/sha.h>
#include <xxhash.h>

#include <cstring>

namespace dsg {
namespace {

__extension__ using Uint128 = unsigned __int128;

Uint128 Hash(std::string_view row) {
  const XXH128_hash_t hash = XXH3_128bits(row.data(), row.size());
  return static_cast<Uint128>(hash.high64) << 64 | hash.low64;
}

}  // namespace

int64_t Checksum(std::string_view bytes, uint64_t seed) {
  return static_cast<int64_t>(XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed));
}

void ContentDigest::Add(std::string_view row) {
  const Uint128 sum = (static_cast<Uint128>(high_) << 64 | low_) + Hash(row);
  low_ = static_cast<uint64_t>(sum);
  high_ = static_cast<uint64_t>(sum >> 64);
}

void ContentDigest::Remove(std::string_view row) {
  const Uint128 sum = (static_cast<Uint128>(high_) << 64 | low_) - Hash(row);
  low_ = static_cast<uint64_t>(sum);
  high_ = static_cast<uint64_t>(sum >> 64);
}

ContentDigest& ContentDigest::operator+=(const ContentDigest& other) {
  const Uint128 sum = (static_cast<Uint128>(high_) << 64 | low_) +
                      (static_cast<Uint128>(other.high_) << 64 | other.low_);
  low_ = static_cast<uint64_t>(sum);
  high_ = static_cast<uint64_t>(sum >> 64);
  return *this;
}

ContentDigest& ContentDigest::operator-=(const ContentDigest& other) {
  const Uint128 sum = (static_cast<Uint128>(high_) << 64 | low_) -
                      (static_cast<Uint128>(other.high_) << 64 | other.low_);
  low_ = static_cast<uint64_t>(sum);
  high_ = static_cast<uint64_t>(sum >> 64);
  return *this;
}

std::string ContentDigest::bytes() const {
  std::string out(16, '\0');
  std::memcpy(out.data(), &low_, 8);
  std::memcpy(out.data() + 8, &high_, 8);
  return out;
}

ContentDigest ContentDigest::FromBytes(std::string_view bytes) {
  ContentDigest digest;
  if (bytes.size() == 16) {
    std::memcpy(&digest.low_, bytes.data(), 8);
    std::memcpy(&digest.high_, bytes.data() + 8, 8);
  }
  return digest;
}

Sha256 ComputeSha256(std::string_view bytes) {
  Sha256 digest;
  SHA256(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), digest.data());
  return digest;
}

std::string ToHex(const Sha256& digest) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const uint8_t byte : digest) text.append({kDigits[byte >> 4], kDigits[byte & 15]});
  return text;
}

}  // namespace dsg
