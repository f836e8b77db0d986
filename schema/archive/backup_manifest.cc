// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/backup_manifest.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/archive/manifest_fields.h"
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

absl::Status Damaged(const std::string& path, const std::string& why) {
  return MakeError(
      Reason::kStoreCorrupt,
      absl::StrCat(path, " is not as it was written: ", why, "; take another copy of this backup"),
      {{"path", path}});
}

BackupEntry EntryOf(ManifestFields* json) {
  BackupEntry entry;
  entry.map = json->Text("map");
  entry.file = json->Text("file");
  if (!IsValidMapName(entry.map)) json->Refuse("map", "is no name of a map");
  if (!IsArchiveName(entry.file)) json->Refuse("file", "is no name of an archive in this folder");
  entry.byte_count = json->Count("byte_count");
  entry.sha256 = json->Digest("sha256");
  entry.newest_revision = json->Count("newest_revision");
  entry.newest_digest = json->Digest("newest_digest");
  entry.state = json->Digest("state");
  return entry;
}

// Of the body, without the line of its digest.
absl::StatusOr<BackupManifest> ManifestOf(const std::string& path, std::string_view body) {
  ManifestFields json(body);
  const int version = json.SmallInteger("dsg_backup");
  if (version > kVersion) {
    return MakeError(
        Reason::kFormatTooNew,
        absl::StrCat(path, " is of version ", version, ", and this program reads up to ", kVersion,
                     "; use a newer dsgdb"),
        {{"path", path}, {"format", absl::StrCat(version)}});
  }
  if (version < kVersion) json.Refuse("dsg_backup", "is no version of a backup");
  BackupManifest manifest;
  for (ManifestFields& map : json.Objects("maps")) {
    manifest.maps.push_back(EntryOf(&map));
    if (map.problem().empty()) continue;
    return Damaged(path, absl::StrCat("entry ", manifest.maps.size(), ": ", map.problem()));
  }
  if (!json.problem().empty()) return Damaged(path, json.problem());
  return manifest;
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
  DSG_ASSIGN_OR_RETURN(BackupManifest manifest, ManifestOf(path, body));
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
