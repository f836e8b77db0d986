// SPDX-License-Identifier: Apache-2.0
// A small office in a real store, for tests of the engine and the server. Every number of it that a
// test relies on is written here.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "query/service/service_core.h"
#include "schema/base/random.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::test {

inline constexpr TimeNs kSecond = kNsPerSecond;
inline constexpr char kMap[] = "office";

/// Building B1 holds rooms R1 (x 0 to 10) and R2 (x 10 to 20), y 0 to 10, z 0 to 3; R1 holds places
/// p1 (x 1 to 4) and p2 (x 5 to 8), R2 holds p3 (x 12 to 18); object O1 "cup" is in p1, O2 "chair"
/// in p3. p1 - p2 - p3 are traversable. Everything is valid for ever.
///
/// H12, called "12": x = 1 + t, y = 5, z = 1 at t = 0 s, 1 s, ... 18 s; then nothing until x = 19
/// at 60, 61 and 62 s. Stays: p1, R1 [0, 4); p2, R1 [4, 9); p3, R2 [9, 19); p3, R2 [60, open). H13,
/// called "13": stands at x = 3, y = 5, z = 1 from 2 s to 12 s, a pose a second, no orientation;
/// stay p1, R1 [2, 12). r1, called "spot": one pose at 5 s at x = 15, no stay.
GraphDelta OfficeDelta();

/// OfficeDelta as revision 1 of a lossless map "office" in `folder`. Fails the test on errors.
void MakeOffice(const std::string& folder);

/// Commits to the map of MakeOffice; sequences count on. Fails the test on errors.
void CommitToOffice(const std::string& folder, GraphDelta delta);

std::unique_ptr<query::ServiceCore> OpenCore(const std::string& folder);

TimedPose PoseAt(TimeNs time_ns, double x, double y, double z);
/// Adds `side` x `side` mesh blocks of 1,000 triangles each, with vertices anywhere in their block.
void AddRandomMesh(int side, Random* random, GraphDelta* delta);
Node MakeNode(NodeId id, LayerId layer, const std::string& kind, const std::string& name,
              const Box3d& box_map);

}  // namespace dsg::test
