// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/bag/bag_output_internal.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

constexpr TimeNs kStampEndNs = (TimeNs{1} << 32) * kNsPerSecond;

rosbag::CompressionType Compression(BagCompression compression) {
  switch (compression) {
    case BagCompression::kNone:
      return rosbag::compression::Uncompressed;
    case BagCompression::kBz2:
      return rosbag::compression::BZ2;
    case BagCompression::kLz4:
      return rosbag::compression::LZ4;
  }
  return rosbag::compression::LZ4;
}

}  // namespace

absl::StatusOr<ros::Time> ToRosTime(TimeNs time_ns) {
  if (time_ns <= 0 || time_ns >= kStampEndNs) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat("a bag cannot hold the stamp ", time_ns,
                                  " ns, only 1 to 2^32 s; shift the log's stamps"),
                     {{"field", "stamp"}, {"value", absl::StrCat(time_ns)}});
  }
  return ros::Time(static_cast<uint32_t>(time_ns / kNsPerSecond),
                   static_cast<uint32_t>(time_ns % kNsPerSecond));
}

BagOutput::BagOutput(std::string path, int descriptor)
    : path_(std::move(path)), part_path_(path_ + ".part"), descriptor_(descriptor) {}

absl::StatusOr<std::unique_ptr<BagOutput>> BagOutput::Create(const std::string& path,
                                                             BagCompression compression) {
  const std::string part = path + ".part";
  const int descriptor = open(part.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("cannot create ", part, ": ", std::strerror(errno),
                                  "; name a folder you may write to"),
                     {{"path", path}});
  }
  std::unique_ptr<BagOutput> file(new BagOutput(path, descriptor));
  DSG_RETURN_IF_ERROR(file->Guard("open", [&] {
    file->bag_ = std::make_unique<rosbag::Bag>();
    file->bag_->setCompression(Compression(compression));
    file->bag_->open(part, rosbag::bagmode::Write);
  }));
  return file;
}

BagOutput::~BagOutput() {
  if (descriptor_ >= 0) Discard();
}

absl::Status BagOutput::Failure(const char* what, int error, const std::string& detail) const {
  const std::string message =
      absl::StrCat("cannot ", what, " ", part_path_, ": ", detail,
                   error == 0 ? std::string() : absl::StrCat(" (", std::strerror(error), ")"));
  // EFBIG is the limit of a shell on file sizes: the cure is the same.
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    return MakeError(Reason::kDiskFull, absl::StrCat(message, "; free some space"),
                     {{"path", path_}});
  }
  return absl::UnavailableError(message);
}

absl::Status BagOutput::Commit() {
  DSG_RETURN_IF_ERROR(Guard("finish", [&] { bag_->close(); }));
  if (fsync(descriptor_) != 0) return Failure("sync", errno, "fsync");
  if (std::rename(part_path_.c_str(), path_.c_str()) != 0) {
    return Failure("rename", errno, absl::StrCat("to ", path_));
  }
  close(std::exchange(descriptor_, -1));
  return absl::OkStatus();
}

void BagOutput::Discard() {
  // An open bag finishes itself in its destructor, and what that throws would end the program. The
  // bytes are given back first, so that a full disk has room for it.
  const bool is_cut = ftruncate(descriptor_, 0) == 0;
  if (bag_ != nullptr && (!is_cut || !Guard("close", [&] { bag_->close(); }).ok())) {
    // Nothing closes such a bag. It stays, known to somebody: a few kilobytes after an error.
    static auto* const unclosable = new std::vector<rosbag::Bag*>();
    unclosable->push_back(bag_.release());
  }
  std::remove(part_path_.c_str());
  close(std::exchange(descriptor_, -1));
}

}  // namespace dsg::simulator
