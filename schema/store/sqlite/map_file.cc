// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/map_file.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/folder_mode.h"
#include "schema/base/time.h"
#include "schema/model/edge.h"
#include "schema/store/graph_store.h"
#include "schema/store/sqlite/stream_in.h"
#include "schema/store/sqlite/whole_maps.h"

namespace dsg::sqlite {

extern const char kInitSql[];
extern const char kLongLivedSql[];
extern const char kIdentitySql[];

namespace {

namespace fs = std::filesystem;

// How those name themselves in a lock who make a map, drop or rename it, and how long that takes at
// most.
constexpr char kCreator[] = "create";
constexpr std::array<const char*, 3> kBriefHolders = {kCreator, "drop by ", "rename by "};
constexpr std::chrono::seconds kBriefWorkMax{10};

std::string Errno() { return std::strerror(errno); }

// Who holds the lock of that file; empty while it has not said so.
std::string ReadHolder(int fd) {
  char text[256] = {};
  const ssize_t size = pread(fd, text, sizeof(text) - 1, 0);
  std::string holder(text, static_cast<size_t>(size > 0 ? size : 0));
  if (!holder.empty() && holder.back() == '\n') holder.pop_back();
  return holder;
}

// Who does brief work is done in a moment; who has no name yet may be such a one.
bool IsBrief(const std::string& holder) {
  return holder.empty() ||
         std::any_of(kBriefHolders.begin(), kBriefHolders.end(),
                     [&](const char* brief) { return holder.rfind(brief, 0) == 0; });
}

// Whether a file is the one of that name.
bool IsAtPath(const struct stat& file, const std::string& path) {
  struct stat named {};
  return stat(path.c_str(), &named) == 0 && file.st_dev == named.st_dev &&
         file.st_ino == named.st_ino;
}

bool IsAtPath(int fd, const std::string& path) {
  struct stat file {};
  return fstat(fd, &file) == 0 && IsAtPath(file, path);
}

int64_t SizeOf(const std::string& path) {
  struct stat info {};
  return stat(path.c_str(), &info) == 0 ? info.st_size : 0;
}

absl::Status FillNewDatabase(Database& db, const MapSpec& spec) {
  DSG_RETURN_IF_ERROR(db.Execute("BEGIN IMMEDIATE"));
  DSG_RETURN_IF_ERROR(db.Execute(kInitSql));
  DSG_RETURN_IF_ERROR(db.Execute(kLongLivedSql));
  DSG_RETURN_IF_ERROR(db.Execute(kIdentitySql));
  DSG_RETURN_IF_ERROR(Query(db,
                            "INSERT INTO map (id, name, frame, epoch_ns, clock, codec, gap_ns_max,"
                            " mesh_block_size_m, incarnation)"
                            " VALUES (1, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)")
                          .Bind(spec.name, spec.frame, spec.epoch_ns, static_cast<int>(spec.clock),
                                static_cast<int>(spec.codec), spec.gap_ns_max,
                                spec.mesh_block_size_m, NewIncarnation())
                          .Run());
  for (const Layer& layer : DefaultLayers()) {
    DSG_RETURN_IF_ERROR(
        Query(db, "INSERT INTO layer (id, name, rank, rev_from) VALUES (?1, ?2, ?3, 0)")
            .Bind(layer.id, layer.name, layer.rank)
            .Run());
  }
  DSG_RETURN_IF_ERROR(db.Execute(absl::StrCat("PRAGMA application_id=", kApplicationId,
                                              "; PRAGMA user_version=", kStoreFormatVersion, ";")
                                     .c_str()));
  return db.Execute("COMMIT");
}

// A map, of a format that this program knows.
absl::Status CheckKnownFormat(Database& db, const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const int64_t application_id, db.QueryInt("PRAGMA application_id"));
  if (application_id != kApplicationId) {
    return MakeError(Reason::kNotAStore,
                     absl::StrCat(path, " is not a dsg map (application id ", application_id,
                                  "); point --store at a folder made by dsg-ingest or dsg import"),
                     {{"map", db.map_name()}});
  }
  DSG_ASSIGN_OR_RETURN(const int64_t version, db.QueryInt("PRAGMA user_version"));
  if (version > kStoreFormatVersion) {
    return MakeError(Reason::kFormatTooNew,
                     absl::StrCat(path, " has format ", version, ", and this program reads up to ",
                                  kStoreFormatVersion, "; use a newer dsgdb"),
                     {{"map", db.map_name()}, {"format", absl::StrCat(version)}});
  }
  return absl::OkStatus();
}

absl::Status CheckNewestFormat(Database& db, const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const int64_t version, db.QueryInt("PRAGMA user_version"));
  if (version < kStoreFormatVersion) {
    return MakeError(
        Reason::kFormatTooOld,
        absl::StrCat(path, " has format ", version, ", and this program needs ",
                     kStoreFormatVersion, "; run `dsg upgrade`, which keeps a copy of the old"),
        {{"map", db.map_name()}, {"format", absl::StrCat(version)}});
  }
  return absl::OkStatus();
}

absl::Status CheckFile(const std::string& path, const struct stat& info, const std::string& map) {
  if (!S_ISREG(info.st_mode)) {
    return MakeError(Reason::kNotAStore, absl::StrCat(path, " is not a file"), {{"map", map}});
  }
  if (info.st_nlink > 1) {
    return MakeError(Reason::kNotAStore,
                     absl::StrCat(path,
                                  " has a second hard link; two names for one database lose "
                                  "its locks, so remove the other"),
                     {{"map", map}});
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<Database>> OpenThere(const std::string& store_folder,
                                                    const std::string& map, Database::Mode mode,
                                                    MapSpec* spec) {
  const std::string path = DatabasePath(store_folder, map);
  DSG_ASSIGN_OR_RETURN(auto db, Database::Open(path, mode, map));
  DSG_RETURN_IF_ERROR(CheckKnownFormat(*db, path));
  DSG_ASSIGN_OR_RETURN(MapSpec found, ReadMapSpec(*db));
  if (found.name == map) {
    if (spec != nullptr) *spec = std::move(found);
    return db;
  }
  if (IsBeingRenamed(store_folder, map, found.name)) {
    // Unless somebody does it at this moment, it was killed.
    db.reset();
    SettleWholeMaps(store_folder);
    return UnknownMapError(map, store_folder);
  }
  return MakeError(
      Reason::kNotAStore,
      absl::StrCat("folder ", MapFolder(store_folder, map), " holds map \"", found.name,
                   "\"; a map cannot be copied under another name, rename the folder back"),
      {{"map", map}});
}

}  // namespace

absl::Status SyncFolder(const std::string& folder) {
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = fd >= 0 && fsync(fd) == 0;
  if (fd >= 0) close(fd);
  if (synced) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("cannot sync folder ", folder, ": ", Errno()));
}

absl::Status SyncFile(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = fd >= 0 && fsync(fd) == 0;
  if (fd >= 0) close(fd);
  if (synced) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("cannot sync ", path, ": ", Errno()));
}

absl::Status CheckFormat(Database& db) {
  DSG_RETURN_IF_ERROR(CheckKnownFormat(db, db.path()));
  return CheckNewestFormat(db, db.path());
}

std::string MapFolder(const std::string& store_folder, const std::string& map) {
  return absl::StrCat(store_folder, "/", map);
}

std::string DatabasePath(const std::string& store_folder, const std::string& map) {
  return absl::StrCat(MapFolder(store_folder, map), "/graph.db");
}

absl::Status CheckFileSystem(const std::string& folder) {
  struct statfs info {};
  if (statfs(folder.c_str(), &info) != 0) {
    return MakeError(Reason::kMapUnknown,
                     absl::StrCat("store folder ", folder, " cannot be read: ", Errno()),
                     {{"store", folder}});
  }
  constexpr unsigned kNfs = NFS_SUPER_MAGIC;
  constexpr unsigned kSmb = SMB_SUPER_MAGIC;
  constexpr unsigned kSmb2 = 0xfe534d42;
  constexpr unsigned kCifs = 0xff534d42;
  constexpr unsigned k9p = V9FS_MAGIC;
  const auto type = static_cast<unsigned>(info.f_type);
  if (type != kNfs && type != kSmb && type != kSmb2 && type != kCifs && type != k9p) {
    return absl::OkStatus();
  }
  return MakeError(Reason::kNetworkFileSystem,
                   absl::StrCat("store folder ", folder,
                                " is on a network file system, where a crash can corrupt it; "
                                "keep the store on a local disk and reach it through dsg-server"),
                   {{"store", folder}});
}

absl::Status CreateMapFile(const std::string& store_folder, const MapSpec& spec) {
  DSG_RETURN_IF_ERROR(spec.Validate());
  const std::string folder = MapFolder(store_folder, spec.name);
  const std::string path = DatabasePath(store_folder, spec.name);
  const absl::Status exists = MapExistsError(spec.name);
  std::error_code error;
  if (fs::exists(path, error)) return exists;
  // Two processes may create the same map at once: the lock decides, the loser sees it exists.
  const auto lock = LockNewMap(store_folder, spec.name, kCreator);
  if (fs::exists(path, error)) return exists;
  DSG_RETURN_IF_ERROR(lock.status());
  const std::string partial = path + ".new";
  for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(partial + suffix, error);
  {
    DSG_ASSIGN_OR_RETURN(const auto db,
                         Database::Open(partial, Database::Mode::kCreate, spec.name));
    DSG_RETURN_IF_ERROR(FillNewDatabase(*db, spec));
    // A full disk may show only here; half a map must not get the name of a whole one.
    if (!db->Checkpoint(/*truncate=*/true)) return db->Error("completing the new map");
  }
  fs::rename(partial, path, error);
  if (error) {
    return absl::InternalError(absl::StrCat("cannot name ", path, ": ", error.message()));
  }
  DSG_RETURN_IF_ERROR(SyncFolder(folder));
  return SyncFolder(store_folder);
}

absl::Status MakeMapOfRows(const std::string& file, const MapSpec& spec, const RowSource& rows,
                           const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(spec.Validate());
  DSG_ASSIGN_OR_RETURN(const auto db, Database::Open(file, Database::Mode::kCreate, spec.name));
  DSG_RETURN_IF_ERROR(FillNewDatabase(*db, spec));
  DSG_RETURN_IF_ERROR(CollectRows(*db, spec, rows, stop));
  if (db->Checkpoint(/*truncate=*/true)) return absl::OkStatus();
  return db->Error("completing the map of rows");
}

absl::StatusOr<std::unique_ptr<Database>> OpenMapFile(const std::string& store_folder,
                                                      const std::string& map, Database::Mode mode,
                                                      MapSpec* spec) {
  DSG_ASSIGN_OR_RETURN(auto db, OpenAnyFormat(store_folder, map, mode, spec));
  DSG_RETURN_IF_ERROR(CheckNewestFormat(*db, db->path()));
  return db;
}

absl::StatusOr<std::unique_ptr<Database>> OpenAnyFormat(const std::string& store_folder,
                                                        const std::string& map, Database::Mode mode,
                                                        MapSpec* spec) {
  DSG_RETURN_IF_ERROR(CheckMapName(map));
  const std::string path = DatabasePath(store_folder, map);
  for (;;) {
    struct stat info {};
    if (stat(path.c_str(), &info) != 0) return UnknownMapError(map, store_folder);
    DSG_RETURN_IF_ERROR(CheckFile(path, info, map));
    absl::StatusOr<std::unique_ptr<Database>> db = OpenThere(store_folder, map, mode, spec);
    // The map may be dropped, renamed or replaced between the opening of its file and of its log,
    // which then is of another file.
    if (IsAtPath(info, path)) return db;
  }
}

absl::StatusOr<MapSpec> ReadMapSpec(Database& db) {
  Query query(db,
              "SELECT name, frame, epoch_ns, clock, codec, gap_ns_max, mesh_block_size_m FROM map");
  if (!query.Next()) {
    DSG_RETURN_IF_ERROR(query.status());
    return MakeError(Reason::kStoreCorrupt, "map \"" + db.map_name() + "\" has no map record",
                     {{"map", db.map_name()}, {"table", "map"}});
  }
  MapSpec spec;
  spec.name = query.Text(0);
  spec.frame = query.Text(1);
  spec.epoch_ns = query.Int(2);
  spec.clock = static_cast<Clock>(query.Int(3));
  spec.codec = static_cast<TrajectoryCodec>(query.Int(4));
  spec.gap_ns_max = query.Int(5);
  spec.mesh_block_size_m = query.Real(6);
  return spec;
}

std::string NewIncarnation() {
  uint64_t bits[2] = {};
  // Fails only before a machine has gathered any randomness; then the clock must do.
  if (getrandom(bits, sizeof(bits), 0) != sizeof(bits))
    bits[0] = static_cast<uint64_t>(WallClockNs());
  return absl::StrFormat("%016x%016x", bits[0], bits[1]);
}

absl::StatusOr<std::string> ReadIncarnation(Database& db) {
  Query query(db, "SELECT incarnation FROM map");
  const bool found = query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found ? std::string(query.Text(0)) : std::string();
}

std::optional<FileIdentity> IdentityOf(const std::string& store_folder, const std::string& map) {
  struct stat info {};
  if (stat(DatabasePath(store_folder, map).c_str(), &info) != 0) return std::nullopt;
  return FileIdentity{info.st_dev, info.st_ino};
}

int64_t BytesOnDisk(const std::string& store_folder, const std::string& map) {
  const std::string folder = MapFolder(store_folder, map);
  return SizeOf(folder + "/graph.db") + SizeOf(folder + "/graph.db-wal") +
         SizeOf(folder + "/writer.lock");
}

int64_t LogBytesOnDisk(const std::string& store_folder, const std::string& map) {
  return SizeOf(MapFolder(store_folder, map) + "/graph.db-wal");
}

std::vector<std::string> ListOtherFiles(const std::string& store_folder, const std::string& map) {
  constexpr std::string_view kOwn[] = {"graph.db", "graph.db-wal", "graph.db-shm", "writer.lock",
                                       "reserve"};
  std::vector<std::string> others;
  std::error_code error;
  const auto list = [&](const std::string& folder, const auto& is_other) {
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      if (is_other(it->path().filename().string())) others.push_back(it->path().string());
    }
  };
  list(MapFolder(store_folder, map), [&](const std::string& name) {
    return std::find(std::begin(kOwn), std::end(kOwn), name) == std::end(kOwn);
  });
  list(store_folder, [](const std::string& name) { return name.front() == '.'; });
  std::sort(others.begin(), others.end());
  return others;
}

absl::StatusOr<std::unique_ptr<WriterLock>> WriterLock::Acquire(const std::string& store_folder,
                                                                const std::string& map,
                                                                const std::string& program) {
  const std::string path = MapFolder(store_folder, map) + "/writer.lock";
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW,
                      FileModeIn(MapFolder(store_folder, map)));
  if (fd < 0) {
    if (errno == ENOENT) return UnknownMapError(map, store_folder);
    return MakeError(Reason::kReadOnly, absl::StrCat("cannot open ", path, ": ", Errno()),
                     {{"map", map}});
  }
  std::unique_ptr<WriterLock> lock(new WriterLock(fd));
  const auto give_up = std::chrono::steady_clock::now() + kBriefWorkMax;
  while (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    const std::string holder = ReadHolder(fd);
    if (IsBrief(holder) && std::chrono::steady_clock::now() < give_up) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      continue;
    }
    const std::string named = holder.empty() ? "another process" : holder;
    return MakeError(Reason::kWriterLocked,
                     absl::StrCat("map \"", map, "\" is being written by ", named,
                                  "; a map has one writer at a time: stop it, or write through it "
                                  "with --server"),
                     {{"map", map}, {"holder", named}});
  }
  // The map was dropped or renamed before it was locked: what is locked is no map's any more.
  if (!IsAtPath(fd, path)) return Acquire(store_folder, map, program);
  const std::string holder = absl::StrCat(program, " (process ", getpid(), ")\n");
  const bool named = ftruncate(fd, 0) == 0 && pwrite(fd, holder.data(), holder.size(), 0) ==
                                                  static_cast<ssize_t>(holder.size());
  // The lock holds even if the disk is too full for the name; only the message suffers.
  static_cast<void>(named);
  return lock;
}

WriterLock::~WriterLock() { close(fd_); }

absl::StatusOr<std::unique_ptr<WriterLock>> LockNewMap(const std::string& store_folder,
                                                       const std::string& map,
                                                       const std::string& program) {
  const std::string folder = MapFolder(store_folder, map);
  for (;;) {
    if (mkdir(folder.c_str(), FolderModeIn(store_folder)) != 0 && errno != EEXIST) {
      return absl::InternalError(absl::StrCat("cannot make ", folder, ": ", Errno()));
    }
    auto lock = WriterLock::Acquire(store_folder, map, program);
    // Somebody has dropped a map of that name in between, and its folder with it.
    if (ReasonOf(lock.status()) != Reason::kMapUnknown) return lock;
  }
}

}  // namespace dsg::sqlite
