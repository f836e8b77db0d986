// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/imu_faults.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/odometry/inertial/imu_samples.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A wrong unit of measure: what makes it the right one, and what to say.
struct WrongUnit {
  double factor;
  const char* text;
};

// Gravity differs by 2 % between mg and cm/s^2, too little to tell them apart.
constexpr WrongUnit kForceUnits[] = {
    {9.80665, "these look like g, multiply them by 9.80665"},
    {9.80665e-3, "these look like mg, multiply them by 0.00980665, or cm/s^2, by 0.01"},
    {0.3048, "these look like ft/s^2, multiply them by 0.3048"}};
constexpr double kRadPerDegree = M_PI / 180.0;
constexpr WrongUnit kRateUnits[] = {
    {kRadPerDegree, "these look like degrees/s, multiply them by 0.0174533"},
    {1e-3, "these look like mrad/s, multiply them by 0.001"},
    {1e-3 * kRadPerDegree, "these look like mdeg/s, multiply them by 1.74533e-5"},
    {1.0 / kRadPerDegree, "degrees/s seem to be made radians twice, multiply them by 57.2958"}};

const WrongUnit* FindUnit(std::span<const WrongUnit> units, double factor, double error_max) {
  for (const WrongUnit& unit : units) {
    if (std::abs(factor / unit.factor - 1.0) <= error_max) return &unit;
  }
  return nullptr;
}

// The length that a share of the accelerations stays below.
double ForceBelow(std::span<const double> ascending, double share) {
  return ascending[static_cast<size_t>(share * static_cast<double>(ascending.size() - 1))];
}

void FindForceFault(std::span<const ImuMeasurement> samples, const std::string& unit,
                    const InertialOptions& options, std::vector<ImuFault>* faults) {
  const double due_s = 1e-9 * static_cast<double>(options.fault.span_ns);
  if (SecondsBetween(samples.front().time_ns, samples.back().time_ns) < due_s) return;
  std::vector<double> forces;
  for (const ImuMeasurement& sample : samples) forces.push_back(sample.acceleration_m_s2.norm());
  std::sort(forces.begin(), forces.end());
  const double median = ForceBelow(forces, 0.5);
  const auto is_gravity = [&](double factor) {
    const double spread = options.fault.force_spread_max;
    return factor * ForceBelow(forces, 0.05) >= (1.0 - spread) * options.gravity_m_s2 &&
           factor * ForceBelow(forces, 0.95) <= (1.0 + spread) * options.gravity_m_s2;
  };
  if (is_gravity(1.0)) return;
  const WrongUnit* wrong =
      FindUnit(kForceUnits, options.gravity_m_s2 / median, options.fault.scale_error_max);
  ImuFaultKind kind = ImuFaultKind::kForceUnit;
  if (wrong == nullptr || !is_gravity(wrong->factor)) {
    // Rough motion reaches far to both sides, but around gravity.
    const double error = std::abs(median / options.gravity_m_s2 - 1.0);
    if (error <= options.fault.force_spread_max) return;
    kind = median < options.gravity_m_s2 ? ImuFaultKind::kNoGravity : ImuFaultKind::kForceScale;
  }
  const std::string guess = kind == ImuFaultKind::kNoGravity
                                ? "gravity seems to be subtracted already, give what the unit "
                                  "measured"
                                : GuessAtForce(median, options);
  faults->push_back(
      {kind, absl::StrCat(unit, ": accelerations of ", median, " m/s^2 (median of ", samples.size(),
                          " samples), and gravity is ", options.gravity_m_s2, "; ", guess)});
}

// A run of samples at one value of an axis.
struct FlatPeak {
  double value = 0.0;
  int count = 0;
  int64_t time_ns = 0;
};

// The longest run of samples at the axis' least or largest value.
FlatPeak FindFlatPeak(std::span<const ImuMeasurement> samples, Vector3d ImuMeasurement::*part,
                      int axis) {
  const auto value_of = [&](const ImuMeasurement& sample) { return (sample.*part)[axis]; };
  const auto less = [&](const ImuMeasurement& a, const ImuMeasurement& b) {
    return value_of(a) < value_of(b);
  };
  const auto [least, most] = std::minmax_element(samples.begin(), samples.end(), less);
  FlatPeak longest;
  for (const double value : {value_of(*least), value_of(*most)}) {
    int count = 0;
    for (const ImuMeasurement& sample : samples) {
      count = value_of(sample) == value ? count + 1 : 0;
      if (count > longest.count) longest = {value, count, sample.time_ns};
    }
  }
  return longest;
}

void FindClipped(std::span<const ImuMeasurement> samples, const std::string& unit,
                 const ImuFaultOptions& options, std::vector<ImuFault>* faults) {
  struct Part {
    Vector3d ImuMeasurement::*values;
    const char* name;
    const char* measure;
    double value_min;
  };
  const Part parts[] = {
      {&ImuMeasurement::angular_velocity_rad_s, "gyro", " rad/s", options.clipped_rate_min},
      {&ImuMeasurement::acceleration_m_s2, "accelerometer", " m/s^2", options.clipped_accel_min}};
  for (const Part& part : parts) {
    for (int axis = 0; axis < 3; ++axis) {
      const FlatPeak peak = FindFlatPeak(samples, part.values, axis);
      if (peak.count < options.clipped_count_min || std::abs(peak.value) < part.value_min) continue;
      faults->push_back({ImuFaultKind::kClipped,
                         absl::StrCat(unit, ": the ", part.name, "'s ", std::string(1, "xyz"[axis]),
                                      " stays at its extreme of ", peak.value, part.measure,
                                      " for ", peak.count, " samples up to ", peak.time_ns,
                                      " ns; its range ends there, set a wider one or move less")});
    }
  }
}

bool IsRepeat(const ImuMeasurement& a, const ImuMeasurement& b, Vector3d ImuMeasurement::*part) {
  return a.*part == b.*part;
}

// True if one is found.
bool FindStuck(std::span<const ImuMeasurement> samples, const std::string& unit,
               const InertialOptions& options, std::vector<ImuFault>* faults) {
  size_t begin = 0;
  std::pair<size_t, size_t> longest = {0, 0};
  const auto span_of = [&](size_t from, size_t to) {
    return SecondsBetween(samples[from].time_ns, samples[to].time_ns);
  };
  for (size_t i = 1; i < samples.size(); ++i) {
    const bool repeats =
        IsRepeat(samples[i - 1], samples[i], &ImuMeasurement::angular_velocity_rad_s) &&
        IsRepeat(samples[i - 1], samples[i], &ImuMeasurement::acceleration_m_s2);
    if (!repeats) begin = i;
    if (span_of(begin, i) > span_of(longest.first, longest.second)) longest = {begin, i};
  }
  const auto [from, to] = longest;
  if (span_of(from, to) <= 1e-9 * static_cast<double>(options.gap_ns_max)) return false;
  faults->push_back({ImuFaultKind::kStuck,
                     absl::StrCat(unit, ": all values stand still from ", samples[from].time_ns,
                                  " to ", samples[to].time_ns, " ns, for ", to - from + 1,
                                  " samples; noise alone changes them, so leave out what the unit "
                                  "did not measure")});
  return true;
}

void FindRepeated(std::span<const ImuMeasurement> samples, const std::string& unit,
                  const ImuFaultOptions& options, std::vector<ImuFault>* faults) {
  for (const auto& [part, name] :
       {std::pair(&ImuMeasurement::angular_velocity_rad_s, "gyro"),
        std::pair(&ImuMeasurement::acceleration_m_s2, "accelerometer")}) {
    int count = 0;
    for (size_t i = 1; i < samples.size(); ++i) {
      if (IsRepeat(samples[i - 1], samples[i], part)) ++count;
    }
    const double share = count / static_cast<double>(samples.size() - 1);
    if (share <= options.repeat_share_max) continue;
    faults->push_back(
        {ImuFaultKind::kRepeated,
         absl::StrCat(unit, ": ", count, " of ", samples.size(), " samples of the ", name,
                      " repeat the one before; it measures less often than it "
                      "is read, leave the repeats out")});
  }
}

// Rates of one turn, rad/s: of the samples' mean, and of the cameras.
struct TurnRates {
  Vector3d unit = Vector3d::Zero();
  Vector3d seen = Vector3d::Zero();
  double duration_s = 0.0;
};

// Without their means, so that no bias counts.
std::vector<TurnRates> RatesOf(std::span<const SeenTurn> turns) {
  std::vector<TurnRates> rates;
  TurnRates mean;
  for (const SeenTurn& turn : turns) {
    TurnRates rate;
    for (size_t i = 1; i < turn.samples.size(); ++i) {
      const ImuMeasurement& from = turn.samples[i - 1];
      const ImuMeasurement& to = turn.samples[i];
      const double dt = SecondsBetween(from.time_ns, to.time_ns);
      rate.unit += 0.5 * dt * (from.angular_velocity_rad_s + to.angular_velocity_rad_s);
      rate.duration_s += dt;
    }
    if (rate.duration_s <= 0.0) continue;
    rate.seen = RotationVectorOf(turn.from_R_to);
    mean.unit += rate.unit;
    mean.seen += rate.seen;
    mean.duration_s += rate.duration_s;
    rate.unit /= rate.duration_s;
    rate.seen /= rate.duration_s;
    rates.push_back(rate);
  }
  for (TurnRates& rate : rates) {
    rate.unit -= mean.unit / mean.duration_s;
    rate.seen -= mean.seen / mean.duration_s;
  }
  return rates;
}

// A way to call the gyro's axes: calibrated rate = scale * calibrated_R_unit * the unit's.
struct Arrangement {
  Matrix3d calibrated_R_unit = Matrix3d::Identity();
  double scale = 0.0;
  double correlation = 0.0;
  /// What the best scale leaves of the cameras' rates, one standard deviation, rad/s.
  double misfit = 0.0;
};

// Sums over turns, weighted by their time.
struct RateSums {
  /// seen * unit'.
  Matrix3d products = Matrix3d::Zero();
  double unit_square = 0.0;
  double seen_square = 0.0;
  double duration_s = 0.0;
};

RateSums SumsOf(std::span<const TurnRates> rates) {
  RateSums sums;
  for (const TurnRates& rate : rates) {
    sums.products += rate.duration_s * rate.seen * rate.unit.transpose();
    sums.unit_square += rate.duration_s * rate.unit.squaredNorm();
    sums.seen_square += rate.duration_s * rate.seen.squaredNorm();
    sums.duration_s += rate.duration_s;
  }
  return sums;
}

Arrangement FitArrangement(const RateSums& sums, const Matrix3d& calibrated_R_unit) {
  Arrangement fitted;
  fitted.calibrated_R_unit = calibrated_R_unit;
  // Not below 0: the opposite of all axes is an arrangement of its own.
  const double product = std::max(0.0, sums.products.cwiseProduct(calibrated_R_unit).sum());
  if (sums.unit_square > 0.0 && sums.seen_square > 0.0) {
    fitted.scale = product / sums.unit_square;
    fitted.correlation = product / std::sqrt(sums.unit_square * sums.seen_square);
  }
  const double rest = sums.seen_square - fitted.scale * product;
  fitted.misfit = std::sqrt(std::max(0.0, rest) / sums.duration_s);
  return fitted;
}

// All 48, the best one first. The calibration's is the best one among equals.
std::vector<Arrangement> FitArrangements(const RateSums& sums) {
  std::vector<Arrangement> fitted;
  std::array<int, 3> columns = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d calibrated_R_unit = Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        calibrated_R_unit(row, columns[row]) = (signs >> row & 1) != 0 ? -1.0 : 1.0;
      }
      fitted.push_back(FitArrangement(sums, calibrated_R_unit));
    }
  } while (std::next_permutation(columns.begin(), columns.end()));
  std::stable_sort(fitted.begin(), fitted.end(),
                   [](const Arrangement& a, const Arrangement& b) { return a.misfit < b.misfit; });
  return fitted;
}

// "y, -x, ?": what the unit calls the calibration's x, y and z, where all of them agree.
std::string AxesOf(std::span<const Arrangement> arrangements) {
  std::vector<std::string> names;
  for (int row = 0; row < 3; ++row) {
    int column = 0;
    arrangements.front().calibrated_R_unit.row(row).cwiseAbs().maxCoeff(&column);
    const double sign = arrangements.front().calibrated_R_unit(row, column);
    const bool is_certain = std::all_of(
        arrangements.begin(), arrangements.end(),
        [&](const Arrangement& other) { return other.calibrated_R_unit(row, column) == sign; });
    names.push_back(
        !is_certain ? "?" : absl::StrCat(sign < 0.0 ? "-" : "", std::string(1, "xyz"[column])));
  }
  return absl::StrJoin(names, ", ");
}

void FindAxesFault(const RateSums& sums, double noise_rad_s, const std::string& unit,
                   const ImuFaultOptions& options, std::vector<ImuFault>* faults) {
  const std::vector<Arrangement> fitted = FitArrangements(sums);
  const Arrangement calibrated = FitArrangement(sums, Matrix3d::Identity());
  const Arrangement& best = fitted.front();
  const double least = std::max(best.misfit, noise_rad_s);
  const double misfit_max = options.axes_ratio_min * least;
  if (calibrated.misfit <= misfit_max) return;
  std::vector<Arrangement> likely;
  bool is_mirror = true;
  for (const Arrangement& one : fitted) {
    if (one.misfit > misfit_max) break;
    likely.push_back(one);
    is_mirror = is_mirror && one.calibrated_R_unit.determinant() < 0.0;
  }
  faults->push_back(
      {ImuFaultKind::kAxes,
       absl::StrCat(unit, ": the calibration's axes x, y, z are the gyro's ", AxesOf(likely),
                    is_mirror ? " (a mirror: a sign is wrong)" : "",
                    "; so taken its rates miss the cameras' "
                    "by ",
                    best.misfit, " rad/s, as they are by ", calibrated.misfit,
                    " rad/s; correct the driver, or the unit's orientation in the calibration")});
}

}  // namespace

std::string GuessAtForce(double force, const InertialOptions& options) {
  const WrongUnit* unit =
      FindUnit(kForceUnits, options.gravity_m_s2 / force, options.fault.scale_error_max);
  if (unit != nullptr) return unit->text;
  if (force < (1.0 - options.fault.force_spread_max) * options.gravity_m_s2) {
    return "gravity seems to be subtracted already, give what the unit measured";
  }
  return "check the unit's scale";
}

std::vector<ImuFault> FaultsOfSamples(std::span<const ImuMeasurement> samples,
                                      const std::string& unit, const InertialOptions& options) {
  std::vector<ImuFault> faults;
  if (samples.size() < 2) return faults;
  FindForceFault(samples, unit, options, &faults);
  FindClipped(samples, unit, options.fault, &faults);
  if (!FindStuck(samples, unit, options, &faults)) {
    FindRepeated(samples, unit, options.fault, &faults);
  }
  return faults;
}

std::vector<ImuFault> FaultsOfTurns(std::span<const SeenTurn> turns, const std::string& unit,
                                    const InertialOptions& options) {
  std::vector<ImuFault> faults;
  const ImuFaultOptions& limits = options.fault;
  const std::vector<TurnRates> rates = RatesOf(turns);
  if (std::ssize(rates) < limits.turn_count_min) return faults;
  const RateSums sums = SumsOf(rates);
  if (std::sqrt(sums.seen_square / sums.duration_s) < limits.turn_rate_sigma_min) return faults;
  const Arrangement best = FitArrangements(sums).front();
  if (best.correlation < limits.turn_correlation_min) {
    faults.push_back(
        {ImuFaultKind::kUnrelated,
         absl::StrCat(unit, ": its rates correlate with the cameras' by ", best.correlation,
                      " at best, however its axes are called; check "
                      "both clocks, and that both are on one body")});
    return faults;
  }
  // Of the rates that cameras see.
  const double noise_rad_s = std::sqrt(3.0) * options.start.turn_sigma_rad *
                             static_cast<double>(rates.size()) / sums.duration_s;
  FindAxesFault(sums, noise_rad_s, unit, limits, &faults);
  if (std::abs(best.scale - 1.0) <= limits.scale_error_max) return faults;
  const WrongUnit* wrong = FindUnit(kRateUnits, best.scale, limits.scale_error_max);
  const std::string ratio = absl::StrCat(unit, ": its rates are ", 1.0 / best.scale,
                                         " times those that the cameras see; ");
  faults.push_back(
      {wrong != nullptr ? ImuFaultKind::kRateUnit : ImuFaultKind::kRateScale,
       absl::StrCat(ratio, wrong != nullptr ? wrong->text : "check the gyro's scale")});
  return faults;
}

}  // namespace dsg::ingest
