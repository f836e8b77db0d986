// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/backup_manifest.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/model/ids.h"

namespace dsg {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr char kDigestLine[] = "sha256 ";
constexpr char kSuffix[] = ".dsgz";

// Names that cannot lead out of the folder.
bool IsArchiveName(const std::string& name) {
  return name.size() <= 128 && absl::EndsWith(name, kSuffix) && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' ||
                  c == '-';
         });
}

Json JsonOf(const BackupEntry& entry) {
  return {{"map", entry.map},
          {"file", entry.file},
          {"byte_count", std::to_string(entry.byte_count)},
          {"sha256", ToHex(entry.sha256)},
          {"newest_revision", std::to_string(entry.newest_revision)},
          {"newest_digest", ToHex(entry.newest_digest)},
          {"state", ToHex(entry.state)}};
}

Sha256 DigestOf(const Json& json, const char* field) {
  const std::string text = json.at(field).get<std::string>();
  Sha256 digest{};
  if (text.size() != 2 * digest.size() ||
      text.find_first_not_of("0123456789abcdef") != std::string::npos) {
    throw std::invalid_argument(field);
  }
  const std::string bytes = absl::HexStringToBytes(text);
  std::copy(bytes.begin(), bytes.end(), digest.begin());
  return digest;
}

int64_t CountOf(const Json& json, const char* field) {
  int64_t value = 0;
  if (!absl::SimpleAtoi(json.at(field).get<std::string>(), &value) || value < 0) {
    throw std::invalid_argument(field);
  }
  return value;
}

// Throws what the parts throw.
BackupEntry EntryOf(const Json& json) {
  BackupEntry entry;
  entry.map = json.at("map").get<std::string>();
  entry.file = json.at("file").get<std::string>();
  if (!IsValidMapName(entry.map)) throw std::invalid_argument("map");
  if (!IsArchiveName(entry.file)) throw std::invalid_argument("file");
  entry.byte_count = CountOf(json, "byte_count");
  entry.sha256 = DigestOf(json, "sha256");
  entry.newest_revision = CountOf(json, "newest_revision");
  entry.newest_digest = DigestOf(json, "newest_digest");
  entry.state = DigestOf(json, "state");
  return entry;
}

absl::Status Damaged(const std::string& path, const std::string& why) {
  return MakeError(
      Reason::kStoreCorrupt,
      absl::StrCat(path, " is not as it was written: ", why, "; take another copy of this backup"),
      {{"path", path}});
}

}  // namespace

const BackupEntry* BackupManifest::Find(std::string_view map) const {
  const auto found = std::find_if(maps.begin(), maps.end(),
                                  [&](const BackupEntry& entry) { return entry.map == map; });
  return found == maps.end() ? nullptr : &*found;
}

std::string EncodeBackupManifest(const BackupManifest& manifest) {
  Json json = {{"dsg_backup", kVersion}, {"maps", Json::array()}};
  for (const BackupEntry& entry : manifest.maps) json["maps"].push_back(JsonOf(entry));
  const std::string text = json.dump(1) + "\n";
  return absl::StrCat(text, kDigestLine, ToHex(ComputeSha256(text)), "\n");
}

absl::StatusOr<BackupManifest> DecodeBackupManifest(const std::string& path,
                                                    std::string_view text) {
  const size_t line_bytes = sizeof(kDigestLine) - 1 + 2 * Sha256().size() + 1;
  if (text.size() < line_bytes) return Damaged(path, "it is too short");
  const std::string_view body = text.substr(0, text.size() - line_bytes);
  if (text.substr(body.size()) != absl::StrCat(kDigestLine, ToHex(ComputeSha256(body)), "\n")) {
    return Damaged(path, "its last line is not the digest of the others");
  }
  BackupManifest manifest;
  try {
    const Json json = Json::parse(body);
    if (json.at("dsg_backup").get<int>() != kVersion) throw std::invalid_argument("dsg_backup");
    for (const Json& entry : json.at("maps")) manifest.maps.push_back(EntryOf(entry));
  } catch (const std::exception& error) {
    return Damaged(path, absl::StrCat("it cannot be read (", error.what(), ")"));
  }
  const auto is_before = [](const BackupEntry& a, const BackupEntry& b) { return a.map < b.map; };
  const bool is_in_order = std::is_sorted(manifest.maps.begin(), manifest.maps.end(), is_before) &&
                           std::adjacent_find(manifest.maps.begin(), manifest.maps.end(),
                                              [&](const auto& a, const auto& b) {
                                                return !is_before(a, b);
                                              }) == manifest.maps.end();
  return is_in_order ? absl::StatusOr<BackupManifest>(std::move(manifest))
                     : Damaged(path, "its maps are not in order");
}

}  // namespace dsg
