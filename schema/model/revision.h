// SPDX-License-Identifier: Apache-2.0
// The record of one commit.
#pragma once

#include <cstdint>
#include <string>

#include "schema/model/ids.h"
#include "schema/model/node.h"

namespace dsg {

/// One commit.
struct RevisionInfo {
  Revision revision = 0;
  int64_t committed_ns = 0;
  std::string author;
  std::string message;
  std::string session_id;
  int64_t sequence = 0;
  std::string config_digest;
  /// SHA-256 over the parent's digest, this record and the content; equal stores, equal digests.
  Sha256 digest{};
  int64_t node_count = 0;
  int64_t edge_count = 0;
  int64_t agent_count = 0;
  int64_t pose_count = 0;
  int64_t stay_count = 0;
  int64_t mesh_block_count = 0;
};

}  // namespace dsg
