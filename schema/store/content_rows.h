// SPDX-License-Identifier: Apache-2.0
// The rows of which a map consists, as its digests know them, and what rows add to the record of a
// revision. Every backend counts the same rows for the same commits: that is what makes their
// digests equal. The bytes of an identity are part of the format of all maps and never change.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "schema/codec/checksum.h"
#include "schema/codec/trajectory_codec.h"
#include "schema/model/ids.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"
#include "schema/model/trajectory.h"

namespace dsg {

/// Each row has a letter, columns and a payload. Payloads are views: whoever makes a row keeps the
/// bytes. `rev_from` is the revision that wrote the row.
struct NodeRow {
  static constexpr char kLetter = 'N';
  NodeId id;
  Revision rev_from = 0;
  LayerId layer = 0;
  /// EncodeNodePayload.
  std::string_view payload;
  /// Counts, and is no part of the identity: the payload says it.
  bool is_agent = false;
  std::array<int64_t, 3> columns() const { return {KeyOf(id), rev_from, layer}; }
};

struct EdgeRow {
  static constexpr char kLetter = 'E';
  NodeId source;
  /// Of the relation's name. Each map numbers its relations from 1, in the order in which edges
  /// first used them; edges of one delta go by (source, relation, target).
  int64_t relation = 0;
  NodeId target;
  Revision rev_from = 0;
  double weight = 0.0;
  /// EncodeEdgePayload.
  std::string_view payload;
  std::array<int64_t, 5> columns() const {
    return {KeyOf(source), relation, KeyOf(target), rev_from, std::bit_cast<int64_t>(weight)};
  }
};

struct StayRow {
  static constexpr char kLetter = 'S';
  NodeId agent;
  TimeNs enter_ns = 0;
  TimeNs exit_ns = 0;
  NodeId place;
  NodeId room;
  Revision rev_from = 0;
  std::string_view payload = {};
  std::array<int64_t, 6> columns() const {
    return {KeyOf(agent), enter_ns, exit_ns, KeyOf(place), KeyOf(room), rev_from};
  }
  Stay stay() const { return {agent, place, room, enter_ns, exit_ns}; }
};

struct MeshRow {
  static constexpr char kLetter = 'M';
  BlockIndex index;
  Revision rev_from = 0;
  /// EncodeMeshBlock.
  std::string_view payload;
  std::array<int64_t, 4> columns() const { return {index.x, index.y, index.z, rev_from}; }
};

/// Factors or shapes of one agent that were committed together; see track_rules.h.
struct BatchRow {
  NodeId agent;
  Revision rev_from = 0;
  /// First and last time of what is in it.
  TimeNs t0 = 0;
  TimeNs t1 = 0;
  std::string_view payload;
  std::array<int64_t, 4> columns() const { return {KeyOf(agent), rev_from, t0, t1}; }
};
struct FactorRow : BatchRow {
  static constexpr char kLetter = 'F';
};
struct ShapeRow : BatchRow {
  static constexpr char kLetter = 'H';
};

struct AssetRow {
  static constexpr char kLetter = 'A';
  Revision rev_from = 0;
  /// Its SHA-256, 32 bytes.
  std::string_view payload;
  std::array<int64_t, 1> columns() const { return {rev_from}; }
};

/// Layers that a map begins with count nowhere.
struct LayerRow {
  static constexpr char kLetter = 'L';
  LayerId id = 0;
  int32_t rank = 0;
  Revision rev_from = 0;
  /// Its name.
  std::string_view payload;
  std::array<int64_t, 3> columns() const { return {id, rank, rev_from}; }
};

/// A label that gets another name keeps the row of the old one.
struct LabelRow {
  static constexpr char kLetter = 'l';
  int32_t id = 0;
  Revision rev_from = 0;
  /// Its name.
  std::string_view payload;
  std::array<int64_t, 2> columns() const { return {id, rev_from}; }
};

/// The digest's bytes as text, for AssetRow::payload.
inline std::string_view BytesOf(const Sha256& digest) {
  return {reinterpret_cast<const char*>(digest.data()), digest.size()};
}

/// A letter, columns as 64-bit integers in the byte order of the machine, payload.
std::string RowIdentity(char letter, std::span<const int64_t> columns, std::string_view payload);

/// Bytes that identify a row in the content digest. Poses: PoseIdentity.
template <typename Row>
std::string IdentityOf(const Row& row) {
  return RowIdentity(Row::kLetter, row.columns(), row.payload);
}

/// What rows add to the record of each revision that shows them.
struct RowSums {
  ContentDigest content;
  int64_t node_count = 0;
  int64_t edge_count = 0;
  int64_t agent_count = 0;
  int64_t pose_count = 0;
  int64_t stay_count = 0;
  int64_t mesh_block_count = 0;
  /// Entries may be 0.
  std::map<LayerId, int64_t> layer_counts;

  void Add(const NodeRow& row) {
    AddNode(row, 1);
    content.Add(IdentityOf(row));
  }
  void Remove(const NodeRow& row) {
    AddNode(row, -1);
    content.Remove(IdentityOf(row));
  }
  void Add(const EdgeRow& row) {
    ++edge_count;
    content.Add(IdentityOf(row));
  }
  void Remove(const EdgeRow& row) {
    --edge_count;
    content.Remove(IdentityOf(row));
  }
  void Add(const StayRow& row) {
    ++stay_count;
    content.Add(IdentityOf(row));
  }
  void Remove(const StayRow& row) {
    --stay_count;
    content.Remove(IdentityOf(row));
  }
  void Add(const MeshRow& row) {
    ++mesh_block_count;
    content.Add(IdentityOf(row));
  }
  void Remove(const MeshRow& row) {
    --mesh_block_count;
    content.Remove(IdentityOf(row));
  }
  void AddPose(std::string_view identity) {
    ++pose_count;
    content.Add(identity);
  }
  void RemovePose(std::string_view identity) {
    --pose_count;
    content.Remove(identity);
  }
  /// Rows of which no counter tells.
  template <typename Row>
  void Add(const Row& row) {
    content.Add(IdentityOf(row));
  }
  template <typename Row>
  void Remove(const Row& row) {
    content.Remove(IdentityOf(row));
  }

  RowSums& operator+=(const RowSums& other);
  RowSums& operator-=(const RowSums& other);

 private:
  void AddNode(const NodeRow& row, int64_t count) {
    node_count += count;
    layer_counts[row.layer] += count;
    if (row.is_agent) agent_count += count;
  }
};

}  // namespace dsg
