// SPDX-License-Identifier: Apache-2.0
// Real rooms without labels through the real program: there is furniture, and nothing that is as
// large as the room or lies on its floor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "schema/model/layer.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

struct RoomLog {
  const char* name;
  size_t objects_min;
  size_t objects_max;
};

class RealRoomsTest : public testing::TestWithParam<RoomLog> {
 protected:
  void SetUp() override {
    const char* const given = std::getenv("DSG_DATA");
    const std::filesystem::path data =
        given != nullptr ? std::filesystem::path(given)
                         : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
    const std::filesystem::path log = data / GetParam().name;
    if (!std::filesystem::is_directory(log)) {
      GTEST_SKIP() << "no " << log << "; set DSG_DATA to the folder of logs";
    }
    const std::string command = std::string(DSG_BINARY_DIR) +
                                "/dsg-ingest --quiet --poses external --map room --store " +
                                folder_.path() + " " + log.string();
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    auto store = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    auto map = (*store)->OpenMap("room");
    ASSERT_TRUE(map.ok()) << map.status();
    NodeFilter filter;
    filter.layer = layers::kObjects;
    const absl::Status status =
        (*map)->Latest()->get()->ScanNodes(filter, {}, {}, [this](const Node& node) {
          objects_.push_back(node);
          return true;
        });
    ASSERT_TRUE(status.ok()) << status;
  }

  test::TempFolder folder_;
  std::vector<Node> objects_;
};

TEST_P(RealRoomsTest, ObjectsAreOfTheSizeOfFurniture) {
  EXPECT_GE(objects_.size(), GetParam().objects_min);
  EXPECT_LE(objects_.size(), GetParam().objects_max);
  for (const Node& object : objects_) {
    Eigen::Vector3d size = object.box_node.sizes();
    std::sort(size.begin(), size.end());
    EXPECT_LE(size[2], 3.0 + 1e-3) << ToString(object.id);
    EXPECT_GE(size[2], 0.15 - 1e-3) << ToString(object.id);
  }
}

// Looked at as pictures: a kitchen with a table, a living room, two views of an office.
INSTANTIATE_TEST_SUITE_P(Logs, RealRoomsTest,
                         testing::Values(RoomLog{"rgbd-7scenes", 5, 25},
                                         RoomLog{"rgbd-livingroom1", 2, 10},
                                         RoomLog{"rgbd-replica-office0", 2, 10}),
                         [](const auto& log) {
                           std::string name = log.param.name;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace dsg
