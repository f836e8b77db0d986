// SPDX-License-Identifier: Apache-2.0
#include "query/engine/mesh.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/scene.pb.h"
#include "query/engine/coarse_mesh.h"
#include "query/engine/engine.h"
#include "query/engine/mesh_columns.h"
#include "query/engine/node_mesh.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/snapshot.h"

namespace dsg::query {
namespace {

// About 60 bytes a vertex and 9 a face on the wire: below 2 MiB.
constexpr size_t kVerticesPerPiece = 20'000;
// A closed surface has two; a block of few vertices may still repeat its faces without end.
constexpr size_t kFacesPerVertexMax = 3;
constexpr uint32_t kNotYet = std::numeric_limits<uint32_t>::max();

// Collects faces of one block into pieces.
class BlockCutter {
 public:
  BlockCutter(const MeshBlock& block, size_t vertex_count_max)
      : block_(block),
        vertex_count_max_(vertex_count_max),
        local_(block.positions_map.size(), kNotYet),
        is_sent_(block.positions_map.size(), false) {
    Begin();
  }

  std::vector<MeshBlock> Cut() {
    for (const std::array<uint32_t, 3>& face : block_.faces) {
      if (piece_.positions_map.size() + 3 > vertex_count_max_ ||
          piece_.faces.size() == kFacesPerVertexMax * vertex_count_max_) {
        End();
      }
      piece_.faces.push_back({Take(face[0]), Take(face[1]), Take(face[2])});
    }
    for (uint32_t i = 0; i < is_sent_.size(); ++i) {
      if (is_sent_[i]) continue;
      if (piece_.positions_map.size() >= vertex_count_max_) End();
      Take(i);
    }
    End();
    return std::move(pieces_);
  }

 private:
  void Begin() {
    piece_ = MeshBlock();
    piece_.index = block_.index;
  }

  void End() {
    if (piece_.positions_map.empty()) return;
    for (const uint32_t index : taken_) local_[index] = kNotYet;
    taken_.clear();
    pieces_.push_back(std::move(piece_));
    Begin();
  }

  template <class T>
  static void CopyOne(const std::vector<T>& from, uint32_t index, std::vector<T>* to) {
    if (!from.empty()) to->push_back(from[index]);
  }

  // The vertex's index in the current piece.
  uint32_t Take(uint32_t index) {
    if (local_[index] != kNotYet) return local_[index];
    local_[index] = static_cast<uint32_t>(piece_.positions_map.size());
    is_sent_[index] = true;
    taken_.push_back(index);
    CopyOne(block_.positions_map, index, &piece_.positions_map);
    CopyOne(block_.normals_map, index, &piece_.normals_map);
    CopyOne(block_.colors, index, &piece_.colors);
    CopyOne(block_.labels, index, &piece_.labels);
    CopyOne(block_.instance_ids, index, &piece_.instance_ids);
    CopyOne(block_.first_seen_ns, index, &piece_.first_seen_ns);
    CopyOne(block_.last_seen_ns, index, &piece_.last_seen_ns);
    return local_[index];
  }

  const MeshBlock& block_;
  const size_t vertex_count_max_;
  // By index in the block: the index in the current piece.
  std::vector<uint32_t> local_;
  std::vector<bool> is_sent_;
  std::vector<uint32_t> taken_;
  MeshBlock piece_;
  std::vector<MeshBlock> pieces_;
};

Box3d CubeOf(BlockIndex index, double size_m) {
  const Eigen::Vector3d low = size_m * Eigen::Vector3d(index.x, index.y, index.z);
  return Box3d(low, low + Eigen::Vector3d::Constant(size_m));
}

// How blocks are shown.
struct MeshForm {
  // 0 = as they are stored.
  double cell_m = 0.0;
  bool normals = true;
  bool colors = true;
  bool labels = true;
  bool instances = true;
  bool times = true;
  v1::MeshEncoding encoding = v1::MESH_ENCODING_FIELDS;
};

absl::Status TakeChannels(const v1::GetMeshRequest& request, MeshForm* form) {
  if (request.channels().empty()) return absl::OkStatus();
  form->normals = form->colors = form->labels = form->instances = form->times = false;
  for (const int channel : request.channels()) {
    switch (channel) {
      case v1::MESH_CHANNEL_NONE:
        break;
      case v1::MESH_CHANNEL_NORMALS:
        form->normals = true;
        break;
      case v1::MESH_CHANNEL_COLORS:
        form->colors = true;
        break;
      case v1::MESH_CHANNEL_LABELS:
        form->labels = true;
        break;
      case v1::MESH_CHANNEL_INSTANCES:
        form->instances = true;
        break;
      case v1::MESH_CHANNEL_TIMES:
        form->times = true;
        break;
      default:
        return FieldError("channels", absl::StrCat(channel),
                          "name normals, colors, labels, instances, times or none");
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<MeshForm> FormOf(const v1::GetMeshRequest& request) {
  // A cell below the voxels of any mesh would only cost time.
  constexpr double kCellMinM = 0.001;
  constexpr double kCellMaxM = 100.0;
  MeshForm form;
  form.cell_m = request.cell_m();
  if (form.cell_m != 0.0 && !(form.cell_m >= kCellMinM && form.cell_m <= kCellMaxM)) {
    return FieldError("cell_m", absl::StrCat(request.cell_m()),
                      "give 0.001 to 100 metres, or 0 for the mesh as it is stored");
  }
  if (!v1::MeshEncoding_IsValid(request.encoding())) {
    return FieldError("encoding", absl::StrCat(request.encoding()),
                      "name fields, columns or coarse columns");
  }
  if (request.encoding() != v1::MESH_ENCODING_UNSPECIFIED) form.encoding = request.encoding();
  DSG_RETURN_IF_ERROR(TakeChannels(request, &form));
  return form;
}

void TakeForm(const MeshForm& form, MeshBlock* block) {
  if (!form.normals) block->normals_map.clear();
  if (!form.colors) block->colors.clear();
  if (!form.labels) block->labels.clear();
  if (!form.instances) block->instance_ids.clear();
  if (!form.times) block->first_seen_ns.clear();
  if (!form.times) block->last_seen_ns.clear();
  if (form.cell_m > 0.0) *block = CoarsenBlock(*block, form.cell_m);
}

class MeshCursor final : public EngineCursor<v1::GetMeshResponse> {
 public:
  /// Without `part` whole blocks.
  MeshCursor(const ReadView& view, std::vector<BlockIndex> blocks, std::optional<NodeMesh> part,
             const MeshForm& form)
      : view_(view), blocks_(std::move(blocks)), part_(std::move(part)), form_(form) {}

  bool done() const override {
    return next_block_ == blocks_.size() && next_piece_ == pieces_.size();
  }

 private:
  absl::Status Fill(const CallContext& call, v1::GetMeshResponse* reply) override {
    if (is_first_) view_.FillHeader(reply->mutable_header());
    is_first_ = false;
    size_t bytes = 0;
    while (!done() && bytes < kPageBytesSoftMax) {
      DSG_RETURN_IF_ERROR(call.Check());
      if (next_piece_ == pieces_.size()) DSG_RETURN_IF_ERROR(ReadBlock());
      if (next_piece_ == pieces_.size()) continue;
      bytes += Send(pieces_[next_piece_++], reply);
    }
    return absl::OkStatus();
  }

  // Returns how many bytes it takes.
  size_t Send(const MeshBlock& piece, v1::GetMeshResponse* reply) const {
    if (form_.encoding == v1::MESH_ENCODING_FIELDS) {
      v1::MeshBlock* out = reply->add_blocks();
      ToProto(piece, out);
      return out->ByteSizeLong();
    }
    v1::MeshColumns* out = reply->add_columns();
    FillMeshColumns(piece, /*is_coarse=*/form_.encoding == v1::MESH_ENCODING_COARSE_COLUMNS, out);
    return out->ByteSizeLong();
  }

  absl::Status ReadBlock() {
    DSG_ASSIGN_OR_RETURN(MeshBlock block, view_.snapshot().ReadMeshBlock(blocks_[next_block_]));
    ++next_block_;
    next_piece_ = 0;
    pieces_.clear();
    if (part_.has_value()) block = part_->Cut(block);
    // Of a node a block without any of its faces says nothing.
    if (part_.has_value() && block.faces.empty()) return absl::OkStatus();
    TakeForm(form_, &block);
    pieces_ = CutBlock(std::move(block), kVerticesPerPiece);
    return absl::OkStatus();
  }

  const ReadView view_;
  const std::vector<BlockIndex> blocks_;
  const std::optional<NodeMesh> part_;
  const MeshForm form_;
  size_t next_block_ = 0;
  std::vector<MeshBlock> pieces_;
  size_t next_piece_ = 0;
  bool is_first_ = true;
};

}  // namespace

std::vector<MeshBlock> CutBlock(MeshBlock block, size_t vertex_count_max) {
  if (block.positions_map.size() > vertex_count_max ||
      block.faces.size() > kFacesPerVertexMax * vertex_count_max) {
    return BlockCutter(block, vertex_count_max).Cut();
  }
  std::vector<MeshBlock> whole;
  whole.push_back(std::move(block));
  return whole;
}

namespace {

// The blocks with triangles where those of the node can be; a face may reach far out of its block.
absl::StatusOr<std::vector<BlockIndex>> BlocksOf(Engine* engine, const CallContext& call,
                                                 const ReadView& view, const NodeMesh& part) {
  DSG_ASSIGN_OR_RETURN(const auto graph, view.Graph(call.stop()));
  const auto facts = engine->collisions.FactsOf(graph);
  DSG_ASSIGN_OR_RETURN(const auto table,
                       engine->collisions.Blocks(facts.get(), view.snapshot(), call.stop()));
  std::vector<BlockIndex> blocks;
  for (const BlockBounds& block : table->blocks()) {
    if (part.bounds_map().intersects(block.bounds.cast<double>())) blocks.push_back(block.block);
  }
  return blocks;
}

absl::StatusOr<NodeMesh> PartOfNode(const CallContext& call, const ReadView& view,
                                    const std::string& id_or_name) {
  DSG_ASSIGN_OR_RETURN(const NodeId id,
                       ResolveOne(view.snapshot(), id_or_name, "node", call.stop()));
  DSG_ASSIGN_OR_RETURN(const Node node, view.snapshot().GetNode(id));
  return NodeMesh::Of(node);
}

}  // namespace

CursorOr<v1::GetMeshResponse> GetMesh(Engine* engine, const CallContext& call,
                                      const v1::GetMeshRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const MeshForm form, FormOf(request));
  std::optional<Box3d> box_map;
  if (request.has_box()) {
    DSG_ASSIGN_OR_RETURN(box_map, BoxFromProto(request.box(), "box"));
  }
  std::optional<NodeMesh> part;
  std::vector<BlockIndex> blocks;
  if (request.node().empty()) {
    DSG_ASSIGN_OR_RETURN(blocks, view.snapshot().MeshBlocks());
  } else {
    DSG_ASSIGN_OR_RETURN(part, PartOfNode(call, view, request.node()));
    DSG_ASSIGN_OR_RETURN(blocks, BlocksOf(engine, call, view, *part));
  }
  std::set<BlockIndex> wanted;
  for (const v1::MeshBlockIndex& index : request.blocks()) {
    wanted.insert({index.x(), index.y(), index.z()});
  }
  const double size_m = view.snapshot().spec().mesh_block_size_m;
  std::erase_if(blocks, [&](const BlockIndex& index) {
    return (box_map.has_value() && !box_map->intersects(CubeOf(index, size_m))) ||
           (!wanted.empty() && !wanted.contains(index));
  });
  return std::make_unique<MeshCursor>(view, std::move(blocks), std::move(part), form);
}

absl::Status ListMeshBlocks(Engine* engine, const CallContext& call,
                            const v1::ListMeshBlocksRequest& request,
                            v1::ListMeshBlocksResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListMeshBlocks", request));
  std::optional<Box3d> box_map;
  if (request.has_box()) {
    DSG_ASSIGN_OR_RETURN(box_map, BoxFromProto(request.box(), "box"));
  }
  std::optional<BlockIndex> last;
  if (!page.is_first()) {
    if (!ReadKey(page.position, &last.emplace())) return PageTokenError();
  }
  const Snapshot& snapshot = page.view.snapshot();
  DSG_ASSIGN_OR_RETURN(const auto blocks, snapshot.MeshBlockVersions(call.stop()));
  page.view.FillHeader(reply->mutable_header());
  for (const auto& [index, revision] : blocks) {
    if (last.has_value() && !(*last < index)) continue;
    if (box_map.has_value() &&
        !box_map->intersects(CubeOf(index, snapshot.spec().mesh_block_size_m))) {
      continue;
    }
    if (reply->blocks_size() == page.size) {
      reply->set_next_page_token(page.NextToken(KeyPosition(*last)));
      break;
    }
    v1::MeshBlockVersion* out = reply->add_blocks();
    out->mutable_index()->set_x(index.x);
    out->mutable_index()->set_y(index.y);
    out->mutable_index()->set_z(index.z);
    out->set_revision(revision);
    last = index;
  }
  return absl::OkStatus();
}

namespace {

class AssetCursor final : public EngineCursor<v1::GetAssetResponse> {
 public:
  AssetCursor(const ReadView& view, const Sha256& sha256) : view_(view), sha256_(sha256) {}

  bool done() const override { return next_part_ == part_count_; }

 private:
  absl::Status Fill(const CallContext&, v1::GetAssetResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(AssetPart part, view_.snapshot().ReadAssetPart(sha256_, next_part_));
    if (next_part_ == 0) {
      view_.FillHeader(reply->mutable_header());
      reply->set_media_type(part.media_type);
      reply->set_size_bytes(part.size_bytes);
    }
    *reply->mutable_content() = std::move(part.content);
    part_count_ = part.part_count;
    ++next_part_;
    return absl::OkStatus();
  }

  const ReadView view_;
  const Sha256 sha256_;
  int64_t next_part_ = 0;
  // Known from the first part on.
  int64_t part_count_ = 1;
};

}  // namespace

CursorOr<v1::GetAssetResponse> GetAsset(Engine* engine, const CallContext&,
                                        const v1::GetAssetRequest& request) {
  Sha256 sha256;
  if (request.sha256().size() != sha256.size()) {
    return FieldError("sha256", absl::StrCat(request.sha256().size(), " bytes"),
                      "give the 32 bytes of the content's SHA-256");
  }
  std::copy(request.sha256().begin(), request.sha256().end(), sha256.begin());
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  // An unknown asset is refused at once, and not in the stream.
  DSG_RETURN_IF_ERROR(view.snapshot().ReadAssetPart(sha256, 0).status());
  return std::make_unique<AssetCursor>(view, sha256);
}

}  // namespace dsg::query
