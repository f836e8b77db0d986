// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/mesh_codec.h"

#include <algorithm>
#include <bit>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "schema/codec/bit_stream.h"
#include "schema/codec/mesh_lattice.h"
#include "schema/codec/mesh_walk.h"
#include "schema/model/mesh_grid.h"

namespace dsg {
namespace {

enum Channel : uint64_t {
  kNormals = 1,
  kColors = 2,
  kLabels = 4,
  kInstances = 8,
  kFirstSeen = 16,
  kLastSeen = 32,
  kChannels = 63,
};

constexpr size_t kPairsMax = 65'536;
// Bytes of the shortest entry of a list of pairs.
constexpr size_t kPairBytesMin = 2;

using Meaning = std::pair<uint32_t, uint32_t>;
using Times = std::pair<TimeNs, TimeNs>;

struct MeshHead {
  uint64_t channels = 0;
  BlockIndex index;
  WalkSize size;
  int64_t offset = 0;
  std::array<int64_t, 3> low{};
  std::vector<Meaning> meanings;
  std::vector<Times> times;
};

// Present as a channel of full length, or absent.
template <typename T>
bool IsWholeOrAbsent(const std::vector<T>& channel, size_t count) {
  return channel.empty() || channel.size() == count;
}

template <typename T>
T ValueAt(const std::vector<T>& channel, size_t i) {
  return channel.empty() ? T{} : channel[i];
}

uint64_t ChannelsOf(const MeshBlock& block) {
  uint64_t channels = 0;
  if (!block.normals_map.empty()) channels |= kNormals;
  if (!block.colors.empty()) channels |= kColors;
  if (!block.labels.empty()) channels |= kLabels;
  if (!block.instance_ids.empty()) channels |= kInstances;
  if (!block.first_seen_ns.empty()) channels |= kFirstSeen;
  if (!block.last_seen_ns.empty()) channels |= kLastSeen;
  return channels;
}

bool SameBits(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::bit_cast<uint32_t>(a[axis]) != std::bit_cast<uint32_t>(b[axis])) return false;
  }
  return true;
}

// Wraps, like the decoder: times at the limits of 64 bits are no worse than others.
uint64_t NsBetween(TimeNs from, TimeNs to) {
  return static_cast<uint64_t>(to) - static_cast<uint64_t>(from);
}
TimeNs NsAfter(TimeNs from, uint64_t ns) {
  return static_cast<TimeNs>(static_cast<uint64_t>(from) + ns);
}

void AppendMeanings(const std::vector<Meaning>& meanings, std::string* out) {
  AppendVarint(meanings.size(), out);
  for (const auto& [label, instance] : meanings) {
    AppendVarint(label, out);
    AppendVarint(instance, out);
  }
}

bool ReadMeanings(ByteReader* reader, std::vector<Meaning>* meanings) {
  const uint64_t count = reader->Varint();
  if (count > kPairsMax || count * kPairBytesMin > reader->remaining()) return false;
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t label = reader->Varint();
    const uint64_t instance = reader->Varint();
    if (label > UINT32_MAX || instance > UINT32_MAX) return false;
    meanings->emplace_back(label, instance);
  }
  return reader->ok();
}

// Frames come at a steady pace, so the moments are whole numbers of a common divisor apart.
void AppendMoments(const std::set<TimeNs>& moments, std::string* out) {
  AppendVarint(moments.size(), out);
  if (moments.empty()) return;
  AppendFixed(*moments.begin(), out);
  uint64_t divisor = 0;
  for (const TimeNs moment : moments) {
    divisor = std::gcd(divisor, NsBetween(*moments.begin(), moment));
  }
  divisor = std::max<uint64_t>(divisor, 1);
  AppendVarint(divisor, out);
  TimeNs last = *moments.begin();
  for (auto moment = std::next(moments.begin()); moment != moments.end(); ++moment) {
    AppendVarint(NsBetween(last, *moment) / divisor, out);
    last = *moment;
  }
}

bool ReadMoments(ByteReader* reader, std::vector<TimeNs>* moments) {
  const uint64_t count = reader->Varint();
  if (count > 2 * kPairsMax || count > reader->remaining()) return false;
  if (count == 0) return true;
  moments->push_back(reader->Fixed<TimeNs>());
  const uint64_t divisor = reader->Varint();
  for (uint64_t i = 1; i < count; ++i) {
    moments->push_back(NsAfter(moments->back(), reader->Varint() * divisor));
  }
  return reader->ok();
}

// A list of moments, then pairs of numbers in it.
void AppendTimePairs(const std::vector<Times>& times, std::string* out) {
  std::set<TimeNs> moments;
  for (const auto& [first, last] : times) {
    moments.insert(first);
    moments.insert(last);
  }
  AppendMoments(moments, out);
  std::map<TimeNs, uint64_t> number;
  for (const TimeNs moment : moments) number.emplace(moment, number.size());
  AppendVarint(times.size(), out);
  for (const auto& [first, last] : times) {
    AppendVarint(number.at(first), out);
    AppendVarint(number.at(last), out);
  }
}

bool ReadTimePairs(ByteReader* reader, std::vector<Times>* times) {
  std::vector<TimeNs> moments;
  if (!ReadMoments(reader, &moments)) return false;
  const uint64_t count = reader->Varint();
  if (count > kPairsMax || count * kPairBytesMin > reader->remaining()) return false;
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t first = reader->Varint();
    const uint64_t last = reader->Varint();
    if (first >= moments.size() || last >= moments.size()) return false;
    times->emplace_back(moments[first], moments[last]);
  }
  return reader->ok();
}

void AppendMeshHead(const MeshHead& head, std::string* out) {
  out->push_back(kLatticeMeshVersion);
  AppendVarint(head.channels, out);
  for (const int32_t index : {head.index.x, head.index.y, head.index.z}) {
    AppendVarint(ZigZag(index), out);
  }
  AppendVarint(head.size.vertex_count, out);
  AppendVarint(head.size.face_count, out);
  AppendVarint(static_cast<uint64_t>(head.size.pitch), out);
  AppendVarint(static_cast<uint64_t>(head.offset), out);
  for (const int64_t low : head.low) AppendVarint(ZigZag(low), out);
  for (const int32_t size : head.size.cells) AppendVarint(static_cast<uint64_t>(size), out);
  AppendMeanings(head.meanings, out);
  AppendTimePairs(head.times, out);
}

bool ReadSize(ByteReader* reader, MeshHead* head) {
  head->size.vertex_count = reader->Varint();
  head->size.face_count = reader->Varint();
  const uint64_t pitch = reader->Varint();
  const uint64_t offset = reader->Varint();
  if (!reader->ok() || head->size.vertex_count > uint64_t{kLatticeVerticesMax} ||
      head->size.face_count > uint64_t{kLatticeFacesMax} || pitch < 2 ||
      pitch > uint64_t{kPitchMax} || offset >= pitch) {
    return false;
  }
  head->size.pitch = static_cast<int64_t>(pitch);
  head->offset = static_cast<int64_t>(offset);
  for (int64_t& low : head->low) {
    low = UnZigZag(reader->Varint());
    if (low > kPitchMax * kPitchMax || low < -kPitchMax * kPitchMax) return false;
  }
  int64_t point_count = 1;
  for (int32_t& size : head->size.cells) {
    const uint64_t cells = reader->Varint();
    if (cells == 0 || cells >= uint64_t{kLatticePointsMax}) return false;
    size = static_cast<int32_t>(cells);
    point_count *= static_cast<int64_t>(cells) + 1;
    if (point_count > kLatticePointsMax) return false;
  }
  return reader->ok();
}

bool ReadMeshHead(ByteReader* reader, MeshHead* head) {
  if (reader->Fixed<char>() != kLatticeMeshVersion) return false;
  head->channels = reader->Varint();
  if (head->channels > kChannels) return false;
  for (int32_t* index : {&head->index.x, &head->index.y, &head->index.z}) {
    const int64_t value = UnZigZag(reader->Varint());
    if (value < INT32_MIN || value > INT32_MAX) return false;
    *index = static_cast<int32_t>(value);
  }
  if (!ReadSize(reader, head) || !ReadMeanings(reader, &head->meanings) ||
      !ReadTimePairs(reader, &head->times)) {
    return false;
  }
  head->size.has_normals = (head->channels & kNormals) != 0;
  head->size.has_colors = (head->channels & kColors) != 0;
  head->size.meaning_count = head->meanings.size();
  head->size.times_count = head->times.size();
  return true;
}

// Sorted, each once.
template <typename Pair>
std::vector<Pair> DistinctOf(std::vector<Pair> pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

template <typename Pair>
uint32_t NumberOf(const Pair& pair, const std::vector<Pair>& sorted) {
  return static_cast<uint32_t>(std::lower_bound(sorted.begin(), sorted.end(), pair) -
                               sorted.begin());
}

// False when a value has no code.
bool CodeVertices(const MeshBlock& block, MeshHead* head, std::vector<VertexCode>* codes) {
  const size_t count = block.positions_map.size();
  std::vector<Meaning> meanings;
  std::vector<Times> times;
  codes->resize(count);
  for (size_t i = 0; i < count; ++i) {
    VertexCode& code = (*codes)[i];
    if (!block.normals_map.empty()) {
      code.normal = NormalCodeOf(block.normals_map[i]);
      if (!SameBits(NormalOf(code.normal), block.normals_map[i])) return false;
    }
    code.color = ValueAt(block.colors, i);
    if (code.color > 0xffffff) return false;
    meanings.emplace_back(ValueAt(block.labels, i), ValueAt(block.instance_ids, i));
    times.emplace_back(ValueAt(block.first_seen_ns, i), ValueAt(block.last_seen_ns, i));
  }
  head->meanings = DistinctOf(meanings);
  head->times = DistinctOf(times);
  if (head->meanings.size() > kPairsMax || head->times.size() > kPairsMax) return false;
  for (size_t i = 0; i < count; ++i) {
    (*codes)[i].meaning = NumberOf(meanings[i], head->meanings);
    (*codes)[i].times = NumberOf(times[i], head->times);
  }
  return true;
}

MeshBlock MakeBlock(const MeshHead& head, WalkedMesh mesh) {
  MeshBlock block;
  block.index = head.index;
  block.faces = std::move(mesh.faces);
  block.positions_map.reserve(mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const LatticeVertex& vertex = mesh.vertices[i];
    Eigen::Vector3f& position = block.positions_map.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      int64_t steps = (head.low[axis] + vertex.point[axis]) * head.size.pitch + head.offset;
      if (axis == vertex.axis) steps += vertex.fraction;
      position[axis] = MeshCoordinateOf(steps);
    }
    const VertexCode& code = mesh.codes[i];
    if ((head.channels & kNormals) != 0) block.normals_map.push_back(NormalOf(code.normal));
    if ((head.channels & kColors) != 0) block.colors.push_back(code.color);
    const auto& [label, instance] = head.meanings[code.meaning];
    if ((head.channels & kLabels) != 0) block.labels.push_back(label);
    if ((head.channels & kInstances) != 0) block.instance_ids.push_back(instance);
    const auto& [first_ns, last_ns] = head.times[code.times];
    if ((head.channels & kFirstSeen) != 0) block.first_seen_ns.push_back(first_ns);
    if ((head.channels & kLastSeen) != 0) block.last_seen_ns.push_back(last_ns);
  }
  return block;
}

}  // namespace

std::optional<std::string> EncodeLatticeMesh(const MeshBlock& block) {
  const size_t count = block.positions_map.size();
  if (!IsWholeOrAbsent(block.normals_map, count) || !IsWholeOrAbsent(block.colors, count) ||
      !IsWholeOrAbsent(block.labels, count) || !IsWholeOrAbsent(block.instance_ids, count) ||
      !IsWholeOrAbsent(block.first_seen_ns, count) || !IsWholeOrAbsent(block.last_seen_ns, count)) {
    return std::nullopt;
  }
  const std::optional<MeshLattice> lattice = FindLattice(block);
  if (!lattice.has_value()) return std::nullopt;
  MeshHead head;
  std::vector<VertexCode> codes;
  if (!CodeVertices(block, &head, &codes)) return std::nullopt;
  head.channels = ChannelsOf(block);
  head.index = block.index;
  head.size = {count,
               block.faces.size(),
               lattice->size,
               lattice->pitch,
               (head.channels & kNormals) != 0,
               (head.channels & kColors) != 0,
               head.meanings.size(),
               head.times.size()};
  head.offset = lattice->offset;
  head.low = lattice->low;
  std::string bytes;
  AppendMeshHead(head, &bytes);
  EncodeWalk(head.size, *lattice, codes, &bytes);
  return bytes;
}

bool IsLatticeMesh(std::string_view bytes) {
  return !bytes.empty() && bytes[0] == kLatticeMeshVersion;
}

bool DecodeLatticeMesh(std::string_view bytes, MeshBlock* block) {
  ByteReader reader(bytes);
  MeshHead head;
  WalkedMesh mesh;
  if (!ReadMeshHead(&reader, &head) || head.meanings.empty() || head.times.empty()) return false;
  if (!DecodeWalk(head.size, bytes.substr(reader.position()), &mesh)) return false;
  *block = MakeBlock(head, std::move(mesh));
  return true;
}

}  // namespace dsg
