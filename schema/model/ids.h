// SPDX-License-Identifier: Apache-2.0
// The names of things: nodes, layers, revisions.
#pragma once

#include <bit>
#include <compare>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg {

/// A node's identity for the life of its map: an ASCII letter in the top 8 bits, an index in the
/// low 56, printed "O42". This is the node symbol of Spark-DSG, so graphs travel.
struct NodeId {
  uint64_t value = 0;

  constexpr NodeId() = default;
  constexpr explicit NodeId(uint64_t bits) : value(bits) {}
  constexpr NodeId(char letter, uint64_t index)
      : value(static_cast<uint64_t>(static_cast<unsigned char>(letter)) << 56 |
              (index & kIndexMax)) {}

  static constexpr uint64_t kIndexMax = (uint64_t{1} << 56) - 1;

  constexpr char letter() const { return static_cast<char>(value >> 56); }
  constexpr uint64_t index() const { return value & kIndexMax; }
  /// The zero id stands for "none" and names no node.
  constexpr bool empty() const { return value == 0; }
  /// Letter is an ASCII letter.
  constexpr bool IsValid() const {
    const char c = letter();
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
  }

  constexpr auto operator<=>(const NodeId&) const = default;
};

/// An id as a key of rows, and in what digests count: rotated left by 8 bits (index * 256 +
/// letter), so that small indices make small integers. In the order of keys, nodes that were added
/// together stand together whatever their letter.
constexpr int64_t KeyOf(NodeId id) { return static_cast<int64_t>(std::rotl(id.value, 8)); }
constexpr NodeId IdOf(int64_t key) { return NodeId(std::rotr(static_cast<uint64_t>(key), 8)); }

/// "O42"; "" for the empty id.
std::string ToString(NodeId id);

/// Reads "O42". Errors: INVALID_ARGUMENT/NODE_ID_INVALID.
absl::StatusOr<NodeId> ParseNodeId(std::string_view text);

using LayerId = int32_t;

/// Dense and growing per map: 1 is the first commit, 0 the empty map.
using Revision = int64_t;

/// The revision that closes rows still believed.
inline constexpr Revision kRevisionMax = INT64_MAX;

/// True for [a-z0-9][a-z0-9_-]{0,63}: such a name is safe as a folder's.
bool IsValidMapName(std::string_view name);

/// Errors: INVALID_ARGUMENT/MAP_NAME_INVALID naming the rule.
absl::Status CheckMapName(std::string_view name);

}  // namespace dsg

template <>
struct std::hash<dsg::NodeId> {
  size_t operator()(dsg::NodeId id) const noexcept {
    // Indices are dense; multiply so that they spread over the table.
    return static_cast<size_t>((id.value ^ id.value >> 32) * 0x9e3779b97f4a7c15ull);
  }
};
