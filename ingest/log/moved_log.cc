// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/moved_log.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/model/rigid_motion.h"

namespace dsg::ingest {
namespace {

class MovedLog : public LogSource {
 public:
  MovedLog(std::unique_ptr<LogSource> log, const Pose3d& map_T_log)
      : log_(std::move(log)), map_T_log_(map_T_log) {}

  const LogInfo& info() const override { return log_->info(); }
  void SetIdle(std::function<absl::Status()> idle) override { log_->SetIdle(std::move(idle)); }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log_->Next());
    if (!measurement.has_value()) return measurement;
    if (auto* pose = std::get_if<PoseMeasurement>(&*measurement)) {
      TransformPose(map_T_log_, &pose->pose);
    }
    if (std::holds_alternative<GraphMeasurement>(*measurement)) {
      return MakeError(Reason::kFieldInvalid,
                       absl::StrCat(info().path,
                                    " is a graph, which --up and --transform do not move: take it "
                                    "into a map of its own, and dsg merge --transform"),
                       {{"field", "transform"}});
    }
    return measurement;
  }

 private:
  const std::unique_ptr<LogSource> log_;
  const Pose3d map_T_log_;
};

}  // namespace

std::unique_ptr<LogSource> MoveLog(std::unique_ptr<LogSource> log, const Pose3d& map_T_log) {
  return std::make_unique<MovedLog>(std::move(log), map_T_log);
}

}  // namespace dsg::ingest
