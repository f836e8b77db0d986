// SPDX-License-Identifier: Apache-2.0
// Voxel blocks as bytes and back, for blocks that wait on disk.
// The form is of one process: it goes by this machine's byte order and has no version.
#pragma once

#include <string>
#include <string_view>

#include "ingest/volume/voxel_block.h"

namespace dsg::ingest {

/// 7.2 kB, and with labels 1 kB and 24 bytes a voxel that has some.
std::string EncodeBlock(const VoxelBlock& block);

/// False, and `block` is of no use, if these are no bytes of a block. The key is the caller's.
bool DecodeBlock(std::string_view bytes, VoxelBlock* block);

}  // namespace dsg::ingest
