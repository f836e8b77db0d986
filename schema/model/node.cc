// SPDX-License-Identifier: Apache-2.0
#include "schema/model/node.h"

namespace dsg {

std::vector<Sha256> AssetsOf(const Node& node) {
  std::vector<Sha256> assets;
  const auto add = [&](const std::optional<Sha256>& asset) {
    if (asset.has_value()) assets.push_back(*asset);
  };
  if (node.object.has_value()) add(node.object->model);
  if (node.agent.has_value()) {
    add(node.agent->body_model);
    for (const Sha256& part : node.agent->place_memory) assets.push_back(part);
  }
  return assets;
}

}  // namespace dsg
