// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/page_checksum.h"

#include <sqlite3.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <new>

#include "schema/codec/checksum.h"
#include "schema/store/graph_store.h"
#include "schema/store/sqlite/map_file.h"

namespace dsg::sqlite {
namespace {

constexpr char kName[] = "dsg-sealed";
constexpr int kSealedBytes = kPageBytes - kPageSealBytes;

// An open database. The file of the layer below lies behind it in memory.
struct SealedFile {
  sqlite3_file base;
  /// Not a map of this format: its pages bear no seals of ours.
  bool is_foreign;

  sqlite3_file* below() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};

SealedFile* Sealed(sqlite3_file* file) { return reinterpret_cast<SealedFile*>(file); }
sqlite3_file* Below(sqlite3_file* file) { return Sealed(file)->below(); }
sqlite3_vfs* Below(sqlite3_vfs* vfs) { return static_cast<sqlite3_vfs*>(vfs->pAppData); }

bool IsWholePage(int size, sqlite3_int64 offset) {
  return size == kPageBytes && offset % kPageBytes == 0;
}

// The place is part of it: a right page in the wrong place is wrong.
int64_t SealOf(const char* page, sqlite3_int64 offset) {
  return Checksum({page, kSealedBytes}, static_cast<uint64_t>(offset));
}

bool IsSound(const char* page, sqlite3_int64 offset) {
  int64_t seal = 0;
  std::memcpy(&seal, page + kSealedBytes, sizeof(seal));
  if (seal == SealOf(page, offset)) return true;
  // A free page that was never written is a hole in the file; as a page in use, SQLite finds that
  // zeros are none.
  return seal == 0 && std::all_of(page, page + kPageBytes, [](char c) { return c == 0; });
}

uint32_t BigEndian32(const char* bytes) {
  uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

// Offsets in the header of a database: reserved bytes of a page, user version, application id.
bool IsForeignHeader(const char* page) {
  const bool is_map = BigEndian32(page + 68) == kApplicationId || page[20] == kPageSealBytes;
  // Formats count up by one; a version far off is a damaged header, not the future.
  const uint32_t version = BigEndian32(page + 60);
  const bool is_newer = version > kStoreFormatVersion && version < 10'000;
  return !is_map || is_newer;
}

uint32_t BigEndian16(const char* bytes) {
  return static_cast<uint32_t>(static_cast<uint8_t>(bytes[0]) << 8 |
                               static_cast<uint8_t>(bytes[1]));
}

// Maps of pointers stand at fixed places in files that can shrink: after each comes a page for each
// of its entries of five bytes.
bool IsPointerMap(sqlite3_int64 offset) {
  const sqlite3_int64 number = offset / kPageBytes + 1;
  return number >= 2 && (number - 2) % (kSealedBytes / 5 + 1) == 0;
}

// Other pages begin with the number of a page, if not with zeros: below this size, its first byte
// is none that a page of a tree begins with.
constexpr sqlite3_int64 kPlainFileBytesMax = (sqlite3_int64{1} << 24) * kPageBytes;

// A page of a tree has its header and the places of its cells at the front, and the cells at the
// back. Between them is nothing, but what SQLite left there: zeroes it.
void WipeGap(sqlite3_file* below, char* page, sqlite3_int64 offset) {
  const size_t header = offset == 0 ? 100 : 0;
  const char kind = page[header];
  const bool is_leaf = kind == 10 || kind == 13;
  if ((!is_leaf && kind != 2 && kind != 5) || IsPointerMap(offset)) return;
  sqlite3_int64 size = 0;
  if (below->pMethods->xFileSize(below, &size) != SQLITE_OK || size > kPlainFileBytesMax) return;
  const size_t places = header + (is_leaf ? 8 : 12);
  const size_t count = BigEndian16(page + header + 3);
  const size_t begin = places + 2 * count;
  const size_t end = BigEndian16(page + header + 5);
  if (end > static_cast<size_t>(kSealedBytes) || begin >= end) return;
  for (size_t i = 0; i < count; ++i) {
    const size_t cell = BigEndian16(page + places + 2 * i);
    if (cell < end || cell >= static_cast<size_t>(kSealedBytes)) return;
  }
  std::memset(page + begin, 0, end - begin);
}

int Close(sqlite3_file* file) { return Below(file)->pMethods->xClose(Below(file)); }

int Read(sqlite3_file* file, void* buffer, int size, sqlite3_int64 offset) {
  const int code = Below(file)->pMethods->xRead(Below(file), buffer, size, offset);
  if (code != SQLITE_OK || !IsWholePage(size, offset) || Sealed(file)->is_foreign) return code;
  const char* const page = static_cast<const char*>(buffer);
  if (IsSound(page, offset)) return SQLITE_OK;
  if (offset == 0 && IsForeignHeader(page)) {
    Sealed(file)->is_foreign = true;
    return SQLITE_OK;
  }
  sqlite3_log(SQLITE_IOERR_DATA, "page %lld is not what was written", offset / kPageBytes + 1);
  return SQLITE_IOERR_DATA;
}

int Write(sqlite3_file* file, const void* buffer, int size, sqlite3_int64 offset) {
  if (!IsWholePage(size, offset) || Sealed(file)->is_foreign) {
    return Below(file)->pMethods->xWrite(Below(file), buffer, size, offset);
  }
  char page[kPageBytes];
  std::memcpy(page, buffer, kSealedBytes);
  WipeGap(Below(file), page, offset);
  const int64_t seal = SealOf(page, offset);
  std::memcpy(page + kSealedBytes, &seal, sizeof(seal));
  return Below(file)->pMethods->xWrite(Below(file), page, size, offset);
}

int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  return Below(file)->pMethods->xTruncate(Below(file), size);
}
int Sync(sqlite3_file* file, int flags) { return Below(file)->pMethods->xSync(Below(file), flags); }
int FileSize(sqlite3_file* file, sqlite3_int64* size) {
  return Below(file)->pMethods->xFileSize(Below(file), size);
}
int Lock(sqlite3_file* file, int level) { return Below(file)->pMethods->xLock(Below(file), level); }
int Unlock(sqlite3_file* file, int level) {
  return Below(file)->pMethods->xUnlock(Below(file), level);
}
int CheckReservedLock(sqlite3_file* file, int* is_held) {
  return Below(file)->pMethods->xCheckReservedLock(Below(file), is_held);
}
int FileControl(sqlite3_file* file, int operation, void* argument) {
  return Below(file)->pMethods->xFileControl(Below(file), operation, argument);
}
int SectorSize(sqlite3_file* file) { return Below(file)->pMethods->xSectorSize(Below(file)); }
int DeviceCharacteristics(sqlite3_file* file) {
  return Below(file)->pMethods->xDeviceCharacteristics(Below(file));
}
int ShmMap(sqlite3_file* file, int region, int size, int extend, void volatile** memory) {
  return Below(file)->pMethods->xShmMap(Below(file), region, size, extend, memory);
}
int ShmLock(sqlite3_file* file, int offset, int count, int flags) {
  return Below(file)->pMethods->xShmLock(Below(file), offset, count, flags);
}
void ShmBarrier(sqlite3_file* file) { Below(file)->pMethods->xShmBarrier(Below(file)); }
int ShmUnmap(sqlite3_file* file, int remove) {
  return Below(file)->pMethods->xShmUnmap(Below(file), remove);
}

// Version 2: without memory mapping, which would go around the check.
constexpr sqlite3_io_methods kMethods = {
    2,
    Close,
    Read,
    Write,
    Truncate,
    Sync,
    FileSize,
    Lock,
    Unlock,
    CheckReservedLock,
    FileControl,
    SectorSize,
    DeviceCharacteristics,
    ShmMap,
    ShmLock,
    ShmBarrier,
    ShmUnmap,
    nullptr,
    nullptr,
};

// Logs and temporary files are the business of the layer below: the write-ahead log has checksums
// of its own.
int Open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* flags_out) {
  if ((flags & SQLITE_OPEN_MAIN_DB) == 0) {
    return Below(vfs)->xOpen(Below(vfs), name, file, flags, flags_out);
  }
  SealedFile* const sealed = new (file) SealedFile{};
  const int code = Below(vfs)->xOpen(Below(vfs), name, sealed->below(), flags, flags_out);
  // What has methods is closed by SQLite, also after a failure.
  if (sealed->below()->pMethods != nullptr) sealed->base.pMethods = &kMethods;
  return code;
}

// The layer below with another way to open files. Its other functions do not ask whom they are
// called through.
bool Register() {
  sqlite3_vfs* const below = sqlite3_vfs_find(nullptr);
  if (below == nullptr) return false;
  static sqlite3_vfs vfs = *below;
  vfs.zName = kName;
  vfs.pNext = nullptr;
  vfs.pAppData = below;
  vfs.szOsFile = static_cast<int>(sizeof(SealedFile)) + below->szOsFile;
  vfs.xOpen = Open;
  return sqlite3_vfs_register(&vfs, /*makeDflt=*/0) == SQLITE_OK;
}

}  // namespace

const char* SealedFilesName() {
  // If it fails, opening will: there is no layer of that name then.
  static const bool is_registered = Register();
  static_cast<void>(is_registered);
  return kName;
}

bool ReservePageSeals(sqlite3* db) {
  int bytes = kPageSealBytes;
  return sqlite3_file_control(db, "main", SQLITE_FCNTL_RESERVE_BYTES, &bytes) == SQLITE_OK;
}

}  // namespace dsg::sqlite
