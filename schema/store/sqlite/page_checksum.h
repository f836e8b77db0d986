// SPDX-License-Identifier: Apache-2.0
// A file layer under SQLite that seals every page of a map with a checksum and never hands out a
// page whose seal is broken. SQLite itself notices few flipped bits, and rows cannot vouch for
// what is missing around them: indexes, R*Trees, counts. And SQLite leaves old bytes in the unused
// middle of pages, where rows have been moved; they are wiped here.
#pragma once

struct sqlite3;

namespace dsg::sqlite {

/// Pages of all maps; the last kPageSealBytes of each hold its checksum.
inline constexpr int kPageBytes = 4096;
inline constexpr int kPageSealBytes = 8;

/// The name of the layer, for sqlite3_open_v2. A page that is not what was written is
/// SQLITE_IOERR_DATA. Files that are no map, or of a newer format, are read as they are, so that
/// they can be refused for what they are.
///
/// Threads: safe from many threads.
const char* SealedFilesName();

/// Makes room for the seal in a database that has no pages yet; false if it cannot be had.
bool ReservePageSeals(sqlite3* db);

}  // namespace dsg::sqlite
