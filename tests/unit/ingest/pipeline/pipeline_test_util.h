// SPDX-License-Identifier: Apache-2.0
// Hand-made rooms and places, and a writer that fails, for the tests of the pipeline.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "ingest/presence/region_index.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/node.h"
#include "schema/store/graph_writer.h"

namespace dsg::ingest {

inline constexpr NodeId kAnna('H', 1);

/// A room with outline [x0, x1] x [y0, y1] from z0 to z1.
inline Node MakeRoom(uint64_t index, double x0, double y0, double x1, double y1, double z0 = 0.0,
                     double z1 = 3.0) {
  Node room;
  room.id = NodeId('R', index);
  room.layer = layers::kRooms;
  room.kind = kinds::kRoom;
  room.map_T_node.position = {0.5 * (x0 + x1), 0.5 * (y0 + y1), z0};
  room.box_node = Box3d(Eigen::Vector3d(-0.5 * (x1 - x0), -0.5 * (y1 - y0), 0.0),
                        Eigen::Vector3d(0.5 * (x1 - x0), 0.5 * (y1 - y0), z1 - z0));
  room.region = RegionInfo{{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, z0, z1, {}};
  return room;
}

inline Node MakePlace(uint64_t index, double x, double y, double z = 0.0) {
  Node place;
  place.id = NodeId('p', index);
  place.layer = layers::kPlaces;
  place.kind = kinds::kPlace;
  place.map_T_node.position = {x, y, z};
  place.place.emplace();
  return place;
}

/// Passes commits on, keeps a copy of each, and breaks down after a given count of them.
class FragileWriter : public GraphWriter {
 public:
  FragileWriter(GraphWriter& writer, int commit_count_max)
      : writer_(writer), commits_left_(commit_count_max) {}

  absl::StatusOr<CommitResult> Commit(GraphDelta delta) override {
    if (commits_left_-- == 0) return absl::InternalError("the power went out");
    deltas_.push_back(DeltaToJson(delta));
    return writer_.Commit(std::move(delta));
  }
  absl::StatusOr<SessionState> GetSession(const std::string& session_id) override {
    return writer_.GetSession(session_id);
  }

  const std::vector<std::string>& deltas() const { return deltas_; }

 private:
  GraphWriter& writer_;
  int commits_left_;
  std::vector<std::string> deltas_;
};

}  // namespace dsg::ingest
