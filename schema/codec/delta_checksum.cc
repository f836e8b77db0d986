// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/delta_checksum.h"

#include <xxhash.h>

#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "schema/codec/payload.h"
#include "schema/codec/proto_convert.h"

namespace dsg {
namespace {

// Every list and text goes in with its length before it, so that nothing can move from one to the
// next unnoticed.
class Hasher {
 public:
  Hasher() : state_(XXH3_createState(), XXH3_freeState) { XXH3_64bits_reset(state_.get()); }

  int64_t Result() {
    Flush();
    return static_cast<int64_t>(XXH3_64bits_digest(state_.get()));
  }

  template <typename... Values>
  void Add(const Values&... values) {
    (AddOne(values), ...);
  }

  template <typename T, typename AddItem>
  void AddList(const std::vector<T>& items, const AddItem& add_item) {
    Add(items.size());
    for (const T& item : items) add_item(item);
  }

  /// Items without padding.
  template <typename T>
  void AddFlat(const std::vector<T>& items) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_same_v<T, float> ||
                  std::is_same_v<T, Eigen::Vector3f>);
    Add(items.size());
    Bytes(items.data(), items.size() * sizeof(T));
  }

 private:
  // Numbers of a few bytes are gathered first: calls for each were an eighth of all instructions of
  // a commit of poses.
  void Bytes(const void* data, size_t size) {
    if (size > gathered_.size() - gathered_size_) Flush();
    if (size > gathered_.size()) {
      XXH3_64bits_update(state_.get(), data, size);
      return;
    }
    if (size == 0) return;
    std::memcpy(gathered_.data() + gathered_size_, data, size);
    gathered_size_ += size;
  }
  void Flush() {
    XXH3_64bits_update(state_.get(), gathered_.data(), gathered_size_);
    gathered_size_ = 0;
  }

  template <typename T>
  requires std::is_arithmetic_v<T>
  void AddOne(T value) { Bytes(&value, sizeof(value)); }
  void AddOne(std::string_view text) {
    AddOne(text.size());
    Bytes(text.data(), text.size());
  }
  void AddOne(NodeId id) { AddOne(id.value); }
  void AddOne(const BlockIndex& index) { Add(index.x, index.y, index.z); }
  void AddOne(const Sha256& digest) { Bytes(digest.data(), digest.size()); }
  void AddOne(const TrackSpan& span) { Add(span.agent, span.from_ns, span.to_ns); }
  void AddOne(const EdgeKey& key) { Add(key.source, key.relation, key.target); }
  template <typename T>
  void AddOne(const std::optional<T>& value) {
    Add(value.has_value());
    if (value.has_value()) Add(*value);
  }
  void AddOne(const Pose3d& pose) {
    Bytes(pose.position.data(), 3 * sizeof(double));
    Bytes(pose.orientation.coeffs().data(), 4 * sizeof(double));
  }
  void AddOne(const TimedPose& pose) {
    Add(pose.time_ns, pose.flags, pose.map_T_agent, pose.covariance != nullptr);
    if (pose.covariance != nullptr) Bytes(pose.covariance->data(), sizeof(Covariance6));
  }

  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_;
  std::array<char, 2048> gathered_;
  size_t gathered_size_ = 0;
};

void AddGraph(const GraphDelta& delta, Hasher* hasher) {
  hasher->AddList(delta.layers,
                  [&](const Layer& layer) { hasher->Add(layer.id, layer.name, layer.rank); });
  hasher->AddList(delta.labels,
                  [&](const SemanticLabel& label) { hasher->Add(label.id, label.name); });
  hasher->AddList(delta.nodes, [&](const Node& node) {
    hasher->Add(node.id, node.layer, EncodeAllButAttributes(node), node.attributes.size());
    for (const auto& [name, value] : node.attributes) {
      hasher->Add(name, value.index());
      std::visit([&](const auto& held) { hasher->Add(held); }, value);
    }
  });
  const auto add_patch = [&](const auto& patch) {
    hasher->Add(patch.fields);
    hasher->AddList(patch.mask, [&](const std::string& path) { hasher->Add(path); });
  };
  hasher->AddList(delta.node_patches, add_patch);
  hasher->AddList(delta.edge_patches, add_patch);
  hasher->AddList(delta.retirements,
                  [&](const Retirement& item) { hasher->Add(item.id, item.valid_to_ns); });
  hasher->AddList(delta.edges, [&](const Edge& edge) {
    hasher->Add(edge.key(), edge.weight, EncodeEdgePayload(edge));
  });
  hasher->AddList(delta.edge_removals, [&](const EdgeKey& key) { hasher->Add(key); });
}

void AddTracks(const GraphDelta& delta, Hasher* hasher) {
  const auto add_pose = [&](const TimedPose& pose) { hasher->Add(pose); };
  const auto add_span = [&](const TrackSpan& span) { hasher->Add(span); };
  hasher->AddList(delta.appends, [&](const TrajectoryAppend& append) {
    hasher->Add(append.agent);
    hasher->AddList(append.poses, add_pose);
  });
  hasher->AddList(delta.corrections, [&](const TrajectoryCorrection& correction) {
    hasher->Add(correction.agent, correction.from_ns, correction.to_ns);
    hasher->AddList(correction.poses, add_pose);
  });
  hasher->AddList(delta.factor_removals, add_span);
  hasher->AddList(delta.factors, [&](const FactorAppend& append) {
    hasher->Add(append.agent, EncodeFactors(append.factors));
  });
  hasher->AddList(delta.shape_removals, add_span);
  hasher->AddList(delta.shapes, [&](const ShapeAppend& append) {
    hasher->Add(append.agent, append.topology);
    hasher->AddList(append.shapes, [&](const BodyShape& shape) {
      hasher->Add(shape.time_ns);
      hasher->AddFlat(shape.pose_coefficients);
      hasher->AddFlat(shape.shape_coefficients);
      hasher->AddFlat(shape.vertices);
      hasher->AddFlat(shape.joints);
    });
  });
  hasher->AddList(delta.stay_removals,
                  [&](const StayKey& key) { hasher->Add(key.agent, key.enter_ns); });
  hasher->AddList(delta.stays, [&](const Stay& stay) {
    hasher->Add(stay.agent, stay.place, stay.room, stay.enter_ns, stay.exit_ns);
  });
}

void AddMesh(const GraphDelta& delta, Hasher* hasher) {
  hasher->AddList(delta.mesh_blocks, [&](const MeshBlock& block) {
    hasher->Add(block.index);
    hasher->AddFlat(block.positions_map);
    hasher->AddFlat(block.normals_map);
    hasher->AddFlat(block.colors);
    hasher->AddFlat(block.labels);
    hasher->AddFlat(block.instance_ids);
    hasher->AddFlat(block.first_seen_ns);
    hasher->AddFlat(block.last_seen_ns);
    hasher->AddFlat(block.faces);
  });
  hasher->AddList(delta.mesh_removals, [&](const BlockIndex& index) { hasher->Add(index); });
  hasher->AddList(delta.assets, [&](const Asset& asset) {
    hasher->Add(asset.sha256, asset.media_type, asset.content);
  });
}

}  // namespace

int64_t DeltaChecksum(const GraphDelta& delta) {
  Hasher hasher;
  hasher.Add(delta.author, delta.message, delta.config_digest);
  AddGraph(delta, &hasher);
  AddTracks(delta, &hasher);
  AddMesh(delta, &hasher);
  return hasher.Result();
}

}  // namespace dsg
