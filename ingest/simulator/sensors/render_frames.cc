// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/render_frames.h"

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/simulator/sensors/frame_files.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

absl::Status WriteFrame(const SensorSession& session, int64_t frame,
                        const std::string& log_folder) {
  if (IsFrameComplete(session, frame, log_folder)) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(std::vector<FrameFile> files, RenderFrame(session, frame, log_folder));
  for (FrameFile& file : files) {
    DSG_RETURN_IF_ERROR(ingest::WriteFile(file.path, std::move(file.bytes)));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ForEachInParallel(int64_t count, int thread_count, const char* step,
                               const SensorsProgress& progress,
                               const std::function<absl::Status(int64_t)>& work) {
  std::atomic<int64_t> next = 0;
  std::mutex mutex;
  int64_t done_count = 0;
  absl::Status first_error;
  const auto run = [&] {
    while (true) {
      const int64_t index = next.fetch_add(1);
      if (index >= count) return;
      const absl::Status status = work(index);
      const std::lock_guard lock(mutex);
      if (!status.ok()) {
        if (first_error.ok()) first_error = status;
        next = count;
        return;
      }
      ++done_count;
      if (progress) progress(step, static_cast<double>(done_count) / static_cast<double>(count));
    }
  };
  std::vector<std::jthread> threads;
  for (int i = 1; i < thread_count; ++i) threads.emplace_back(run);
  run();
  threads.clear();
  return first_error;
}

absl::Status RenderFrames(const SensorSession& session, const FrameRange& range,
                          const std::string& log_folder, int thread_count,
                          const SensorsProgress& progress) {
  for (const ImageChannel& channel : ImageChannels()) {
    DSG_RETURN_IF_ERROR(ingest::MakeFolder(ChannelFolder(log_folder, channel.name) + "/data"));
  }
  return ForEachInParallel(
      range.end - range.begin, thread_count, "rendering", progress,
      [&](int64_t index) { return WriteFrame(session, range.begin + index, log_folder); });
}

}  // namespace dsg::simulator
