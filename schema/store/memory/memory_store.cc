// SPDX-License-Identifier: Apache-2.0
#include "schema/store/memory/memory_store.h"

#include <map>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/store/memory/map_stream.h"
#include "schema/store/memory/memory_reader.h"
#include "schema/store/memory/memory_writer.h"

namespace dsg::memory {
namespace {

struct Maps {
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<MapRows>> by_name;
};

// Stores that somebody has open.
class Registry {
 public:
  static Registry& Get() {
    static Registry* const registry = new Registry();
    return *registry;
  }

  /// Null if it is not there and not to be made.
  std::shared_ptr<Maps> Open(const std::string& name, bool create) {
    const std::lock_guard lock(mutex_);
    std::erase_if(stores_, [](const auto& store) { return store.second.expired(); });
    auto maps = stores_[name].lock();
    if (maps == nullptr && create) {
      maps = std::make_shared<Maps>();
      stores_[name] = maps;
    }
    return maps;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<Maps>> stores_;
};

class MemoryStore : public GraphStore {
 public:
  MemoryStore(const std::string& name, StoreOptions options, std::shared_ptr<Maps> maps)
      : location_("memory:" + name), options_(std::move(options)), maps_(std::move(maps)) {}

  const std::string& folder() const override { return folder_; }

  absl::StatusOr<std::vector<MapSpec>> ListMaps() override {
    const std::lock_guard lock(maps_->mutex);
    std::vector<MapSpec> specs;
    for (const auto& [name, rows] : maps_->by_name) specs.push_back(rows->spec);
    return specs;
  }

  absl::StatusOr<std::vector<std::string>> MapNames() override {
    const std::lock_guard lock(maps_->mutex);
    std::vector<std::string> names;
    for (const auto& [name, rows] : maps_->by_name) names.push_back(name);
    return names;
  }

  int64_t ReusedBytesOnDisk(const std::string& /*map*/) const override { return 0; }

  absl::Status CreateMap(const MapSpec& spec) override {
    DSG_RETURN_IF_ERROR(spec.Validate());
    const std::lock_guard lock(maps_->mutex);
    auto& rows = maps_->by_name[spec.name];
    if (rows != nullptr) return MapExistsError(spec.name);
    rows = std::make_shared<MapRows>(spec);
    return absl::OkStatus();
  }

  absl::StatusOr<std::shared_ptr<MapReader>> OpenMap(const std::string& name) override {
    DSG_ASSIGN_OR_RETURN(auto rows, Find(name));
    return std::shared_ptr<MapReader>(std::make_shared<MemoryReader>(std::move(rows)));
  }

  absl::StatusOr<std::unique_ptr<MapWriter>> OpenWriter(const std::string& name) override {
    DSG_ASSIGN_OR_RETURN(auto rows, Find(name));
    DSG_ASSIGN_OR_RETURN(auto writer, MemoryWriter::Open(rows, options_.program));
    // The map may have been dropped, renamed or replaced before it was locked.
    DSG_ASSIGN_OR_RETURN(const auto now, Find(name));
    if (now != rows) return OpenWriter(name);
    return std::unique_ptr<MapWriter>(std::move(writer));
  }

  absl::StatusOr<DropReport> DropMap(const std::string& name,
                                     const MapCondition& condition) override {
    DSG_RETURN_IF_ERROR(CheckMapName(name));
    const std::lock_guard lock(maps_->mutex);
    const auto found = maps_->by_name.find(name);
    if (found == maps_->by_name.end()) return UnknownMapError(name, location_);
    const std::shared_ptr<MapRows> rows = found->second;
    DSG_ASSIGN_OR_RETURN(const auto writer, MemoryWriter::Open(rows, options_.program));
    const std::lock_guard rows_lock(rows->mutex);
    DSG_RETURN_IF_ERROR(condition.Check(name, rows->incarnation, rows->newest()));
    // Who reads it is to notice.
    ++rows->generation;
    maps_->by_name.erase(found);
    return DropReport{rows->newest(), 0};
  }

  absl::Status RenameMap(const std::string& from, const std::string& to) override {
    DSG_RETURN_IF_ERROR(CheckMapName(from));
    DSG_RETURN_IF_ERROR(CheckMapName(to));
    const std::lock_guard lock(maps_->mutex);
    const auto found = maps_->by_name.find(from);
    if (found == maps_->by_name.end()) return UnknownMapError(from, location_);
    if (maps_->by_name.contains(to)) return MapExistsError(to);
    const std::shared_ptr<MapRows> old = found->second;
    DSG_ASSIGN_OR_RETURN(const auto writer, MemoryWriter::Open(old, options_.program));
    const std::lock_guard old_lock(old->mutex);
    MapSpec spec = old->spec;
    spec.name = to;
    MapContent& content = *old;
    const auto renamed =
        std::make_shared<MapRows>(std::move(spec), old->incarnation, std::move(content));
    renamed->writer.clear();
    // Who reads the old one finds nothing there, and is to notice.
    content = MapContent();
    old->generation = renamed->generation + 1;
    maps_->by_name.erase(found);
    maps_->by_name.emplace(to, renamed);
    return absl::OkStatus();
  }

  absl::StatusOr<UpgradeReport> UpgradeMap(const std::string& name) override {
    DSG_RETURN_IF_ERROR(Find(name).status());
    // What is made by this program is of its format.
    return UpgradeReport{kStoreFormatVersion, kStoreFormatVersion, ""};
  }

  absl::Status InstallMap(const std::string& name, const std::string& file,
                          bool /*replace*/) override {
    return absl::UnimplementedError(
        absl::StrCat("cannot install ", file, " as map \"", name, "\" of store ", location_,
                     ": it is in memory and takes no files; restore into a store folder instead"));
  }

  absl::Status InstallRows(const MapSpec& spec, const RowSource& source,
                           const std::string& /*scratch*/, bool replace,
                           const StopCheck& stop) override {
    DSG_ASSIGN_OR_RETURN(const auto rows, CollectRows(spec, source, stop));
    DSG_ASSIGN_OR_RETURN(const VerifyReport report, MemoryReader(rows).Verify(stop, {}));
    if (!report.problems.empty()) {
      return MakeError(Reason::kStoreCorrupt,
                       absl::StrCat("rows cannot become map \"", spec.name, "\" of store ",
                                    location_, ", they are damaged: ", report.problems.front()),
                       {{"map", spec.name}});
    }
    const std::lock_guard lock(maps_->mutex);
    auto& there = maps_->by_name[spec.name];
    if (there != nullptr) {
      if (!replace) return MapExistsError(spec.name);
      DSG_ASSIGN_OR_RETURN(const auto writer, MemoryWriter::Open(there, options_.program));
      // Who reads the old one is to notice.
      const std::lock_guard old(there->mutex);
      ++there->generation;
    }
    there = rows;
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<std::shared_ptr<MapRows>> Find(const std::string& name) const {
    DSG_RETURN_IF_ERROR(CheckMapName(name));
    const std::lock_guard lock(maps_->mutex);
    const auto found = maps_->by_name.find(name);
    if (found != maps_->by_name.end()) return found->second;
    return UnknownMapError(name, location_);
  }

  const std::string folder_;
  const std::string location_;
  const StoreOptions options_;
  const std::shared_ptr<Maps> maps_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<GraphStore>> OpenMemoryStore(const std::string& name,
                                                            const StoreOptions& options) {
  auto maps = Registry::Get().Open(name, options.create);
  if (maps == nullptr) {
    return MakeError(Reason::kMapUnknown,
                     absl::StrCat("store \"memory:", name,
                                  "\" does not exist; stores in memory last as long as somebody "
                                  "of this process has them open"),
                     {{"store", "memory:" + name}});
  }
  return std::unique_ptr<GraphStore>(std::make_unique<MemoryStore>(name, options, std::move(maps)));
}

}  // namespace dsg::memory
