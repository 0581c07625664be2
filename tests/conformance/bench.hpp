// One axis of a model on a target, and what a scenario says about it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/conformance/client.hpp"
#include "tests/conformance/manual.hpp"
#include "tests/conformance/plant.hpp"

namespace axisd::conformance {

/// Ends a scenario that cannot go on; what it found is in the message.
struct Broken : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What a scenario is run with.
struct Setup {
  const Manual& manual;
  const Variant& variant;
  TargetMaker make_target = &make_virtual_target;
  /// Time on this target is the processor's: repetitions are divided between cases instead of done in each.
  bool brief = false;
  /// How the simulator stands at an open point of the manual; false for one that this model does not have.
  [[nodiscard]] bool on(std::string_view switch_name) const;
};

/// What the simulator tells of the load: the truth.
struct Shaft {
  double mm = 0;  ///< in axis direction, from where it was at power-up
  bool moving = false;
  int starts = 0;
};

class Bench {
 public:
  /// Throws Broken unless the axis comes online (with `connect`). An axis whose terminals can start motion is
  /// released first where the drive powers up energised: these functions are written only then (M3).
  Bench(const Setup& setup, const Recipe& recipe = {}, bool connect = true);
  Bench(const Setup& setup, const Plant& plant, const Recipe& recipe = {}, bool connect = true);
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  const Setup& setup;
  const Recipe recipe;
  std::unique_ptr<Target> target;
  Client client;

  [[nodiscard]] v1::AxisState state() { return client.state(); }
  void pass(Duration duration) { target->pass(duration); }
  /// Lets time pass until the axis's state fulfils `condition`. Throws Broken after `limit`.
  v1::AxisState await(const std::function<bool(const v1::AxisState&)>& condition, std::string_view what,
                      Duration limit = std::chrono::seconds(10));
  v1::AxisState await_online() {
    return await([](const auto& s) { return s.link() == v1::LINK_STATE_ONLINE; }, "online");
  }

  /// The daemon's clock: the wall-clock time of now.
  Duration now();
  /// One line to the outside world; throws Broken if it is not understood. The words after "ok".
  std::string outside(const std::string& line);
  Shaft shaft();
  [[nodiscard]] std::uint64_t eeprom_writes() { return std::stoull(outside("eeprom @1")); }
  /// Makes the terminal with this function active or not, whatever its active level.
  void set_input(const std::string& function, bool active);
  /// Gives it back to the switch that is wired to it.
  void free_input(const std::string& function);
  [[nodiscard]] const std::string& terminal(const std::string& function) const {
    return terminals_.at(function);
  }
  /// Switches the drive off and on; returns when it is on (and boots).
  void cycle_power(Duration off = std::chrono::milliseconds(500));

  void enable();
  /// Enabled, and the position declared 0 where the load stands.
  void ready();
  /// A motion that is under way: it was started, and the shaft turns.
  v1::Command under_way(const Answer<v1::Command>& answer, Duration after = std::chrono::milliseconds(400));

  /// The invariants of every scenario: the load rests and stays where it is, and the drive has executed as
  /// many starts of motion as the scenario asked for; nothing moved by itself, or twice.
  void finish(int starts);

 private:
  std::map<std::string, std::string> terminals_;
};

/// How far a load may rest beside its target, or its position be read beside it, mm: a closed loop a few
/// pulses; the drive of a maker that has no window of its own as far as axisd takes for in position (10
/// pulses, or 1/1000 revolution); and noise (M10).
double close_to_target(const Setup& setup);

// Expectations. Each says what was the case instead.
v1::Command expect_end(const Answer<v1::Command>& answer, v1::CommandState state,
                       v1::Reason cause = v1::REASON_UNSPECIFIED);
inline v1::Command expect_done(const Answer<v1::Command>& answer) {
  return expect_end(answer, v1::COMMAND_STATE_DONE);
}
void expect_command(const v1::Command& command, v1::CommandState state,
                    v1::Reason cause = v1::REASON_UNSPECIFIED);
/// The configuration of this recipe is refused when it is loaded; `text` is part of the findings.
void expect_no_such_plant(const Setup& setup, const Recipe& recipe, std::string_view text);
/// The call was refused before anything was sent, for this reason, with a message and what to do about it.
template <class Response>
v1::ErrorDetail expect_refused(const Answer<Response>& answer, v1::Reason reason);
v1::ErrorDetail expect_refused(const grpc::Status& status, const v1::ErrorDetail& error, v1::Reason reason);
void expect_state(const v1::AxisState& state, v1::State expected);

template <class Response>
v1::ErrorDetail expect_refused(const Answer<Response>& answer, v1::Reason reason) {
  return expect_refused(answer.status, answer.error, reason);
}

}  // namespace axisd::conformance
