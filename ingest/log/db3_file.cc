// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/db3_file.h"

#include <sqlite3.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

// A path as a URI; "?" and "#" would end it.
std::string UriOf(const std::string& path, bool is_immutable) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    if (c == '?' || c == '#' || c == '%') {
      absl::StrAppend(&uri, c == '?' ? "%3f" : c == '#' ? "%23" : "%25");
    } else {
      uri += c;
    }
  }
  return absl::StrCat(uri, is_immutable ? "?mode=ro&immutable=1" : "?mode=ro");
}

std::string_view TextOf(sqlite3_stmt* statement, int column) {
  const unsigned char* const text = sqlite3_column_text(statement, column);
  if (text == nullptr) return {};
  return {reinterpret_cast<const char*>(text),
          static_cast<size_t>(sqlite3_column_bytes(statement, column))};
}

}  // namespace

// Opens the file and reads its tables into a Db3File.
class Db3File::Reader {
 public:
  explicit Reader(Db3File& bag) : bag_(bag) {}

  absl::Status Read() {
    DSG_RETURN_IF_ERROR(CheckWhole());
    // Nobody writes it, unless the recorder left changes beside it that belong to it.
    const bool is_immutable = IsEmptyOrMissing("-wal") && IsEmptyOrMissing("-journal");
    const int result =
        sqlite3_open_v2(UriOf(bag_.path_, is_immutable).c_str(), &bag_.database_,
                        SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
    if (result != SQLITE_OK) return Fail("cannot be opened");
    sqlite3_db_config(bag_.database_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(bag_.database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_limit(bag_.database_, SQLITE_LIMIT_LENGTH, static_cast<int>(kBagMessageBytesMax));
    DSG_RETURN_IF_ERROR(CheckTable("topics"));
    DSG_RETURN_IF_ERROR(CheckTable("messages"));
    DSG_RETURN_IF_ERROR(ReadTopics());
    DSG_RETURN_IF_ERROR(ReadMessages());
    SortBagMessages(&bag_.messages_);
    return absl::OkStatus();
  }

 private:
  bool IsEmptyOrMissing(const char* ending) const {
    std::error_code error;
    const uintmax_t size = std::filesystem::file_size(bag_.path_ + ending, error);
    return error || size == 0;
  }

  // SQLite takes zeros for what is missing of the last page.
  absl::Status CheckWhole() const {
    std::ifstream in(bag_.path_, std::ios::binary);
    std::string head(18, '\0');
    in.read(head.data(), static_cast<std::streamsize>(head.size()));
    const auto high = static_cast<uint64_t>(static_cast<uint8_t>(head[16]));
    const uint64_t stored = high << 8 | static_cast<uint8_t>(head[17]);
    const uint64_t page_size = stored == 1 ? 65536 : stored;
    std::error_code error;
    const uintmax_t size = std::filesystem::file_size(bag_.path_, error);
    if (in && !error && page_size != 0 && size % page_size == 0) return absl::OkStatus();
    return MalformedFile(bag_.path_, absl::StrCat("has ", size,
                                                  " bytes, which are no whole pages "
                                                  "of SQLite: it was cut short; copy it again"));
  }

  absl::Status Fail(const std::string& what) const {
    return MalformedFile(bag_.path_,
                         absl::StrCat(what, ": SQLite says \"", sqlite3_errmsg(bag_.database_),
                                      "\"; copy the bag again, or run \"ros2 bag "
                                      "reindex\" on its folder"));
  }

  absl::StatusOr<Statement> Prepare(const char* sql) const {
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(bag_.database_, sql, -1, &raw, nullptr) != SQLITE_OK) {
      return Fail("cannot be read");
    }
    return Statement(raw);
  }

  // False at the end.
  absl::StatusOr<bool> Step(const Statement& statement, const std::string& table) const {
    const int result = sqlite3_step(statement.get());
    if (result == SQLITE_ROW) return true;
    if (result == SQLITE_DONE) return false;
    return Fail(absl::StrCat("table ", table, " cannot be read"));
  }

  // A view could compute without end.
  absl::Status CheckTable(const std::string& name) const {
    DSG_ASSIGN_OR_RETURN(
        const Statement statement,
        Prepare("SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = ?1 "
                "AND sql NOT LIKE 'CREATE VIRTUAL%'"));
    sqlite3_bind_text(statement.get(), 1, name.c_str(), -1, SQLITE_TRANSIENT);
    DSG_ASSIGN_OR_RETURN(const bool has_row, Step(statement, "sqlite_schema"));
    if (has_row && sqlite3_column_int64(statement.get(), 0) == 1) return absl::OkStatus();
    return MalformedFile(bag_.path_, absl::StrCat("is an SQLite file without a table ", name,
                                                  ", so it is no bag of ROS 2"));
  }

  absl::Status ReadTopics() {
    DSG_ASSIGN_OR_RETURN(
        const Statement rows,
        Prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id"));
    while (true) {
      DSG_ASSIGN_OR_RETURN(const bool has_row, Step(rows, "topics"));
      if (!has_row) return absl::OkStatus();
      const int64_t id = sqlite3_column_int64(rows.get(), 0);
      const std::string_view encoding = TextOf(rows.get(), 3);
      const auto number = static_cast<uint32_t>(bag_.connections_.size());
      if (!connection_of_.try_emplace(id, number).second) {
        return MalformedFile(bag_.path_, absl::StrCat("table topics has id ", id, " twice"));
      }
      bag_.connections_.push_back({.id = number,
                                   .topic = std::string(TextOf(rows.get(), 1)),
                                   .type = BagTypeName(TextOf(rows.get(), 2), encoding),
                                   .encoding = BagEncoding(encoding)});
    }
  }

  absl::Status ReadMessages() {
    DSG_ASSIGN_OR_RETURN(const Statement rows,
                         Prepare("SELECT rowid, topic_id, timestamp FROM messages"));
    while (true) {
      DSG_ASSIGN_OR_RETURN(const bool has_row, Step(rows, "messages"));
      if (!has_row) return absl::OkStatus();
      const int64_t row = sqlite3_column_int64(rows.get(), 0);
      const int64_t topic = sqlite3_column_int64(rows.get(), 1);
      const auto connection = connection_of_.find(topic);
      if (connection == connection_of_.end()) {
        return MalformedFile(bag_.path_, absl::StrCat("message ", row, " is of topic ", topic,
                                                      ", which table topics does not have"));
      }
      if (sqlite3_column_type(rows.get(), 2) != SQLITE_INTEGER) {
        return MalformedFile(bag_.path_,
                             absl::StrCat("message ", row, " has no time in nanoseconds"));
      }
      if (bag_.messages_.size() == kBagMessagesMax) {
        return MalformedFile(bag_.path_, absl::StrCat("holds more than ", kBagMessagesMax,
                                                      " messages; split it with \"ros2 bag "
                                                      "convert\""));
      }
      ++bag_.connections_[connection->second].message_count;
      bag_.messages_.push_back({.bag_time_ns = sqlite3_column_int64(rows.get(), 2),
                                .connection = connection->second,
                                .chunk = 0,
                                .offset = static_cast<uint64_t>(row)});
    }
  }

  Db3File& bag_;
  std::unordered_map<int64_t, uint32_t> connection_of_;
};

absl::StatusOr<std::shared_ptr<const Db3File>> Db3File::Open(const std::string& path) {
  const std::shared_ptr<Db3File> bag(new Db3File(path));
  DSG_RETURN_IF_ERROR(Reader(*bag).Read());
  return bag;
}

Db3File::~Db3File() { sqlite3_close(database_); }

absl::StatusOr<BagMessage> Db3File::ReadFirst(const BagMessageRef& message,
                                              size_t byte_count_max) const {
  const auto row = static_cast<sqlite3_int64>(message.offset);
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto fail = [&] {
    return MalformedFile(path_, absl::StrCat("message ", row,
                                             " of table messages cannot be read: "
                                             "SQLite says \"",
                                             sqlite3_errmsg(database_), "\"; copy the bag again"));
  };
  sqlite3_blob* raw = nullptr;
  if (sqlite3_blob_open(database_, "main", "messages", "data", row, 0, &raw) != SQLITE_OK) {
    return fail();
  }
  const std::unique_ptr<sqlite3_blob, decltype(&sqlite3_blob_close)> blob(raw, &sqlite3_blob_close);
  const auto size = static_cast<size_t>(sqlite3_blob_bytes(blob.get()));
  if (size > kBagMessageBytesMax) {
    return MalformedFile(path_, absl::StrCat("message ", row, " has ", size, " bytes; at most ",
                                             kBagMessageBytesMax, " are read"));
  }
  std::string bytes(std::min(size, byte_count_max), '\0');
  if (sqlite3_blob_read(blob.get(), bytes.data(), static_cast<int>(bytes.size()), 0) != SQLITE_OK) {
    return fail();
  }
  BagMessage result;
  result.owner = std::make_shared<const std::string>(std::move(bytes));
  result.data = {*result.owner, connections_[message.connection].encoding};
  return result;
}

}  // namespace dsg::ingest
