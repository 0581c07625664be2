// The checks of one axis. Of several findings on one key only the first is reported, and none on keys that
// were wrong by themselves.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "config/configuration.hpp"
#include "config/diagnostics.hpp"
#include "config/reader.hpp"
#include "devices/descriptor.hpp"
#include "devices/units/scale.hpp"

namespace axisd::config {

class AxisChecks {
 public:
  AxisChecks(AxisEntry& entry, Diagnostics& diagnostics, const Places& places)
      : entry_(entry),
        axis_(entry.axis),
        path_("axes." + axis_.name + "."),
        diagnostics_(diagnostics),
        places_(places),
        model_(usable("model") ? find_drive_model(axis_.model) : nullptr) {}

  void run();

 private:
  [[nodiscard]] bool given(std::string_view key) const { return places_.given(path_ + std::string(key)); }
  [[nodiscard]] bool usable(std::string_view key) const { return places_.usable(path_ + std::string(key)); }
  [[nodiscard]] bool clean(std::string_view key) const { return places_.clean(path_ + std::string(key)); }
  /// Once per key: the first finding mostly causes the others.
  void add(std::string_view key, std::string message, std::string suggestion);
  [[nodiscard]] std::string velocity_text(double value) const;

  /// A model that a file describes: from here on `model_` is that drive.
  void specialise();
  void check_node();
  void check_microstep();
  void complete_scale();
  void check_policies();
  void check_poll();
  void check_turnaround();
  void check_drift_check();
  void check_persist();
  void check_times();
  void check_distances();
  void check_speeds();
  void check_start_speed();
  void check_braking();
  void check_homing();
  /// A method of the drive's own.
  void check_homing_number();
  // One value, if it was given and could be read.
  void check_time(std::string_view key, Duration value, int minimum_ms);
  void check_distance(std::string_view key, std::optional<double> value, std::string_view from = "");
  /// Also within what one motion of the model can be told.
  void check_target(std::string_view key, std::optional<double> value, std::string_view from = "");
  void check_speed(std::string_view key, double velocity, double minimum_rpm, double maximum_rpm);
  void check_below(std::string_view key, double velocity, std::string_view limit_key, double limit);
  /// M11: of the motor, in whole r/min. Precondition: the model is known.
  [[nodiscard]] double maximum_rpm() const;

  // Terminals and what hangs on them (terminal_checks.cpp).
  void check_terminals();
  void check_functions(const std::vector<TerminalSettings>& terminals, std::string_view section);
  void check_fixed_function(const TerminalSettings& terminal, const TerminalFunctionSpec& function,
                            std::string_view section);
  void check_pv_direction();
  void check_brake();
  void check_homing_switch();
  void check_simulated_switches();
  [[nodiscard]] const TerminalSettings* input_with(std::string_view function) const;
  /// Says that `key` needs an input terminal; silent if the inputs have errors of their own.
  void need_input(std::string_view key, std::string_view function, const std::string& message);

  // The drive's table of segments (segment_checks.cpp).
  void check_segments();
  void check_mode();
  void check_segment_selection(std::string_view table, std::string_view enable,
                               const std::vector<int>& numbers);
  void check_segment_number(const std::string& key, int number);
  void check_targets();
  void share_times();

  AxisEntry& entry_;
  AxisSettings& axis_;
  std::string path_;
  Diagnostics& diagnostics_;
  const Places& places_;
  const DriveDescriptor* model_;  ///< nullptr if it is not known
  std::optional<Scale> scale_;    ///< once it is known to be right
  std::set<std::string, std::less<>> reported_;
};

}  // namespace axisd::config
