// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/mesh_walk.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <memory>

#include "schema/base/check.h"
#include "schema/codec/range_coder.h"

namespace dsg {
namespace {

// Lists of edges that are remembered for one pattern of known vertices.
constexpr size_t kListsPerPattern = 4;
constexpr int kFaceCountBits = 3;
constexpr int kEdgeBits = 4;
constexpr int kNumberClassBits = 5;
constexpr int kNumberLearntBits = 4;
constexpr size_t kSpreadMax = 12;

// Writes the bit that it is given.
class BitSource {
 public:
  explicit BitSource(std::string* out) : coder_(out) {}
  bool Bit(bool bit, BitModel* model) {
    coder_.Encode(bit, model);
    return bit;
  }
  uint64_t Raw(uint64_t value, int width) {
    coder_.EncodeRaw(value, width);
    return width == 0 ? 0 : value & ((uint64_t{1} << width) - 1);
  }
  bool ok() const { return true; }
  void Finish() { coder_.Finish(); }

 private:
  RangeEncoder coder_;
};

// Reads a bit, whatever it is given.
class BitSink {
 public:
  explicit BitSink(std::string_view bytes) : coder_(bytes) {}
  bool Bit(bool, BitModel* model) { return coder_.Decode(model); }
  uint64_t Raw(uint64_t, int width) { return coder_.DecodeRaw(width); }
  bool ok() const { return coder_.ok(); }
  bool IsAtEnd() const { return coder_.IsAtEnd(); }

 private:
  RangeDecoder coder_;
};

// A number of few bits, all of them learnt.
template <int kBits>
struct SymbolModel {
  std::array<BitModel, 1 << kBits> nodes;

  template <typename Bits>
  uint32_t Code(uint32_t value, Bits* bits) {
    uint32_t node = 1;
    for (int bit = kBits - 1; bit >= 0; --bit) {
      node = node * 2 + (bits->Bit(((value >> bit) & 1) != 0, &nodes[node]) ? 1 : 0);
    }
    return node - (1u << kBits);
  }
};

// As SymbolModel, for as many symbols as a list has.
class ListModel {
 public:
  explicit ListModel(uint64_t count)
      : bits_(count <= 1 ? 0 : static_cast<int>(std::bit_width(count - 1))),
        nodes_(size_t{1} << bits_) {}

  template <typename Bits>
  uint32_t Code(uint32_t value, Bits* bits) {
    uint32_t node = 1;
    for (int bit = bits_ - 1; bit >= 0; --bit) {
      node = node * 2 + (bits->Bit(((value >> bit) & 1) != 0, &nodes_[node]) ? 1 : 0);
    }
    return node - (1u << bits_);
  }

 private:
  int bits_;
  std::vector<BitModel> nodes_;
};

// A residual of any size, small ones cheap: its bit width, its sign, the bits after the first one.
class NumberModel {
 public:
  template <typename Bits>
  int64_t Code(int64_t value, Bits* bits) {
    const auto size = static_cast<uint64_t>(std::abs(value));
    const auto width = widths_.Code(static_cast<uint32_t>(std::bit_width(size)), bits);
    if (width == 0) return 0;
    const bool is_negative = bits->Bit(value < 0, &signs_[width]);
    const int learnt = std::min(static_cast<int>(width) - 1, kNumberLearntBits);
    uint64_t coded = 1;
    for (int i = 0; i < learnt; ++i) {
      const bool bit = ((size >> (static_cast<int>(width) - 2 - i)) & 1) != 0;
      coded = coded * 2 + (bits->Bit(bit, &leading_[width][coded]) ? 1 : 0);
    }
    const int raw = static_cast<int>(width) - 1 - learnt;
    coded = coded << raw | bits->Raw(size, raw);
    return is_negative ? -static_cast<int64_t>(coded) : static_cast<int64_t>(coded);
  }

 private:
  SymbolModel<kNumberClassBits> widths_;
  std::array<BitModel, 1 << kNumberClassBits> signs_;
  std::array<std::array<BitModel, 1 << kNumberLearntBits>, 1 << kNumberClassBits> leading_;
};

// The lists of edges that followed a pattern of known vertices, the last one first.
struct Pattern {
  std::vector<std::string> lists;
  std::array<BitModel, kListsPerPattern> hits;

  void MoveToFront(size_t rank) {
    std::rotate(lists.begin(), lists.begin() + static_cast<std::ptrdiff_t>(rank),
                lists.begin() + static_cast<std::ptrdiff_t>(rank) + 1);
  }
  void Remember(const std::string& list) {
    if (lists.size() == kListsPerPattern) lists.pop_back();
    lists.insert(lists.begin(), list);
  }
};

// Vertices nearby that were coded before; -1 = none.
struct Near {
  int32_t u = -1;
  int32_t v = -1;
  int32_t uv = -1;
};

template <typename Bits>
class Walk {
 public:
  /// `lattice` and `codes`: null when decoding.
  Walk(const WalkSize& size, const MeshLattice* lattice, const std::vector<VertexCode>* codes,
       Bits* bits, WalkedMesh* mesh)
      : size_(size),
        lattice_(lattice),
        told_(codes),
        bits_(bits),
        mesh_(mesh),
        row_length_(static_cast<size_t>(size.cells[0]) + 1),
        layer_length_(row_length_ * (static_cast<size_t>(size.cells[1]) + 1)),
        vertex_on_edge_(3 * layer_length_ * (static_cast<size_t>(size.cells[2]) + 1), -1),
        row_is_near_(
            (static_cast<size_t>(size.cells[1]) + 1) * (static_cast<size_t>(size.cells[2]) + 1), 0),
        pattern_of_mask_(1 << kEdgesPerCell, -1),
        meanings_(size.meaning_count),
        times_(size.times_count) {
    for (int edge = 0; edge < kEdgesPerCell; ++edge) {
      edge_offsets_[static_cast<size_t>(edge)] =
          3 * Offset(EdgePoint({}, edge)) + static_cast<size_t>(edge / 4);
    }
  }

  bool Run() {
    LatticePoint cell{};
    for (cell[2] = 0; cell[2] < size_.cells[2]; ++cell[2]) {
      for (cell[1] = 0; cell[1] < size_.cells[1]; ++cell[1]) {
        cell[0] = 0;
        if (!CodeRow(cell) || !bits_->ok()) return false;
      }
    }
    return mesh_->vertices.size() == size_.vertex_count && mesh_->faces.size() == size_.face_count;
  }

 private:
  bool IsTold(const LatticePoint& cell) const {
    return lattice_ != nullptr && next_cell_ < lattice_->cells.size() &&
           lattice_->cells[next_cell_].cell == cell;
  }

  bool IsRowTold(const LatticePoint& first) const {
    if (lattice_ == nullptr || next_cell_ >= lattice_->cells.size()) return false;
    const LatticePoint& next = lattice_->cells[next_cell_].cell;
    return next[1] == first[1] && next[2] == first[2];
  }

  uint8_t* RowIsNear(int32_t y, int32_t z) {
    return &row_is_near_[static_cast<size_t>(z) * (static_cast<size_t>(size_.cells[1]) + 1) +
                         static_cast<size_t>(y)];
  }

  bool CodeRow(LatticePoint cell) {
    BitModel* model = &rows_[*RowIsNear(cell[1], cell[2]) * 2u + (had_row_ ? 1u : 0u)];
    had_row_ = bits_->Bit(IsRowTold(cell), model);
    if (!had_row_) return true;
    bool had_cell = false;
    for (; cell[0] < size_.cells[0]; ++cell[0]) {
      const uint32_t mask = KnownMask(cell);
      const auto known = std::min(static_cast<size_t>(std::popcount(mask)), kKnownMax);
      had_cell = bits_->Bit(IsTold(cell), &occupied_[known * 2 + (had_cell ? 1 : 0)]);
      if (had_cell && !CodeCell(cell, mask)) return false;
    }
    return true;
  }

  size_t Offset(const LatticePoint& point) const {
    return static_cast<size_t>(point[2]) * layer_length_ +
           static_cast<size_t>(point[1]) * row_length_ + static_cast<size_t>(point[0]);
  }

  int32_t* OnEdge(const LatticePoint& cell, int edge) {
    return &vertex_on_edge_[3 * Offset(cell) + edge_offsets_[static_cast<size_t>(edge)]];
  }

  uint32_t KnownMask(const LatticePoint& cell) const {
    const int32_t* vertices = &vertex_on_edge_[3 * Offset(cell)];
    uint32_t mask = 0;
    for (size_t edge = 0; edge < kEdgesPerCell; ++edge) {
      if (vertices[edge_offsets_[edge]] >= 0) mask |= 1u << edge;
    }
    return mask;
  }

  bool CodeCell(const LatticePoint& cell, uint32_t mask) {
    std::string edges = lattice_ == nullptr ? "" : lattice_->cells[next_cell_].edges;
    if (!CodeEdges(mask, &edges)) return false;
    ++next_cell_;
    if (mesh_->faces.size() + edges.size() / 3 > size_.face_count) return false;
    std::array<uint32_t, 3> face{};
    for (size_t i = 0; i < edges.size(); ++i) {
      int32_t* vertex = OnEdge(cell, edges[i]);
      if (*vertex < 0 && !CodeVertex(cell, edges[i], mask, vertex)) return false;
      mask |= 1u << edges[i];
      face[i % 3] = static_cast<uint32_t>(*vertex);
      if (i % 3 == 2) mesh_->faces.push_back(face);
    }
    return true;
  }

  // As one of those that followed the same pattern before, or in full.
  bool CodeEdges(uint32_t mask, std::string* edges) {
    if (pattern_of_mask_[mask] < 0) {
      pattern_of_mask_[mask] = static_cast<int32_t>(patterns_.size());
      patterns_.emplace_back();
    }
    Pattern* pattern = &patterns_[static_cast<size_t>(pattern_of_mask_[mask])];
    for (size_t rank = 0; rank < pattern->lists.size(); ++rank) {
      if (!bits_->Bit(*edges == pattern->lists[rank], &pattern->hits[rank])) continue;
      pattern->MoveToFront(rank);
      *edges = pattern->lists.front();
      return true;
    }
    if (!CodeNewEdges(edges)) return false;
    pattern->Remember(*edges);
    return true;
  }

  bool CodeNewEdges(std::string* edges) {
    const auto told_count = static_cast<uint32_t>(edges->size() / 3);
    const uint32_t count = face_counts_.Code(told_count == 0 ? 0 : told_count - 1, bits_) + 1;
    edges->resize(3 * count);
    size_t last = 0;
    for (size_t i = 0; i < edges->size(); ++i) {
      auto& edge = (*edges)[i];
      edge = static_cast<char>(
          edges_[i % 3][last].Code(static_cast<uint32_t>(static_cast<uint8_t>(edge)), bits_));
      if (edge >= kEdgesPerCell) return false;
      last = static_cast<size_t>(edge);
    }
    return true;
  }

  // The vertex on a parallel edge one step back, in the same place along the axis or next to it.
  int32_t Find(LatticePoint point, int axis, int32_t du, int32_t dv) const {
    point[(axis + 1) % 3] -= du;
    point[(axis + 2) % 3] -= dv;
    if (point[(axis + 1) % 3] < 0 || point[(axis + 2) % 3] < 0) return -1;
    for (const int32_t step : {0, -1, 2}) {
      point[axis] += step;
      if (point[axis] < 0 || point[axis] > size_.cells[axis]) continue;
      const int32_t vertex = vertex_on_edge_[3 * Offset(point) + static_cast<size_t>(axis)];
      if (vertex >= 0) return vertex;
    }
    return -1;
  }

  bool CodeVertex(const LatticePoint& cell, int edge, uint32_t mask, int32_t* entry) {
    const size_t index = mesh_->vertices.size();
    if (index >= size_.vertex_count) return false;
    LatticeVertex vertex{EdgePoint(cell, edge), edge / 4, 0};
    if (lattice_ != nullptr) vertex.fraction = lattice_->vertices[index].fraction;
    Near near;
    near.u = Find(vertex.point, vertex.axis, 1, 0);
    near.v = Find(vertex.point, vertex.axis, 0, 1);
    near.uv = Find(vertex.point, vertex.axis, 1, 1);
    if (!CodeFraction(near, &vertex)) return false;
    VertexCode code = told_ == nullptr ? VertexCode() : (*told_)[index];
    if (!CodeMeaning(References(near, cell, mask), &code)) return false;
    *entry = static_cast<int32_t>(index);
    mesh_->vertices.push_back(vertex);
    mesh_->codes.push_back(code);
    MarkRows(vertex);
    return true;
  }

  // Rows of cells that have a new vertex on an edge are likely to have faces.
  void MarkRows(const LatticeVertex& vertex) {
    for (int32_t dz = 0; dz < (vertex.axis == 2 ? 1 : 2); ++dz) {
      for (int32_t dy = 0; dy < (vertex.axis == 1 ? 1 : 2); ++dy) {
        const int32_t y = vertex.point[1] - dy;
        const int32_t z = vertex.point[2] - dz;
        if (y >= 0 && z >= 0) *RowIsNear(y, z) = 1;
      }
    }
  }

  int64_t AlongAxis(int32_t index, const LatticeVertex& from) const {
    const LatticeVertex& other = mesh_->vertices[static_cast<size_t>(index)];
    return (other.point[from.axis] - from.point[from.axis]) * size_.pitch + other.fraction;
  }

  // A surface goes on as a plane, or as it is where that has been better lately.
  bool CodeFraction(const Near& near, LatticeVertex* vertex) {
    const bool has_both = near.u >= 0 && near.v >= 0;
    int64_t foretold = size_.pitch / 2;
    int64_t plane = foretold;
    int64_t mean = foretold;
    size_t spread = 0;
    size_t kind = 0;
    if (has_both) {
      const int64_t u = AlongAxis(near.u, *vertex);
      const int64_t v = AlongAxis(near.v, *vertex);
      mean = (u + v) / 2;
      plane = near.uv >= 0 ? u + v - AlongAxis(near.uv, *vertex) : mean;
      foretold = plane_error_ < mean_error_ ? plane : mean;
      spread = static_cast<size_t>(std::bit_width(static_cast<uint64_t>(std::abs(u - v))));
      kind = near.uv >= 0 ? 3 : 2;
    } else if (near.u >= 0 || near.v >= 0) {
      foretold = AlongAxis(std::max(near.u, near.v), *vertex);
      kind = 1;
    }
    foretold = std::clamp<int64_t>(foretold, 1, size_.pitch - 1);
    NumberModel& model = fractions_[kind * kSpreadMax + std::min(spread, kSpreadMax - 1)];
    const int64_t fraction = foretold + model.Code(vertex->fraction - foretold, bits_);
    if (fraction <= 0 || fraction >= size_.pitch) return false;
    vertex->fraction = static_cast<int32_t>(fraction);
    if (kind == 3) {
      plane_error_ += (std::abs(plane - fraction) * 16 - plane_error_) / 16;
      mean_error_ += (std::abs(mean - fraction) * 16 - mean_error_) / 16;
    }
    return true;
  }

  // At most two vertices that resemble the next one; -1 = none.
  std::array<int32_t, 2> References(const Near& near, const LatticePoint& cell, uint32_t mask) {
    if (near.u >= 0 && near.v >= 0) return {near.u, near.v};
    if (near.u >= 0 || near.v >= 0) return {std::max(near.u, near.v), -1};
    if (mask != 0) return {*OnEdge(cell, std::countr_zero(mask)), -1};
    return {static_cast<int32_t>(mesh_->vertices.size()) - 1, -1};
  }

  bool CodeMeaning(const std::array<int32_t, 2>& references, VertexCode* code) {
    static const VertexCode kNothing;
    const VertexCode* first =
        references[0] < 0 ? &kNothing : &mesh_->codes[static_cast<size_t>(references[0])];
    const VertexCode* second =
        references[1] < 0 ? first : &mesh_->codes[static_cast<size_t>(references[1])];
    const size_t kind = references[1] >= 0 ? 1 : 0;
    if (size_.has_normals && !CodeNormal(*first, *second, kind, &code->normal)) return false;
    if (size_.has_colors && !CodeColor(*first, *second, kind, &code->color)) return false;
    code->meaning = CodeListed(code->meaning, first->meaning, second->meaning, kind, &same_meaning_,
                               &meanings_);
    code->times = CodeListed(code->times, first->times, second->times, kind, &same_times_, &times_);
    return code->meaning < size_.meaning_count && code->times < size_.times_count;
  }

  bool CodeNormal(const VertexCode& first, const VertexCode& second, size_t kind,
                  NormalCode* normal) {
    if (bits_->Bit(normal->side == first.normal.side, &same_side_)) {
      normal->side = first.normal.side;
    } else {
      normal->side = static_cast<uint8_t>(sides_.Code(normal->side, bits_));
      if (normal->side > 5) return false;
    }
    int foretold_u = 0;
    int foretold_v = 0;
    size_t context = 2;
    if (normal->side == first.normal.side) {
      const bool has_both = kind == 1 && second.normal.side == first.normal.side;
      const NormalCode& other = has_both ? second.normal : first.normal;
      foretold_u = (first.normal.u + other.u) / 2;
      foretold_v = (first.normal.v + other.v) / 2;
      context = has_both ? 1 : 0;
    }
    const int64_t u = foretold_u + normals_[context * 2].Code(normal->u - foretold_u, bits_);
    const int64_t v = foretold_v + normals_[context * 2 + 1].Code(normal->v - foretold_v, bits_);
    if (std::max(std::abs(u), std::abs(v)) > kNormalSteps) return false;
    normal->u = static_cast<int8_t>(u);
    normal->v = static_cast<int8_t>(v);
    return true;
  }

  // Green first; red and blue differ from what is foretold much as it does.
  bool CodeColor(const VertexCode& first, const VertexCode& second, size_t kind, uint32_t* color) {
    int64_t green_residual = 0;
    uint32_t coded = 0;
    for (const int shift : {8, 16, 0}) {
      const auto foretold = static_cast<int64_t>(
          ((first.color >> shift & 0xff) + (second.color >> shift & 0xff)) / 2);
      const int64_t residual = static_cast<int64_t>(*color >> shift & 0xff) - foretold;
      NumberModel& model = colors_[kind * 3 + static_cast<size_t>(shift / 8)];
      const int64_t coded_residual = green_residual + model.Code(residual - green_residual, bits_);
      if (shift == 8) green_residual = coded_residual;
      const int64_t value = foretold + coded_residual;
      if (value < 0 || value > 255) return false;
      coded |= static_cast<uint32_t>(value) << shift;
    }
    *color = coded;
    return true;
  }

  // As one of two neighbours, or a number of a list.
  uint32_t CodeListed(uint32_t value, uint32_t first, uint32_t second, size_t kind,
                      std::array<BitModel, 4>* same, ListModel* list) {
    const size_t context = kind == 0 ? 0 : first == second ? 1 : 2;
    if (bits_->Bit(value == first, &(*same)[context])) return first;
    if (context == 2 && bits_->Bit(value == second, &(*same)[3])) return second;
    return list->Code(value, bits_);
  }

  static constexpr size_t kKnownMax = 7;

  const WalkSize size_;
  const MeshLattice* lattice_;
  const std::vector<VertexCode>* told_;
  Bits* bits_;
  WalkedMesh* mesh_;
  const size_t row_length_;
  const size_t layer_length_;
  std::array<size_t, kEdgesPerCell> edge_offsets_{};
  std::vector<int32_t> vertex_on_edge_;
  std::vector<uint8_t> row_is_near_;
  std::vector<int32_t> pattern_of_mask_;
  std::vector<Pattern> patterns_;
  size_t next_cell_ = 0;
  bool had_row_ = false;
  int64_t plane_error_ = 0;
  int64_t mean_error_ = 0;

  std::array<BitModel, 4> rows_;
  std::array<BitModel, 2 * (kKnownMax + 1)> occupied_;
  SymbolModel<kFaceCountBits> face_counts_;
  std::array<std::array<SymbolModel<kEdgeBits>, kEdgesPerCell>, 3> edges_;
  std::array<NumberModel, 4 * kSpreadMax> fractions_;
  BitModel same_side_;
  SymbolModel<3> sides_;
  std::array<NumberModel, 6> normals_;
  std::array<NumberModel, 6> colors_;
  std::array<BitModel, 4> same_meaning_;
  std::array<BitModel, 4> same_times_;
  ListModel meanings_;
  ListModel times_;
};

}  // namespace

void EncodeWalk(const WalkSize& size, const MeshLattice& lattice,
                const std::vector<VertexCode>& codes, std::string* out) {
  BitSource bits(out);
  WalkedMesh mesh;
  // Models take some 100 KiB.
  DSG_CHECK(std::make_unique<Walk<BitSource>>(size, &lattice, &codes, &bits, &mesh)->Run());
  bits.Finish();
}

bool DecodeWalk(const WalkSize& size, std::string_view bytes, WalkedMesh* mesh) {
  BitSink bits(bytes);
  return std::make_unique<Walk<BitSink>>(size, nullptr, nullptr, &bits, mesh)->Run() &&
         bits.IsAtEnd();
}

}  // namespace dsg
