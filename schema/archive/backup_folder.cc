// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/backup_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/file_io.h"
#include "schema/archive/manifest_fields.h"
#include "schema/base/folder_mode.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/files/atomic_file.h"
#include "schema/model/ids.h"

namespace dsg {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

constexpr int kManifestVersion = 1;
constexpr char kDigestLine[] = "sha256 ";
constexpr char kArchiveSuffix[] = ".dsgz";

// Names that cannot lead out of the folder.
bool IsArchiveName(const std::string& name) {
  return name.size() <= 128 && absl::EndsWith(name, kArchiveSuffix) && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' ||
                  c == '-';
         });
}

Json JsonOfEntry(const BackupEntry& entry) {
  return {{"map", entry.map},
          {"file", entry.file},
          {"byte_count", std::to_string(entry.byte_count)},
          {"sha256", ToHex(entry.sha256)},
          {"newest_revision", std::to_string(entry.newest_revision)},
          {"newest_digest", ToHex(entry.newest_digest)},
          {"state", ToHex(entry.state)}};
}

absl::Status DamagedManifest(const std::string& path, const std::string& why) {
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
absl::StatusOr<BackupManifest> DecodedManifest(const std::string& path, std::string_view body) {
  ManifestFields json(body);
  const int version = json.SmallInteger("dsg_backup");
  if (version > kManifestVersion) {
    return MakeError(
        Reason::kFormatTooNew,
        absl::StrCat(path, " is of version ", version, ", and this program reads up to ",
                     kManifestVersion, "; use a newer dsgdb"),
        {{"path", path}, {"format", absl::StrCat(version)}});
  }
  if (version < kManifestVersion) json.Refuse("dsg_backup", "is no version of a backup");
  BackupManifest manifest;
  for (ManifestFields& map : json.Objects("maps")) {
    manifest.maps.push_back(EntryOf(&map));
    if (map.problem().empty()) continue;
    return DamagedManifest(path, absl::StrCat("entry ", manifest.maps.size(), ": ", map.problem()));
  }
  if (!json.problem().empty()) return DamagedManifest(path, json.problem());
  return manifest;
}

constexpr char kManifestName[] = "MANIFEST";
constexpr size_t kManifestBytesMax = size_t{16} << 20;
constexpr size_t kReadBytes = size_t{1} << 20;

std::string ManifestPath(const std::string& folder) {
  return absl::StrCat(folder, "/", kManifestName);
}

// Cuts `end` off; false if the text does not end so.
bool Consume(std::string_view end, std::string_view* text) {
  if (!text->ends_with(end)) return false;
  text->remove_suffix(end.size());
  return true;
}

// "office-r12-" and the first 16 hex digits of a digest.
bool IsMapRevisionDigest(std::string_view stem) {
  constexpr size_t kDigestDigits = 16;
  const size_t mark = stem.rfind("-r");
  if (mark == 0 || mark == std::string_view::npos) return false;
  const std::string_view rest = stem.substr(mark + 2);
  const size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
  return digits > 0 && rest.size() == digits + 1 + kDigestDigits && rest[digits] == '-' &&
         rest.find_first_not_of("0123456789abcdef", digits + 1) == std::string_view::npos;
}

// What this class writes, and what it leaves when it is killed: it is all that a later backup may
// remove. Archives that somebody exported have other names.
bool IsOurs(std::string_view name) {
  const bool is_part = Consume(kPartSuffix, &name);
  if (name == kManifestName) return true;
  if (!Consume(".dsgz", &name)) return false;
  if (Consume(".coming", &name)) return !name.empty();
  return !is_part && IsMapRevisionDigest(name);
}

absl::StatusOr<std::vector<std::string>> NamesIn(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    names.push_back(it->path().filename().string());
  }
  if (error) return SystemError("list", folder, error.value());
  return names;
}

absl::Status CheckIsBackup(const std::string& folder) {
  DSG_ASSIGN_OR_RETURN(const auto names, NamesIn(folder));
  const auto other = std::find_if_not(names.begin(), names.end(), IsOurs);
  if (other == names.end()) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("folder ", folder, " holds \"", *other,
                                "\", which is no part of a backup; name a folder of its own"),
                   {{"path", folder}});
}

std::string ShortHex(const Sha256& digest) { return ToHex(digest).substr(0, 16); }

}  // namespace

const BackupEntry* BackupManifest::Find(std::string_view map) const {
  const auto found = std::find_if(maps.begin(), maps.end(),
                                  [&](const BackupEntry& entry) { return entry.map == map; });
  return found == maps.end() ? nullptr : &*found;
}

std::string EncodeBackupManifest(const BackupManifest& manifest) {
  Json json = {{"dsg_backup", kManifestVersion}, {"maps", Json::array()}};
  for (const BackupEntry& entry : manifest.maps) json["maps"].push_back(JsonOfEntry(entry));
  const std::string text = json.dump(1) + "\n";
  return absl::StrCat(text, kDigestLine, ToHex(ComputeSha256(text)), "\n");
}

absl::StatusOr<BackupManifest> DecodeBackupManifest(const std::string& path,
                                                    std::string_view text) {
  const size_t line_bytes = sizeof(kDigestLine) - 1 + 2 * Sha256().size() + 1;
  if (text.size() < line_bytes) return DamagedManifest(path, "it is too short");
  const std::string_view body = text.substr(0, text.size() - line_bytes);
  if (text.substr(body.size()) != absl::StrCat(kDigestLine, ToHex(ComputeSha256(body)), "\n")) {
    return DamagedManifest(path, "its last line is not the digest of the others");
  }
  DSG_ASSIGN_OR_RETURN(BackupManifest manifest, DecodedManifest(path, body));
  const auto is_before = [](const BackupEntry& a, const BackupEntry& b) { return a.map < b.map; };
  const bool is_in_order = std::is_sorted(manifest.maps.begin(), manifest.maps.end(), is_before) &&
                           std::adjacent_find(manifest.maps.begin(), manifest.maps.end(),
                                              [&](const auto& a, const auto& b) {
                                                return !is_before(a, b);
                                              }) == manifest.maps.end();
  return is_in_order ? absl::StatusOr<BackupManifest>(std::move(manifest))
                     : DamagedManifest(path, "its maps are not in order");
}

absl::StatusOr<BackupManifest> ReadBackupManifest(const std::string& folder) {
  const std::string path = ManifestPath(folder);
  std::error_code error;
  if (!fs::exists(path, error)) {
    return absl::NotFoundError(
        fs::is_directory(folder, error)
            ? absl::StrCat("folder ", folder,
                           " has no MANIFEST, so no backup in it was ever finished; run dsg backup "
                           "again")
            : absl::StrCat("there is no folder ", folder, "; check the path"));
  }
  DSG_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  if (file.byte_count() > static_cast<int64_t>(kManifestBytesMax)) {
    return MakeError(Reason::kStoreCorrupt, absl::StrCat(path, " is too large for a manifest"),
                     {{"path", path}});
  }
  std::string text;
  DSG_RETURN_IF_ERROR(file.Read(kManifestBytesMax, &text));
  return DecodeBackupManifest(path, text);
}

absl::Status CheckBackupFile(const std::string& folder, const BackupEntry& entry,
                             const StopCheck& stop, const Progress& progress) {
  const std::string path = absl::StrCat(folder, "/", entry.file);
  const auto damaged = [&](const std::string& why) {
    return MakeError(Reason::kStoreCorrupt,
                     absl::StrCat(path, " of map \"", entry.map,
                                  "\" is not as the backup's MANIFEST says: ", why,
                                  "; take another copy of this backup"),
                     {{"path", path}, {"map", entry.map}});
  };
  absl::StatusOr<InputFile> file = InputFile::Open(path);
  if (absl::IsNotFound(file.status())) return damaged("it is gone");
  DSG_RETURN_IF_ERROR(file.status());
  if (file->byte_count() != entry.byte_count) {
    return damaged(absl::StrCat("it has ", file->byte_count(), " bytes, not ", entry.byte_count));
  }
  Sha256Stream sha256;
  std::string bytes;
  for (int64_t done = 0; done < entry.byte_count; done += static_cast<int64_t>(bytes.size())) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_RETURN_IF_ERROR(file->Read(kReadBytes, &bytes));
    if (bytes.empty()) return damaged("it ends too early");
    sha256.Add(bytes);
    if (progress) progress(static_cast<double>(done) / static_cast<double>(entry.byte_count));
  }
  if (sha256.Finish() != entry.sha256) return damaged("its SHA-256 is another");
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest archive, ReadArchiveManifest(path));
  const auto differs = [&](const char* field, const auto& said, const auto& found) {
    return damaged(absl::StrCat("its ", field, " is ", found, ", not ", said));
  };
  if (archive.spec.name != entry.map) return differs("map", entry.map, archive.spec.name);
  if (archive.newest_revision != entry.newest_revision) {
    return differs("newest_revision", entry.newest_revision, archive.newest_revision);
  }
  if (archive.newest_digest != entry.newest_digest) {
    return differs("newest_digest", ToHex(entry.newest_digest), ToHex(archive.newest_digest));
  }
  if (archive.state != entry.state) {
    return differs("state", ToHex(entry.state), ToHex(archive.state));
  }
  return absl::OkStatus();
}

absl::StatusOr<BackupFile> BackupFile::Create(const std::string& folder, const std::string& map) {
  DSG_ASSIGN_OR_RETURN(AtomicFile file,
                       AtomicFile::Create(absl::StrCat(folder, "/", map, ".coming.dsgz")));
  return BackupFile(folder, map, std::move(file));
}

absl::Status BackupFile::Write(std::string_view bytes) {
  sha256_.Add(bytes);
  return file_.Write(bytes);
}

absl::StatusOr<BackupEntry> BackupFile::Commit(const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(file_.Commit());
  DSG_ASSIGN_OR_RETURN(const ArchiveManifest archive,
                       ReadArchiveFile(file_.path(), nullptr, stop, nullptr));
  if (archive.spec.name != map_) {
    return MakeError(Reason::kStoreCorrupt,
                     absl::StrCat("the archive of map \"", map_, "\" holds map \"",
                                  archive.spec.name, "\"; back it up again"),
                     {{"map", map_}});
  }
  BackupEntry entry{.map = map_,
                    .byte_count = file_.byte_count(),
                    .sha256 = sha256_.Finish(),
                    .newest_revision = archive.newest_revision,
                    .newest_digest = archive.newest_digest,
                    .state = archive.state};
  // Of its state, so that it never replaces an archive that the last manifest names.
  entry.file =
      absl::StrCat(map_, "-r", entry.newest_revision, "-", ShortHex(archive.state), ".dsgz");
  const std::string path = absl::StrCat(folder_, "/", entry.file);
  if (rename(file_.path().c_str(), path.c_str()) != 0) return SystemError("name", path, errno);
  DSG_RETURN_IF_ERROR(SyncFolder(folder_));
  return entry;
}

absl::StatusOr<std::unique_ptr<BackupFolder>> BackupFolder::Open(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) DSG_RETURN_IF_ERROR(MakePrivateFolder(folder));
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("cannot use ", folder, " as the folder of a backup: ",
                                  std::strerror(errno), "; name another"),
                     {{"path", folder}});
  }
  std::unique_ptr<BackupFolder> made(new BackupFolder(folder, fd));
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    return MakeError(Reason::kWriterLocked,
                     absl::StrCat("another process writes the backup in ", folder,
                                  "; wait for its end, or name another folder"),
                     {{"path", folder}});
  }
  DSG_RETURN_IF_ERROR(CheckIsBackup(folder));
  auto last = ReadBackupManifest(folder);
  if (last.ok()) {
    made->last_ = *std::move(last);
  } else if (!absl::IsNotFound(last.status())) {
    return last.status();
  }
  return made;
}

BackupFolder::~BackupFolder() { close(lock_fd_); }

absl::Status BackupFolder::Finish(const BackupManifest& manifest) {
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(ManifestPath(folder_)));
  DSG_RETURN_IF_ERROR(file.Write(EncodeBackupManifest(manifest)));
  DSG_RETURN_IF_ERROR(file.Commit());
  std::set<std::string> named = {kManifestName};
  for (const BackupEntry& entry : manifest.maps) named.insert(entry.file);
  DSG_ASSIGN_OR_RETURN(const auto names, NamesIn(folder_));
  std::error_code error;
  for (const std::string& name : names) {
    if (!named.contains(name)) fs::remove(absl::StrCat(folder_, "/", name), error);
  }
  return SyncFolder(folder_);
}

}  // namespace dsg
