// SPDX-License-Identifier: Apache-2.0
// The file MANIFEST of a backup: which archives belong to it, and what they are.
// Refuses text that is not wholly as it was written.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/node.h"
#include "schema/model/revision.h"

namespace dsg {

struct BackupEntry {
  std::string map;
  /// In the folder of the manifest.
  std::string file;
  int64_t byte_count = 0;
  /// Of the file.
  Sha256 sha256{};
  Revision newest_revision = 0;
  Sha256 newest_digest{};
  /// As the archive's manifest has it.
  Sha256 state{};
};

struct BackupManifest {
  /// Order: by map, each once.
  std::vector<BackupEntry> maps;

  const BackupEntry* Find(std::string_view map) const;
};

/// JSON, and a last line with its SHA-256.
std::string EncodeBackupManifest(const BackupManifest& manifest);
/// `path` is for errors. Errors: DATA_LOSS/STORE_CORRUPT; FAILED_PRECONDITION/FORMAT_TOO_NEW.
absl::StatusOr<BackupManifest> DecodeBackupManifest(const std::string& path, std::string_view text);

}  // namespace dsg
