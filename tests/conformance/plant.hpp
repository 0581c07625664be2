// Plants made from what a model is: never written out by hand.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/conformance/manual.hpp"
#include "tests/conformance/target.hpp"

namespace axisd::conformance {

/// How the simulated drive and the axis are turned: each scenario has to pass in each of them.
struct Variant {
  bool invert = false;
  std::map<std::string, bool> switches{};
  /// Counts that a reading of the encoder is off at most (M30). In each variant the shaft also lags behind in
  /// motion and settles after it, and whole counts are shown. Without effect on a model that has no encoder.
  int noise = 1;
  [[nodiscard]] std::string name() const;
};

/// A terminal with a function; the terminal itself is chosen by the recipe.
struct Wanted {
  std::string function;
  bool active_low = false;
};

/// One axis of a model, as a scenario wants it. The axis is "axis", its drive the first (@1) of the bus
/// "line".
///
/// 10 mm/rev, and 1000 pulses/rev where the drive does not have it otherwise; 0..400 mm, 100 mm/s. Relative
/// to where the load stands at power-up, in axis direction: home switch from -52 to -50 mm, limit switches at
/// -60 and 410 mm.
inline constexpr double mm_per_revolution = 10, home_from = -52, home_to = -50, positive_limit_at = 410,
                        negative_limit_at = -60;
inline double pulses_per_mm(const Manual& manual) {
  return static_cast<double>(manual.counts()) / mm_per_revolution;
}

struct Recipe {
  int node = 1;
  int baud = 0;                  ///< bit/s of the bus; 0: the highest that its switches have
  bool limits = true;            ///< software limits
  bool home_switch = true;       ///< an input for it, and the switch
  bool limit_switches = true;    ///< likewise
  bool mechanics = true;         ///< false: the switches are never reached
  std::vector<Wanted> inputs{};  ///< beside the switches
  std::vector<Wanted> outputs{};
  std::string homing = "any";  ///< method; "any": one that this variant can have; empty: none
  std::string homing_keys =
      "velocity: 100 mm/s, search_velocity: 20 mm/s, position: 3, backoff: 5 mm, timeout: 40 s";
  std::pair<double, double> home_at{home_from, home_to};
  std::string settings{};  ///< of the model, under drive:
  std::string keys{};      ///< further lines of the axis, "load: vertical\n..."
  std::string drive{};     ///< further parts of --drive
};

/// A limit of an inverted axis is the drive's other one.
[[nodiscard]] std::string function_of_drive(const std::string& function, bool invert);
/// M18: where the last approach of the home methods has a direction of its own, an inverted axis cannot
/// mirror it.
[[nodiscard]] bool can_home_on_the_home_switch(const Manual& manual, const Variant& variant);
/// What `homing: any` stands for; empty: the drive does not home.
[[nodiscard]] std::string any_homing_method(const Manual& manual, const Variant& variant);

/// Terminals of a recipe: function -> terminal, in the order in which they are given away.
std::map<std::string, std::string> terminals_of(const Manual& manual, const Variant& variant,
                                                const Recipe& recipe);

/// The data sheet and the unit of velocities, as parts of drive: { ... }; empty: the model needs none.
std::string data_sheet_keys(const Manual& manual);
/// Likewise of --drive. A make stands alone: of a model, simulators have the sheet.
std::string data_sheet_options(const Manual& manual);

/// What a plant's YAML begins with: the bus "line", of the kind that the model is made for; `baud` as in a
/// recipe, `sync_period` where the bus has SYNC.
std::string bus_lines(const Manual& manual, int baud, Duration sync_period = std::chrono::milliseconds(10));
Plant make_plant(const Manual& manual, const Variant& variant, const Recipe& recipe);

}  // namespace axisd::conformance
