// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/turned_log.h"

#include <utility>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

class TurnedLog : public LogSource {
 public:
  TurnedLog(std::unique_ptr<LogSource> log, const Eigen::Quaterniond& map_R_log)
      : log_(std::move(log)), map_T_log_{Eigen::Vector3d::Zero(), map_R_log.normalized()} {}

  const LogInfo& info() const override { return log_->info(); }
  void SetIdle(std::function<absl::Status()> idle) override { log_->SetIdle(std::move(idle)); }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log_->Next());
    if (!measurement.has_value()) return measurement;
    if (auto* pose = std::get_if<PoseMeasurement>(&*measurement)) {
      pose->pose.map_T_agent = map_T_log_ * pose->pose.map_T_agent;
      pose->pose.map_T_agent.orientation.normalize();
    }
    return measurement;
  }

 private:
  const std::unique_ptr<LogSource> log_;
  const Pose3d map_T_log_;
};

}  // namespace

std::unique_ptr<LogSource> TurnLog(std::unique_ptr<LogSource> log,
                                   const Eigen::Quaterniond& map_R_log) {
  return std::make_unique<TurnedLog>(std::move(log), map_R_log);
}

}  // namespace dsg::ingest
