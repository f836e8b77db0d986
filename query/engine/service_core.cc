// SPDX-License-Identifier: Apache-2.0
#include "query/engine/service_core.h"

#include <utility>

#include "query/engine/engine.h"

namespace dsg::query {
namespace {

class LocalCore final : public EngineApi<ServiceCore> {
 public:
  LocalCore(std::unique_ptr<GraphStore> store, const ServiceCoreOptions& options)
      : EngineApi<ServiceCore>(&engine_), engine_(std::move(store), options) {}

  const std::string& store_folder() const override { return engine_.store_folder; }

 private:
  Engine engine_;
};

}  // namespace

std::unique_ptr<ServiceCore> MakeServiceCore(std::unique_ptr<GraphStore> store,
                                             const ServiceCoreOptions& options) {
  return std::make_unique<LocalCore>(std::move(store), options);
}

}  // namespace dsg::query
