// SPDX-License-Identifier: Apache-2.0
// Names of nodes that answers mention by id, and ids of nodes that people mention by name.
// Refuses to choose between several nodes of one name.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/cli/session.h"

namespace dsg::cli {

class NodeNames {
 public:
  NodeNames() = default;
  explicit NodeNames(std::map<std::string, std::string> names) : names_(std::move(names)) {}

  /// "kitchen (R9)"; the id alone of a node without a name; empty without an id.
  std::string Text(const std::string& id) const;

 private:
  std::map<std::string, std::string> names_;
};

/// Asks for the names of all of them at once, as believed at `revision`. Ids may repeat, be empty
/// or be unknown.
absl::StatusOr<NodeNames> NamesOf(Session* session, int64_t revision,
                                  const std::vector<std::string>& ids);

/// The id of a room, place or region by id or name, or of the only room of a class. A name may be
/// shared by a room and the furniture in it; then the room is meant. Errors:
/// NOT_FOUND/NODE_UNKNOWN; FIELD_INVALID if several rooms have the name, or the class.
absl::StatusOr<std::string> RegionId(Session* session, const std::string& id_or_name);

}  // namespace dsg::cli
