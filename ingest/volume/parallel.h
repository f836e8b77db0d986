// SPDX-License-Identifier: Apache-2.0
// Runs independent pieces of work on a few threads.
// Refuses work whose result depends on the order of the pieces.
#pragma once

#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace dsg::ingest {

/// Calls task(0) ... task(count - 1), each once, on up to `thread_count` threads.
template <typename Task>
void ParallelFor(int thread_count, size_t count, const Task& task) {
  std::atomic<size_t> next{0};
  const auto work = [&] {
    for (size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1)) task(i);
  };
  std::vector<std::thread> helpers;
  for (int i = 1; i < thread_count && static_cast<size_t>(i) < count; ++i) {
    helpers.emplace_back(work);
  }
  work();
  for (std::thread& helper : helpers) helper.join();
}

}  // namespace dsg::ingest
