// SPDX-License-Identifier: Apache-2.0
// One commit while its parts are being applied.
#pragma once

#include "schema/model/layer.h"
#include "schema/store/revision_record.h"
#include "schema/store/sqlite/database.h"
#include "schema/store/touched_keys.h"

namespace dsg::sqlite {

/// `head` begins as a copy of the newest revision, and becomes the next one.
struct CommitContext {
  Database& db;
  const MapSpec& spec;
  RevisionRecord head;
  int64_t delta_checksum = 0;
  /// What has been touched so far.
  TouchedKeys touched = {};

  Revision revision() const { return head.info.revision; }
};

}  // namespace dsg::sqlite
