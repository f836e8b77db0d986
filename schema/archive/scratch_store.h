// SPDX-License-Identifier: Apache-2.0
// A store for a map that is on its way in or out: a hidden folder beside the maps, gone afterwards.
// Those that killed processes have left are removed; those in use are let alone.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace dsg {

/// Removes what killed processes have left in `parent`, whatever it was for. What cannot be removed
/// stays.
void RemoveScratchLeftovers(const std::string& parent);

class ScratchStore {
 public:
  /// Makes `parent`/.`purpose`-N.new. Purposes: archive, restore, dsg-verify.
  /// Errors: RESOURCE_EXHAUSTED/DISK_FULL; UNAVAILABLE with what the system says.
  static absl::StatusOr<std::unique_ptr<ScratchStore>> Make(const std::string& parent,
                                                            const std::string& purpose);
  ~ScratchStore();
  ScratchStore(const ScratchStore&) = delete;
  ScratchStore& operator=(const ScratchStore&) = delete;

  const std::string& folder() const { return folder_; }
  /// The path of a map's file, in a folder that is made for it.
  absl::StatusOr<std::string> MakeMapPath(const std::string& map) const;

 private:
  ScratchStore(std::string folder, int lock_fd) : folder_(std::move(folder)), lock_fd_(lock_fd) {}

  const std::string folder_;
  /// Of the folder itself; its lock says that it is in use.
  const int lock_fd_;
};

}  // namespace dsg
