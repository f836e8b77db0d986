// SPDX-License-Identifier: Apache-2.0
// Two maps of one building to merge, over the service or by the program, in one line each.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/run.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/schema/merge/perceived_half.h"

namespace dsg::test {

// Maps "west" and "east" of an apartment, seen with noise in frames of their own.
class TwoHalves {
 public:
  TwoHalves() {
    const simulator::World world = MakeWorld(simulator::WorldKind::kWing, 1);
    auto store = *GraphStore::Open(folder_.path(), {});
    PerceiveOptions west;
    west.to = 0.65;
    west.seed = 5;
    StoreMap(store.get(), "west", Perceive(world, west).delta);
    PerceiveOptions east;
    east.from = 0.3;
    east.seed = 6;
    east.map_T_world = SomeTransform(6);
    truth_ = east.map_T_world.Inverse();
    StoreMap(store.get(), "east", Perceive(world, east).delta);
  }

  const std::string& folder() const { return folder_.path(); }
  const Pose3d& truth() const { return truth_; }

  absl::StatusOr<std::vector<v1::MergeMapsResponse>> Merge(const v1::MergeMapsRequest& request) {
    const auto core = OpenCore(folder());
    std::vector<v1::MergeMapsResponse> messages;
    DSG_RETURN_IF_ERROR(query::ReadStream(query::CallContext(),
                                          core->MergeMaps(query::CallContext(), request),
                                          [&](const v1::MergeMapsResponse& message) {
                                            messages.push_back(message);
                                            return true;
                                          }));
    return messages;
  }

  int Run(std::vector<std::string> arguments, std::string* out, std::string* errors) {
    arguments.insert(arguments.begin() + 1, {"--store", folder()});
    std::ostringstream text;
    std::ostringstream problems;
    const int code = cli::Run(arguments, {}, text, problems);
    *out = text.str();
    *errors = problems.str();
    return code;
  }

 private:
  TempFolder folder_;
  Pose3d truth_;
};

inline v1::MergeMapsRequest WestWithEast() {
  v1::MergeMapsRequest request;
  request.set_map("west");
  request.set_other("east");
  return request;
}

}  // namespace dsg::test
