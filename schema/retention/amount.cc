// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/amount.h"

#include <algorithm>
#include <set>

#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"

namespace dsg {
namespace {

// Shapes of one segment, of which only the bytes are wanted.
class ShapeBytes {
 public:
  ShapeBytes(TrajectoryCodec codec, Amount* amount) : codec_(codec), amount_(*amount) {}
  ~ShapeBytes() { Flush(); }

  void Add(const ShownShape& shown) {
    if (segment_.topology != shown.topology || segment_.shapes.size() == kShapesPerSegmentMax) {
      Flush();
    }
    segment_.topology = shown.topology;
    segment_.shapes.push_back(shown.shape);
    ++amount_.shape_count;
  }

 private:
  void Flush() {
    if (!segment_.shapes.empty()) {
      amount_.byte_count += static_cast<int64_t>(EncodeShapes(segment_, codec_).size());
    }
    segment_.shapes.clear();
  }

  const TrajectoryCodec codec_;
  Amount& amount_;
  ShapeAppend segment_;
};

absl::Status CountGraph(const Snapshot& map, const StopCheck& stop, Amount* amount,
                        std::set<Sha256>* assets) {
  DSG_RETURN_IF_ERROR(map.ReadAllNodes(stop, [&](const Node& node) {
    amount->byte_count += static_cast<int64_t>(EncodeNodePayload(node).size());
    for (const Sha256& asset : AssetsOf(node)) assets->insert(asset);
  }));
  return map.ReadAllEdges(stop, [&](const Edge& edge) {
    amount->byte_count += static_cast<int64_t>(EncodeEdgePayload(edge).size());
  });
}

absl::Status CountTracks(const Snapshot& map, const StopCheck& stop, Amount* amount,
                         std::set<Sha256>* assets) {
  DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, map.Tracks(stop));
  std::vector<Sha256> topologies;
  for (const TrackInfo& track : tracks) {
    PoseBytes poses(map.spec().codec);
    DSG_RETURN_IF_ERROR(
        map.ReadPoses(track.agent, kTimeMin, kTimeMax, stop, [&](const TimedPose& pose) {
          poses.Add(pose);
          return true;
        }));
    poses.FlushTo(amount);
    DSG_RETURN_IF_ERROR(CountBatches(map, track.agent, Interval(), stop, amount, &topologies));
  }
  assets->insert(topologies.begin(), topologies.end());
  return absl::OkStatus();
}

}  // namespace

int64_t Amount::RowCount() const {
  return node_count + edge_count + pose_count + shape_count + factor_count + stay_count +
         mesh_block_count + asset_count + revision_count;
}

Amount& Amount::operator+=(const Amount& other) {
  node_count += other.node_count;
  edge_count += other.edge_count;
  pose_count += other.pose_count;
  shape_count += other.shape_count;
  factor_count += other.factor_count;
  stay_count += other.stay_count;
  stay_edit_count += other.stay_edit_count;
  mesh_block_count += other.mesh_block_count;
  asset_count += other.asset_count;
  revision_count += other.revision_count;
  byte_count += other.byte_count;
  return *this;
}

void PoseBytes::Add(const TimedPose& pose) {
  ++count_;
  const StoredPose stored = ToStored(pose, codec_);
  if (encoder_.Add(stored)) return;
  CloseSegment();
  encoder_.Add(stored);
}

void PoseBytes::CloseSegment() {
  if (!encoder_.empty()) byte_count_ += static_cast<int64_t>(encoder_.Encode().size());
  encoder_ = SegmentEncoder(codec_);
}

void PoseBytes::FlushTo(Amount* amount) {
  CloseSegment();
  amount->pose_count += count_;
  amount->byte_count += byte_count_;
  count_ = 0;
  byte_count_ = 0;
}

int64_t BytesOf(const std::vector<PoseFactor>& factors) {
  return factors.empty() ? 0 : static_cast<int64_t>(EncodeFactors(factors).size());
}

bool HasEndIn(const PoseFactor& factor, NodeId agent, const Interval& span) {
  const bool ends_here = factor.to_agent.empty() || factor.to_agent == agent;
  return span.Contains(factor.from_ns) || (ends_here && span.Contains(factor.to_ns));
}

absl::Status CountBatches(const Snapshot& map, NodeId agent, const Interval& span,
                          const StopCheck& stop, Amount* amount, std::vector<Sha256>* topologies) {
  {
    ShapeBytes bytes(map.spec().codec, amount);
    DSG_RETURN_IF_ERROR(
        map.ReadShapes(agent, span.from_ns, span.to_ns, /*with_vertices=*/true, stop,
                       [&](const ShownShape& shown) {
                         bytes.Add(shown);
                         if (topologies != nullptr && shown.topology &&
                             (topologies->empty() || topologies->back() != *shown.topology)) {
                           topologies->push_back(*shown.topology);
                         }
                         return true;
                       }));
  }
  DSG_ASSIGN_OR_RETURN(std::vector<PoseFactor> factors,
                       map.Factors(agent, span.from_ns, span.to_ns));
  std::erase_if(factors, [&](const PoseFactor& factor) { return !HasEndIn(factor, agent, span); });
  amount->factor_count += static_cast<int64_t>(factors.size());
  amount->byte_count += BytesOf(factors);
  return absl::OkStatus();
}

absl::StatusOr<Amount> CountMap(const Snapshot& map, const StopCheck& stop) {
  Amount amount;
  DSG_ASSIGN_OR_RETURN(const MapStats stats, map.Stats());
  std::set<Sha256> assets;
  DSG_RETURN_IF_ERROR(CountGraph(map, stop, &amount, &assets));
  DSG_RETURN_IF_ERROR(CountTracks(map, stop, &amount, &assets));
  amount.node_count = stats.at.node_count;
  amount.edge_count = stats.at.edge_count;
  amount.stay_count = stats.at.stay_count;
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> blocks, map.MeshBlocks());
  amount.mesh_block_count = static_cast<int64_t>(blocks.size());
  for (const BlockIndex& index : blocks) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const MeshBlock block, map.ReadMeshBlock(index));
    amount.byte_count += static_cast<int64_t>(EncodeMeshBlock(block).size());
  }
  amount.asset_count = static_cast<int64_t>(assets.size());
  for (const Sha256& sha256 : assets) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const Asset asset, map.ReadAsset(sha256));
    amount.byte_count += static_cast<int64_t>(asset.content.size());
  }
  return amount;
}

}  // namespace dsg
