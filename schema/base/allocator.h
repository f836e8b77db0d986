// SPDX-License-Identifier: Apache-2.0
// How the allocator treats freed memory. For the beginning of a program.
#pragma once

#include <cstddef>

namespace dsg {

/// Keeps up to `bytes_an_arena` of freed memory, and takes blocks of up to 32 MiB from it, instead
/// of returning each to the kernel at once: programs that make and free a megabyte for each message
/// or image otherwise spend their time in page faults, above all on virtual machines.
///
/// bytes_an_arena: the allocator has an arena for about each thread that allocates much.
///
/// Threads: call it before the first thread starts.
void KeepFreedMemory(size_t bytes_an_arena);

}  // namespace dsg
