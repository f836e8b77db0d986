// SPDX-License-Identifier: Apache-2.0
#include "schema/store/touched_keys.h"

#include <algorithm>

#include "schema/codec/shuffle.h"

namespace dsg {
namespace {

constexpr char kLayout = 1;
// The same behind this byte, compressed.
constexpr char kLayoutPacked = 2;
// Of shorter lists nothing is gained.
constexpr size_t kPlainBytesMax = 1024;
// Of a commit of a hundred million keys.
constexpr size_t kUnpackedBytesMax = size_t{1} << 30;
constexpr uint64_t kLayersOrLabels = 1;

uint64_t Zigzag(int64_t value) {
  return static_cast<uint64_t>(value) << 1 ^ static_cast<uint64_t>(value >> 63);
}
int64_t Unzigzag(uint64_t value) {
  return static_cast<int64_t>(value >> 1) ^ -static_cast<int64_t>(value & 1);
}

void PutVarint(uint64_t value, std::string* out) {
  for (; value >= 0x80; value >>= 7) out->push_back(static_cast<char>(value | 0x80));
  out->push_back(static_cast<char>(value));
}

/// Takes varints off the front of bytes; `ok` is false once there were too few.
struct VarintReader {
  std::string_view bytes;
  bool ok = true;

  uint64_t Take() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      if (bytes.empty()) break;
      const auto byte = static_cast<unsigned char>(bytes.front());
      bytes.remove_prefix(1);
      value |= static_cast<uint64_t>(byte & 0x7f) << shift;
      if (byte < 0x80) return value;
    }
    ok = false;
    return 0;
  }
  /// A number of entries, each of at least one byte, so that damage cannot ask for any memory.
  uint64_t TakeCount() {
    const uint64_t count = Take();
    if (count <= bytes.size()) return count;
    ok = false;
    return 0;
  }
  int64_t TakeSigned() { return Unzigzag(Take()); }
};

template <typename T>
void SortUnique(std::vector<T>* items) {
  if (!std::is_sorted(items->begin(), items->end())) std::sort(items->begin(), items->end());
  items->erase(std::unique(items->begin(), items->end()), items->end());
}

void PutNodes(const std::vector<NodeId>& nodes, std::string* out) {
  PutVarint(nodes.size(), out);
  uint64_t before = 0;
  for (const NodeId node : nodes) {
    PutVarint(node.value - before, out);
    before = node.value;
  }
}

void TakeNodes(VarintReader* in, std::vector<NodeId>* nodes) {
  const uint64_t count = in->TakeCount();
  nodes->reserve(nodes->size() + count);
  uint64_t before = 0;
  for (uint64_t i = 0; i < count && in->ok; ++i) nodes->push_back(NodeId(before += in->Take()));
}

// Ends of an edge are often neighbours in number and of one letter.
void PutEdges(const std::vector<EdgeRowKey>& edges, std::string* out) {
  PutVarint(edges.size(), out);
  uint64_t before = 0;
  for (const EdgeRowKey& edge : edges) {
    PutVarint(edge.source.value - before, out);
    before = edge.source.value;
    PutVarint(static_cast<uint64_t>(edge.relation), out);
    const auto step =
        static_cast<int64_t>(edge.target.index()) - static_cast<int64_t>(edge.source.index());
    const bool other_letter = edge.target.letter() != edge.source.letter();
    PutVarint(Zigzag(step) << 1 | (other_letter ? 1 : 0), out);
    if (other_letter) out->push_back(edge.target.letter());
  }
}

void TakeEdges(VarintReader* in, std::vector<EdgeRowKey>* edges) {
  const uint64_t count = in->TakeCount();
  edges->reserve(edges->size() + count);
  uint64_t before = 0;
  for (uint64_t i = 0; i < count && in->ok; ++i) {
    EdgeRowKey edge;
    edge.source = NodeId(before += in->Take());
    edge.relation = static_cast<int64_t>(in->Take());
    const uint64_t step = in->Take();
    const uint64_t index = edge.source.index() + static_cast<uint64_t>(Unzigzag(step >> 1));
    char letter = edge.source.letter();
    if ((step & 1) != 0) {
      in->ok = in->ok && !in->bytes.empty();
      if (!in->ok) return;
      letter = in->bytes.front();
      in->bytes.remove_prefix(1);
    }
    edge.target = NodeId(letter, index);
    edges->push_back(edge);
  }
}

void PutBlocks(const std::vector<BlockIndex>& blocks, std::string* out) {
  PutVarint(blocks.size(), out);
  BlockIndex before;
  for (const BlockIndex& block : blocks) {
    PutVarint(Zigzag(int64_t{block.x} - before.x), out);
    PutVarint(Zigzag(int64_t{block.y} - before.y), out);
    PutVarint(Zigzag(int64_t{block.z} - before.z), out);
    before = block;
  }
}

void TakeBlocks(VarintReader* in, std::vector<BlockIndex>* blocks) {
  const uint64_t count = in->TakeCount();
  blocks->reserve(blocks->size() + count);
  BlockIndex before;
  for (uint64_t i = 0; i < count && in->ok; ++i) {
    before.x = static_cast<int32_t>(before.x + in->TakeSigned());
    before.y = static_cast<int32_t>(before.y + in->TakeSigned());
    before.z = static_cast<int32_t>(before.z + in->TakeSigned());
    blocks->push_back(before);
  }
}

}  // namespace

void TouchedKeys::Add(const TouchedKeys& other) {
  nodes.insert(nodes.end(), other.nodes.begin(), other.nodes.end());
  edges.insert(edges.end(), other.edges.begin(), other.edges.end());
  tracks.insert(tracks.end(), other.tracks.begin(), other.tracks.end());
  mesh_blocks.insert(mesh_blocks.end(), other.mesh_blocks.begin(), other.mesh_blocks.end());
  layers_or_labels = layers_or_labels || other.layers_or_labels;
}

void TouchedKeys::Normalize() {
  SortUnique(&nodes);
  SortUnique(&edges);
  SortUnique(&tracks);
  SortUnique(&mesh_blocks);
}

std::string EncodeTouched(const TouchedKeys& keys) {
  std::string bytes(1, kLayout);
  PutVarint(keys.layers_or_labels ? kLayersOrLabels : 0, &bytes);
  PutNodes(keys.nodes, &bytes);
  PutEdges(keys.edges, &bytes);
  PutNodes(keys.tracks, &bytes);
  PutBlocks(keys.mesh_blocks, &bytes);
  return bytes.size() <= kPlainBytesMax ? bytes : kLayoutPacked + Compress(bytes);
}

bool DecodeTouched(std::string_view bytes, TouchedKeys* keys) {
  std::string unpacked;
  if (bytes.starts_with(kLayoutPacked)) {
    if (!Decompress(bytes.substr(1), kUnpackedBytesMax, &unpacked)) return false;
    bytes = unpacked;
  }
  if (bytes.empty() || bytes.front() != kLayout) return false;
  VarintReader in{bytes.substr(1)};
  if ((in.Take() & kLayersOrLabels) != 0) keys->layers_or_labels = true;
  TakeNodes(&in, &keys->nodes);
  TakeEdges(&in, &keys->edges);
  TakeNodes(&in, &keys->tracks);
  TakeBlocks(&in, &keys->mesh_blocks);
  return in.ok && in.bytes.empty();
}

}  // namespace dsg
