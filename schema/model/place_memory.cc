// SPDX-License-Identifier: Apache-2.0
#include "schema/model/place_memory.h"

#include <algorithm>

namespace dsg {

void AddPlaceMemory(const Node& seen, Node* known) {
  if (!seen.agent.has_value() || !known->agent.has_value()) return;
  std::vector<Sha256>& parts = known->agent->place_memory;
  for (const Sha256& part : seen.agent->place_memory) {
    if (std::find(parts.begin(), parts.end(), part) == parts.end()) parts.push_back(part);
  }
}

}  // namespace dsg
