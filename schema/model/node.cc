// SPDX-License-Identifier: Apache-2.0
#include "schema/model/node.h"

namespace dsg {

bool IsAgentKind(std::string_view kind) { return kind == kinds::kHuman || kind == kinds::kRobot; }

std::optional<LayerId> LayerOfKind(std::string_view kind) {
  if (kind == kinds::kObject) return layers::kObjects;
  if (IsAgentKind(kind)) return layers::kAgents;
  if (kind == kinds::kPlace) return layers::kPlaces;
  if (kind == kinds::kStructure) return layers::kStructures;
  if (kind == kinds::kRoom) return layers::kRooms;
  if (kind == kinds::kBuilding) return layers::kBuildings;
  return std::nullopt;
}

}  // namespace dsg
