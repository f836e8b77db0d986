// SPDX-License-Identifier: Apache-2.0
#include "query/maintenance/archives.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/engine.h"
#include "schema/archive/archive_map.h"
#include "schema/archive/scratch_store.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Of the time after which an archive is idle.
constexpr int kLooksPerIdle = 4;
constexpr std::chrono::nanoseconds kLookPeriodMin = std::chrono::milliseconds(10);

ArchiveLimits::Clock::time_point NowOf(const ArchiveLimits& limits) {
  return limits.now ? limits.now() : ArchiveLimits::Clock::now();
}

absl::Status ErasedError(const std::string& map) {
  return MakeError(Reason::kMapReplaced,
                   absl::StrCat("map \"", map,
                                "\" was erased from or dropped while its archive was read, and the "
                                "archive would still hold what is gone; ask for it again"),
                   {{"map", map}});
}

absl::Status IdleError(const std::string& map, std::chrono::nanoseconds idle_max) {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(idle_max).count();
  return MakeError(Reason::kOverloaded,
                   absl::StrCat("nothing was taken of the archive of map \"", map, "\" for ", ms,
                                " ms, so its copy was removed; ask for the archive again, and read "
                                "it without a pause"),
                   {{"map", map}});
}

}  // namespace

ArchiveRead::ArchiveRead(std::shared_ptr<MapReader> map, std::string scratch, Clock::time_point now)
    : map_(std::move(map)), scratch_(std::move(scratch)), taken_at_(now) {}

ArchiveRead::~ArchiveRead() = default;

absl::StatusOr<ArchiveRead::Piece> ArchiveRead::Next(const StopCheck& stop,
                                                     const ArchiveLimits& limits) {
  const std::lock_guard work(work_mutex_);
  const StopCheck stop_or_end = [&]() -> absl::Status {
    return is_ended_ ? absl::CancelledError("the archive was ended") : AskStop(stop);
  };
  absl::StatusOr<Piece> piece = Read(stop_or_end);
  taken_at_ = NowOf(limits);
  // Also when the piece was made: it may hold what is to be gone.
  if (!is_ended_) return piece;
  const std::lock_guard lock(why_mutex_);
  return why_;
}

absl::StatusOr<ArchiveRead::Piece> ArchiveRead::Read(const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(AskStop(stop));
  if (encoder_ == nullptr) {
    // Beside the maps, where there is as much space as a map needs.
    DSG_ASSIGN_OR_RETURN(encoder_, ArchiveMap(map_.get(), scratch_, stop, nullptr));
  }
  Piece piece;
  DSG_ASSIGN_OR_RETURN(piece.content, encoder_->Next(stop));
  piece.progress = encoder_->progress();
  piece.is_last = encoder_->done();
  if (piece.is_last) encoder_ = nullptr;
  return piece;
}

void ArchiveRead::End(absl::Status why) {
  {
    const std::lock_guard lock(why_mutex_);
    if (!is_ended_) why_ = std::move(why);
    is_ended_ = true;
  }
  // Work that is going on sees it and stops.
  const std::lock_guard work(work_mutex_);
  encoder_ = nullptr;
}

bool ArchiveRead::EndIfIdle(const ArchiveLimits& limits) {
  {
    const std::unique_lock work(work_mutex_, std::try_to_lock);
    if (!work.owns_lock() || NowOf(limits) - taken_at_ < limits.idle_max) return false;
  }
  End(IdleError(map(), limits.idle_max));
  return true;
}

ArchiveCopies::ArchiveCopies(std::string folder, ArchiveLimits limits)
    : folder_(std::move(folder)), limits_(std::move(limits)) {
  RemoveScratchLeftovers(folder_);
}

ArchiveCopies::~ArchiveCopies() {
  {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
  }
  wakeup_.notify_all();
  if (thread_.joinable()) thread_.join();
}

absl::StatusOr<std::shared_ptr<ArchiveRead>> ArchiveCopies::Begin(std::shared_ptr<MapReader> map) {
  EndIdle();
  const std::lock_guard lock(mutex_);
  if (reads_.size() >= static_cast<size_t>(limits_.count_max)) {
    return MakeError(Reason::kOverloaded,
                     absl::StrCat("cannot archive map \"", map->spec().name, "\": ", reads_.size(),
                                  " archives are being read already, and each keeps a copy of its "
                                  "map on the disk; try again when one has ended"),
                     {{"map", map->spec().name}, {"limit", absl::StrCat(limits_.count_max)}});
  }
  reads_.push_back(std::make_shared<ArchiveRead>(std::move(map), folder_, NowOf(limits_)));
  if (!thread_.joinable()) thread_ = std::thread([this] { Run(); });
  wakeup_.notify_all();
  return reads_.back();
}

void ArchiveCopies::Leave(const ArchiveRead* read) {
  const std::lock_guard lock(mutex_);
  std::erase_if(reads_, [read](const auto& kept) { return kept.get() == read; });
}

void ArchiveCopies::EndOf(const std::string& map) {
  std::vector<std::shared_ptr<ArchiveRead>> reads;
  {
    const std::lock_guard lock(mutex_);
    reads = reads_;
  }
  for (const auto& read : reads) {
    if (read->map() != map) continue;
    read->End(ErasedError(map));
    Leave(read.get());
  }
  RemoveScratchLeftovers(folder_);
}

void ArchiveCopies::EndIdle() {
  std::vector<std::shared_ptr<ArchiveRead>> reads;
  {
    const std::lock_guard lock(mutex_);
    reads = reads_;
  }
  for (const auto& read : reads) {
    if (read->EndIfIdle(limits_)) Leave(read.get());
  }
}

void ArchiveCopies::Run() {
  const auto period = std::max(limits_.idle_max / kLooksPerIdle, kLookPeriodMin);
  std::unique_lock lock(mutex_);
  while (!is_stopped_) {
    if (reads_.empty()) {
      wakeup_.wait(lock);
      continue;
    }
    wakeup_.wait_for(lock, period, [this] { return is_stopped_; });
    lock.unlock();
    EndIdle();
    lock.lock();
  }
}

namespace {

class ArchiveStream final : public EngineCursor<v1::ReadArchiveResponse> {
 public:
  ArchiveStream(ArchiveCopies* copies, std::shared_ptr<ArchiveRead> read)
      : copies_(copies), read_(std::move(read)) {}
  ~ArchiveStream() override { copies_->Leave(read_.get()); }

  bool done() const override { return is_done_; }

 private:
  absl::Status Fill(const CallContext& call, v1::ReadArchiveResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(ArchiveRead::Piece piece, read_->Next(call.stop(), copies_->limits()));
    *reply->mutable_content() = std::move(piece.content);
    reply->set_progress(piece.progress);
    is_done_ = piece.is_last;
    if (is_done_) copies_->Leave(read_.get());
    return absl::OkStatus();
  }

  ArchiveCopies* const copies_;
  const std::shared_ptr<ArchiveRead> read_;
  bool is_done_ = false;
};

}  // namespace

// The first message takes as long as copying the map does.
CursorOr<v1::ReadArchiveResponse> ReadArchive(Engine* engine, const CallContext&,
                                              const v1::ReadArchiveRequest& request) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<ArchiveRead> read, engine->archives->Begin(std::move(map)));
  return std::make_unique<ArchiveStream>(engine->archives.get(), std::move(read));
}

}  // namespace dsg::query
