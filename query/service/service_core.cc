// SPDX-License-Identifier: Apache-2.0
#include "query/service/service_core.h"

#include <utility>

#include "query/engine/engine.h"

namespace dsg::query {
namespace {

class LocalCore final : public EngineApi<ServiceCore> {
 public:
  LocalCore(std::unique_ptr<GraphStore> store, const EngineOptions& options,
            std::shared_ptr<ArchiveCopies> archives)
      : EngineApi<ServiceCore>(&engine_), engine_(std::move(store), options, std::move(archives)) {}

  const std::string& store_folder() const override { return engine_.store_folder; }

 private:
  Engine engine_;
};

}  // namespace

std::unique_ptr<ServiceCore> MakeServiceCore(std::unique_ptr<GraphStore> store,
                                             const ServiceCoreOptions& options) {
  auto archives = std::make_shared<ArchiveCopies>(store->folder(), options.archives);
  return std::make_unique<LocalCore>(std::move(store),
                                     EngineOptions{options.view_cache_bytes, options.open_maps_max},
                                     std::move(archives));
}

}  // namespace dsg::query
