// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/block_span.h"

namespace dsg::merge {

Box3d BoxOf(BlockIndex index, double block_size_m) {
  const Eigen::Vector3d low(index.x * block_size_m, index.y * block_size_m, index.z * block_size_m);
  return Box3d(low, low.array() + block_size_m);
}

std::vector<BlockIndex> BlocksIn(const Box3d& box, double block_size_m) {
  const BlockIndex low = BlockOf(box.min().cast<float>(), block_size_m);
  const BlockIndex high = BlockOf(box.max().cast<float>(), block_size_m);
  std::vector<BlockIndex> blocks;
  for (int32_t x = low.x; x <= high.x; ++x) {
    for (int32_t y = low.y; y <= high.y; ++y) {
      for (int32_t z = low.z; z <= high.z; ++z) blocks.push_back({x, y, z});
    }
  }
  return blocks;
}

}  // namespace dsg::merge
