// Which steps a commissioning has, how far and how fast it moves, and what has to go before what. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/axisctl/commission/record.pb.h"
#include "api/axisctl/commission/settings.hpp"
#include "axisd/v1/types.pb.h"

namespace axisd::axisctl::commission {

enum class StepKind : std::uint8_t {
  identity,     ///< what is talked to, and whether it can be commanded
  release,      ///< power stage off, for hands at the switches
  input,        ///< a terminal actuated by hand
  enable,       ///< power stage on
  jog,          ///< a short move in one direction
  one_frame,    ///< the jogs were started with parameters and trigger in one frame
  limit,        ///< a move that a limit switch ends
  stop,         ///< a move that a stop ends
  home,         ///< homing
  soft_limits,  ///< targets beyond them are refused
  disable       ///< power stage off again
};

struct StepPlan {
  StepKind kind = StepKind::identity;
  std::string name;                ///< unique: "switch X0"
  std::string terminal, function;  ///< of input and limit
  bool positive = true;            ///< direction of jog and limit
  std::string not_applicable;      ///< why there is nothing to do; empty: there is
};

/// Of a terminal that ends motion in one direction.
bool is_limit(const std::string& function);

/// Steps in the order in which they are done. Everything before `enable` is done with the power stage off.
std::vector<StepPlan> plan_steps(const v1::AxisState& state, const std::optional<Settings>& settings);

/// Why a step must not be done after what became of those before it; empty: it may. A direction that is
/// wrong, or a limit switch that does not work, forbids the motions that rely on it; a speed that is wrong
/// each motion, one that is not proven all but the jogs.
std::string obstacle(const StepPlan& step, const std::vector<StepPlan>& steps, const Record& record);

/// What the motions of a commissioning are, in user units.
struct Motion {
  double velocity = 0;  ///< per second
  double distance = 0;  ///< of the jogs, > 0
};

struct VelocityRange {
  double minimum = 0, maximum = 0;  ///< as the daemon permits it, per second
};

/// Slow and short: a twentieth of the highest velocity for two seconds, at most a twentieth of the range of
/// positions. What the operator gave counts instead.
Motion default_motion(VelocityRange permitted, const std::optional<Settings>& settings,
                      std::optional<double> velocity, std::optional<double> distance);

/// Of the move that proves the speed, before which nothing is faster: that of the moves behind it (`usual`),
/// at most a tenth of the highest; slower where the way would be over too soon to be timed, but what the
/// drive can do.
double proving_velocity(VelocityRange permitted, double usual, double distance);

/// How far the axis may go from here in one relative move: at most `wanted`, not beyond a soft limit that
/// counts, and not further than jog_travel while the position is unknown. Not negative.
double bounded(double wanted, bool positive, const v1::AxisState& state,
               const std::optional<Settings>& settings);

/// Towards a limit switch: long enough for a hand to actuate it, as slow as is permitted and needed.
Motion limit_motion(Motion motion, double room, VelocityRange permitted);

/// To be stopped on its way: a second at full velocity and both ramps fit into its first half.
double stop_distance(Motion motion, const std::optional<Settings>& settings);
/// The same where there is only so much room: as much slower as it takes, so that the stop still comes on the
/// way.
Motion stop_motion(Motion motion, double room, VelocityRange permitted,
                   const std::optional<Settings>& settings);

/// A position of a rotary axis next to `reference`: its positions begin anew after a turn.
double unwrapped(double position, double reference, const std::optional<Settings>& settings);

/// How long a move takes, s.
double duration_of(double distance, double velocity, const std::optional<Settings>& settings);

}  // namespace axisd::axisctl::commission
