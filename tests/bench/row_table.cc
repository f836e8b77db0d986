// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/row_table.h"

#include <sqlite3.h>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::bench {
namespace {

// As schema/store/sqlite/database.cc sets them, except for the size of the cache.
constexpr char kPragmas[] =
    "PRAGMA busy_timeout=5000; PRAGMA mmap_size=0; PRAGMA cell_size_check=ON;"
    "PRAGMA temp_store=MEMORY; PRAGMA wal_autocheckpoint=0;";
constexpr char kWritePragmas[] =
    "PRAGMA cache_size=-65536; PRAGMA synchronous=FULL; PRAGMA journal_size_limit=67108864;";

constexpr char kSchema[] =
    "CREATE TABLE agent (id INTEGER PRIMARY KEY) STRICT;"
    "CREATE TABLE pose (agent INTEGER NOT NULL, t INTEGER NOT NULL,"
    " x REAL NOT NULL, y REAL NOT NULL, z REAL NOT NULL,"
    " qx REAL NOT NULL, qy REAL NOT NULL, qz REAL NOT NULL, qw REAL NOT NULL,"
    " PRIMARY KEY (agent, t)) STRICT, WITHOUT ROWID;";

constexpr char kInsert[] = "INSERT INTO pose VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)";
constexpr char kTouch[] = "UPDATE pose SET x = x + 1 WHERE agent = ?1 AND t = ?2";
// One statement and two seeks measured faster than two statements.
constexpr char kBracket[] =
    "SELECT t, x, y, z, qx, qy, qz, qw FROM pose WHERE agent = ?1 AND t >="
    " (SELECT max(t) FROM pose WHERE agent = ?1 AND t <= ?2) ORDER BY t LIMIT 2";
constexpr char kInBox[] =
    "SELECT id FROM agent WHERE EXISTS (SELECT 1 FROM pose WHERE pose.agent = agent.id"
    " AND t >= ?7 AND t < ?8 AND x >= ?1 AND x <= ?2 AND y >= ?3 AND y <= ?4"
    " AND z >= ?5 AND z <= ?6) ORDER BY id";
constexpr char kRange[] =
    "SELECT t, x, y, z, qx, qy, qz, qw FROM pose"
    " WHERE agent = ?1 AND t >= ?2 AND t <= ?3 ORDER BY t";

int64_t AgentKey(NodeId agent) { return static_cast<int64_t>(agent.index()); }

TimedPose PoseOf(sqlite3_stmt* row) {
  TimedPose pose;
  pose.time_ns = sqlite3_column_int64(row, 0);
  for (int i = 0; i < 3; ++i) pose.map_T_agent.position[i] = sqlite3_column_double(row, 1 + i);
  for (int i = 0; i < 4; ++i) {
    pose.map_T_agent.orientation.coeffs()[i] = sqlite3_column_double(row, 4 + i);
  }
  return pose;
}

void Bind(sqlite3_stmt* statement, int index, int64_t value) {
  sqlite3_bind_int64(statement, index, value);
}
void Bind(sqlite3_stmt* statement, int index, double value) {
  sqlite3_bind_double(statement, index, value);
}
template <typename... Values>
void BindAll(sqlite3_stmt* statement, Values... values) {
  int index = 0;
  (Bind(statement, ++index, values), ...);
}

}  // namespace

absl::Status RowTable::Error(const std::string& doing) const {
  return absl::InternalError(absl::StrCat("rival table: ", doing, ": ", sqlite3_errmsg(db_)));
}

absl::Status RowTable::Execute(const std::string& sql) {
  if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) {
    return absl::OkStatus();
  }
  return Error(sql);
}

absl::Status RowTable::Prepare(const char* sql, sqlite3_stmt** statement) {
  if (sqlite3_prepare_v3(db_, sql, -1, SQLITE_PREPARE_PERSISTENT, statement, nullptr) ==
      SQLITE_OK) {
    return absl::OkStatus();
  }
  return Error(sql);
}

absl::Status RowTable::Open(const std::string& folder, bool writable) {
  const std::string path = folder + "/rows.db";
  const int flags = SQLITE_OPEN_NOMUTEX |
                    (writable ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY);
  if (sqlite3_open_v2(path.c_str(), &db_, flags, nullptr) != SQLITE_OK) return Error(path);
  return Execute(kPragmas);
}

absl::StatusOr<std::unique_ptr<RowTable>> RowTable::Create(const std::string& folder,
                                                           int agent_count) {
  std::unique_ptr<RowTable> table(new RowTable());
  DSG_RETURN_IF_ERROR(table->Open(folder, true));
  DSG_RETURN_IF_ERROR(table->Execute("PRAGMA page_size=4096; PRAGMA journal_mode=WAL;"));
  DSG_RETURN_IF_ERROR(table->Execute(kWritePragmas));
  DSG_RETURN_IF_ERROR(table->Execute(kSchema));
  for (int i = 0; i < agent_count; ++i) {
    DSG_RETURN_IF_ERROR(table->Execute(absl::StrCat("INSERT INTO agent VALUES (", i, ")")));
  }
  DSG_RETURN_IF_ERROR(table->Prepare(kInsert, &table->insert_));
  DSG_RETURN_IF_ERROR(table->Prepare(kTouch, &table->touch_));
  return table;
}

absl::StatusOr<std::unique_ptr<RowTable>> RowTable::OpenForReading(const std::string& folder,
                                                                   size_t cache_bytes) {
  std::unique_ptr<RowTable> table(new RowTable());
  DSG_RETURN_IF_ERROR(table->Open(folder, false));
  DSG_RETURN_IF_ERROR(table->Execute(absl::StrCat("PRAGMA cache_size=-", cache_bytes / 1024)));
  DSG_RETURN_IF_ERROR(table->Prepare(kBracket, &table->bracket_));
  DSG_RETURN_IF_ERROR(table->Prepare(kInBox, &table->in_box_));
  DSG_RETURN_IF_ERROR(table->Prepare(kRange, &table->range_));
  return table;
}

RowTable::~RowTable() {
  for (sqlite3_stmt* statement : {insert_, touch_, bracket_, in_box_, range_}) {
    sqlite3_finalize(statement);
  }
  sqlite3_close(db_);
}

absl::Status RowTable::Insert(const std::vector<TrajectoryAppend>& appends) {
  DSG_RETURN_IF_ERROR(Execute("BEGIN IMMEDIATE"));
  for (const TrajectoryAppend& append : appends) {
    for (const TimedPose& pose : append.poses) {
      const Eigen::Vector3d& p = pose.map_T_agent.position;
      const Eigen::Quaterniond& q = pose.map_T_agent.orientation;
      BindAll(insert_, AgentKey(append.agent), pose.time_ns, p.x(), p.y(), p.z(), q.x(), q.y(),
              q.z(), q.w());
      const int code = sqlite3_step(insert_);
      sqlite3_reset(insert_);
      if (code != SQLITE_DONE) return Error(kInsert);
    }
  }
  return Execute("COMMIT");
}

absl::Status RowTable::Checkpoint() {
  if (sqlite3_wal_checkpoint_v2(db_, nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr) ==
      SQLITE_OK) {
    return absl::OkStatus();
  }
  return Error("checkpoint");
}

absl::Status RowTable::Touch(NodeId agent, TimeNs time_ns) {
  BindAll(touch_, AgentKey(agent), time_ns);
  const int code = sqlite3_step(touch_);
  sqlite3_reset(touch_);
  return code == SQLITE_DONE && sqlite3_changes(db_) == 1 ? absl::OkStatus() : Error(kTouch);
}

absl::StatusOr<int64_t> RowTable::ReadAll() {
  sqlite3_stmt* all = nullptr;
  DSG_RETURN_IF_ERROR(Prepare("SELECT count(qw) FROM pose", &all));
  const int64_t count = sqlite3_step(all) == SQLITE_ROW ? sqlite3_column_int64(all, 0) : -1;
  sqlite3_finalize(all);
  if (count < 0) return Error("counting");
  return count;
}

absl::StatusOr<LocatedPose> RowTable::Locate(NodeId agent, TimeNs at_ns) {
  BindAll(bracket_, AgentKey(agent), at_ns);
  TimedPose ends[2];
  int found = 0;
  while (found < 2 && sqlite3_step(bracket_) == SQLITE_ROW) ends[found++] = PoseOf(bracket_);
  sqlite3_reset(bracket_);
  if (found == 0) return absl::OutOfRangeError("no row at or before that time");
  LocatedPose located;
  const TimedPose& from = ends[0];
  located.before_ns = located.after_ns = from.time_ns;
  located.map_T_agent = from.map_T_agent;
  if (from.time_ns == at_ns) return located;
  if (found == 1) return absl::OutOfRangeError("no row after that time");
  const TimedPose& to = ends[1];
  located.after_ns = to.time_ns;
  located.quality = PoseQuality::kInterpolated;
  const double fraction =
      static_cast<double>(at_ns - from.time_ns) / static_cast<double>(to.time_ns - from.time_ns);
  located.map_T_agent = Interpolate(from.map_T_agent, to.map_T_agent, fraction);
  return located;
}

absl::StatusOr<std::vector<NodeId>> RowTable::AgentsInBox(const Box3d& box, TimeNs from_ns,
                                                          TimeNs to_ns) {
  BindAll(in_box_, box.min().x(), box.max().x(), box.min().y(), box.max().y(), box.min().z(),
          box.max().z(), from_ns, to_ns);
  std::vector<NodeId> agents;
  int code = SQLITE_ROW;
  while ((code = sqlite3_step(in_box_)) == SQLITE_ROW) {
    agents.push_back(NodeId('H', static_cast<uint64_t>(sqlite3_column_int64(in_box_, 0))));
  }
  sqlite3_reset(in_box_);
  if (code != SQLITE_DONE) return Error(kInBox);
  return agents;
}

absl::StatusOr<std::vector<TimedPose>> RowTable::Poses(NodeId agent, TimeNs from_ns, TimeNs to_ns) {
  BindAll(range_, AgentKey(agent), from_ns, to_ns);
  std::vector<TimedPose> poses;
  int code = SQLITE_ROW;
  while ((code = sqlite3_step(range_)) == SQLITE_ROW) poses.push_back(PoseOf(range_));
  sqlite3_reset(range_);
  if (code != SQLITE_DONE) return Error(kRange);
  return poses;
}

}  // namespace dsg::bench
