// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/store.h"

#include <algorithm>
#include <filesystem>
#include <mutex>

#include "absl/strings/str_cat.h"
#include "schema/base/folder_mode.h"
#include "schema/base/log.h"
#include "schema/store/sqlite/copy.h"
#include "schema/store/sqlite/map_reader.h"
#include "schema/store/sqlite/upgrade.h"
#include "schema/store/sqlite/whole_maps.h"
#include "schema/store/sqlite/writer.h"

namespace dsg::sqlite {
namespace {

namespace fs = std::filesystem;

class SqliteStore : public GraphStore {
 public:
  SqliteStore(std::string folder, StoreOptions options)
      : folder_(std::move(folder)), options_(std::move(options)) {}

  const std::string& folder() const override { return folder_; }

  absl::StatusOr<std::vector<MapSpec>> ListMaps() override {
    DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, MapNames());
    std::vector<MapSpec> maps;
    for (const std::string& name : names) {
      // Those of older formats too: opening one says how to upgrade it.
      MapSpec spec;
      const auto db = OpenAnyFormat(folder_, name, Database::Mode::kRead, &spec);
      if (!db.ok()) {
        // One map that this program cannot read must not hide the others.
        Log(LogLevel::kWarning, "map-skipped",
            {{"map", name}, {"error", std::string(db.status().message())}});
        continue;
      }
      maps.push_back(std::move(spec));
    }
    return maps;
  }

  absl::StatusOr<std::vector<std::string>> MapNames() override {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
      std::string name = it->path().filename().string();
      std::error_code missing;
      if (IsValidMapName(name) && fs::exists(DatabasePath(folder_, name), missing)) {
        names.push_back(std::move(name));
      }
    }
    if (error) {
      return absl::UnavailableError(
          absl::StrCat("cannot list store ", folder_, ": ", error.message()));
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  int64_t ReusedBytesOnDisk(const std::string& map) const override {
    return LogBytesOnDisk(folder_, map);
  }

  absl::Status CreateMap(const MapSpec& spec) override { return CreateMapFile(folder_, spec); }

  absl::StatusOr<std::shared_ptr<MapReader>> OpenMap(const std::string& name) override {
    DSG_ASSIGN_OR_RETURN(auto reader, SqliteMapReader::Open(folder_, name, options_.cache_bytes));
    return std::shared_ptr<MapReader>(std::move(reader));
  }

  absl::StatusOr<UpgradeReport> UpgradeMap(const std::string& name) override {
    return UpgradeMapFile(folder_, name, options_.program);
  }

  absl::Status InstallMap(const std::string& name, const std::string& file, bool replace) override {
    return InstallMapFile(folder_, name, file, replace, options_.program);
  }

  absl::Status InstallRows(const MapSpec& spec, const RowSource& rows, const std::string& scratch,
                           bool replace, const StopCheck& stop) override {
    const std::string file = scratch + "/graph.db";
    DSG_RETURN_IF_ERROR(MakeMapOfRows(file, spec, rows, stop));
    return InstallMapFile(folder_, spec.name, file, replace, options_.program);
  }

  absl::StatusOr<DropReport> DropMap(const std::string& name,
                                     const MapCondition& condition) override {
    return DropMapFiles(folder_, name, condition, options_.program);
  }

  absl::Status RenameMap(const std::string& from, const std::string& to) override {
    return RenameMapFiles(folder_, from, to, options_.program);
  }

  absl::StatusOr<std::unique_ptr<MapWriter>> OpenWriter(const std::string& name) override {
    DSG_ASSIGN_OR_RETURN(auto writer, SqliteWriter::Open(folder_, name, options_));
    return std::unique_ptr<MapWriter>(std::move(writer));
  }

 private:
  std::string folder_;
  StoreOptions options_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<GraphStore>> OpenSqliteStore(const std::string& folder,
                                                            const StoreOptions& options) {
  std::error_code error;
  // If it fails, the folder is not there.
  if (options.create) MakePrivateFolder(folder).IgnoreError();
  if (!fs::is_directory(folder, error)) {
    return MakeError(Reason::kMapUnknown,
                     absl::StrCat("store folder \"", folder, "\" ",
                                  options.create ? "cannot be made" : "does not exist"),
                     {{"store", folder}});
  }
  // SQLite wants one spelling of a path; a link may also lead to a network file system.
  const std::string canonical = fs::canonical(folder, error).string();
  if (error) {
    return absl::InternalError(absl::StrCat("cannot resolve ", folder, ": ", error.message()));
  }
  DSG_RETURN_IF_ERROR(CheckFileSystem(canonical));
  SettleWholeMaps(canonical);
  return std::unique_ptr<GraphStore>(std::make_unique<SqliteStore>(canonical, options));
}

}  // namespace dsg::sqlite
