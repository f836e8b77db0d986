// SPDX-License-Identifier: Apache-2.0
// What words of the command line stand for in the map: names, tags, intervals, filters. The map is
// asked; a word that fits several things is an error.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "query/cli/list_writer.h"
#include "query/cli/session.h"
#include "schema/base/time.h"
#include "schema/model/layer.h"
#include "schema/model/revision.h"

namespace dsg::v1 {
class ListTagsResponse;
class NodeFilter;
class NodePattern;
}  // namespace dsg::v1

namespace dsg::cli {

// All functions require that the session's map is chosen.

/// Names of nodes by id.
class NodeNames {
 public:
  NodeNames() = default;
  explicit NodeNames(std::map<std::string, std::string> names) : names_(std::move(names)) {}

  /// "kitchen (R9)"; only the id of a node without a name; empty without an id.
  std::string Text(const std::string& id) const;
  /// The same as a cell of a list; none without an id.
  Cell Of(const std::string& id) const;

 private:
  std::map<std::string, std::string> names_;
};

/// Reads the names of all ids in one call, at `revision`. Ids may repeat, be empty or be unknown.
absl::StatusOr<NodeNames> NamesOf(Session* session, int64_t revision,
                                  const std::vector<std::string>& ids);

/// The names of all maps.
absl::StatusOr<std::vector<std::string>> NamesOfMaps(const Session& session);

/// What nodes of a layer can be named by; an empty layer = all layers.
struct NodeWords {
  /// Names, and the classes of rooms; each once.
  std::vector<std::string> names;
  std::vector<std::string> ids;
};

/// The words of at most so many nodes.
absl::StatusOr<NodeWords> WordsOfNodes(const Session& session, const std::string& layer,
                                       int64_t node_count_max);

/// Words of the map that searches can use, each once and ascending.
struct SearchWords {
  /// Those that have nodes.
  std::vector<std::string> layers;
  std::vector<std::string> kinds;
  std::vector<std::string> classes;
  std::vector<std::string> relations;
};
absl::StatusOr<SearchWords> WordsOfSearches(const Session& session);

/// The id of a node by id or unique name. Errors: of GetNode.
absl::StatusOr<std::string> NodeIdOf(Session* session, const std::string& id_or_name);

/// The id of a room, place or region by id or name, or of the only room of a class. If a room and
/// its furniture share a name, the room is meant. Errors: NOT_FOUND/NODE_UNKNOWN; FIELD_INVALID if
/// several rooms have the name or the class, or something else the name and a room the class.
absl::StatusOr<std::string> RegionId(Session* session, const std::string& id_or_name);

/// The number of a revision, if the option is set. Errors: NOT_FOUND/TAG_UNKNOWN;
/// OUT_OF_RANGE/REVISION_COMPACTED if nothing was committed until the time that it names.
absl::StatusOr<std::optional<Revision>> NumberOf(const RevisionOption& revision, Session* session);

/// The tags of the map; none from a server that does not know tags.
absl::StatusOr<v1::ListTagsResponse> ReadTags(Session* session);

/// The interval of --from and --to. An end that is not given is that of all poses of the map.
/// Errors: INVALID_ARGUMENT with the option, also TIME_RANGE_INVERTED if the end that is given lies
/// beyond all poses; of the calls.
absl::StatusOr<Interval> AskedInterval(Session* session, const std::string& from,
                                       const std::string& to);

/// Errors: INVALID_ARGUMENT with --at.
absl::Status FillFilter(const FilterOptions& options, const MapSpec& map, v1::NodeFilter* filter);

/// The layer, kind and class of a filter, for CheckWords.
v1::NodePattern WordsOf(const FilterOptions& options);

/// For lists that came out empty: an error if the map does not know one of the words of a pattern.
/// Errors: NOT_FOUND/CLASS_UNKNOWN (also for a kind), RELATION_UNKNOWN, LAYER_UNKNOWN.
absl::Status CheckWords(Session* session, const v1::NodePattern& words);

}  // namespace dsg::cli
