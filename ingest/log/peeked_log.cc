// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/peeked_log.h"

#include <utility>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

class PeekedLog : public LogSource {
 public:
  PeekedLog(std::unique_ptr<LogSource> log, std::optional<Measurement> first)
      : log_(std::move(log)), first_(std::move(first)) {}

  const LogInfo& info() const override { return log_->info(); }
  void SetIdle(std::function<absl::Status()> idle) override { log_->SetIdle(std::move(idle)); }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (is_first_) {
      is_first_ = false;
      return std::exchange(first_, std::nullopt);
    }
    return log_->Next();
  }

 private:
  const std::unique_ptr<LogSource> log_;
  std::optional<Measurement> first_;
  bool is_first_ = true;
};

}  // namespace

absl::StatusOr<std::unique_ptr<LogSource>> PeekLog(std::unique_ptr<LogSource> log) {
  DSG_ASSIGN_OR_RETURN(std::optional<Measurement> first, log->Next());
  return std::make_unique<PeekedLog>(std::move(log), std::move(first));
}

}  // namespace dsg::ingest
