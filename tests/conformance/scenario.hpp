// The scenarios, and the variants that they are run in.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/conformance/bench.hpp"

namespace axisd::conformance {

struct Scenario {
  std::string_view name;
  std::string_view ability;  ///< row of the capability matrix
  /// Says what the model showed ("yes", "7", "1 2 3 5"); expectations fail as in any test. May throw Broken.
  std::string (*run)(const Setup& setup);
  /// Runs instead for a model that lacks what the scenario is about, by its abilities: shows that it is
  /// refused, and that the refusal says why.
  std::string (*refused)(const Setup& setup) = nullptr;
};

/// Scenarios of one subject. `varied`: every one in every variant, else with the simulator's defaults, plain
/// and inverted.
struct Subject {
  std::string_view name;
  bool varied = false;
  std::span<const Scenario> scenarios;
};

std::span<const Scenario> power_scenarios();
std::span<const Scenario> motion_scenarios();
std::span<const Scenario> stop_scenarios();
std::span<const Scenario> homing_scenarios();
std::span<const Scenario> limit_scenarios();
std::span<const Scenario> alarm_scenarios();
std::span<const Scenario> reboot_scenarios();
std::span<const Scenario> terminal_scenarios();
std::span<const Scenario> segment_scenarios();
std::span<const Scenario> parameter_scenarios();
std::span<const Scenario> serial_scenarios();
std::span<const Scenario> eeprom_scenarios();
std::span<const Scenario> bus_scenarios();

std::span<const Subject> subjects();

/// Plain and inverted; for a varied subject also each switch of the model's simulator flipped, and seeded
/// random pairs of them, some plain and some inverted. `sampled`: a fifth of these, for builds in which
/// everything takes long; each subject has another fifth, so that each switch is flipped in some. `noise`: of
/// the encoder, counts.
std::vector<Variant> variants_of(const std::string& model, const Subject& subject, bool sampled,
                                 int noise = Variant{}.noise);

/// What a scenario came to.
struct Finding {
  std::string shown;                  ///< by the scenario; empty if it failed
  std::vector<std::string> failures;  ///< with the variant
};
/// Abilities by models, in Markdown: what the scenarios show with the simulators' defaults. What failed is in
/// `failures`.
std::string capability_matrix(std::vector<std::string>& failures);

/// M19: so many relative moves by a third of a unit, on an axis without limits. Where the load stands then,
/// mm. Throws Broken at a move that is not done.
double index_by_thirds(const Setup& setup, int count);

/// Noise of the encoders, counts, in which the suite of this process has all its variants; it has a sample of
/// them in the other ones of 0, 1 and 2. Set before gtest is initialised.
int& suite_noise();

/// M19, M30: relative moves of random sizes, from a tenth of a pulse to 6 mm, in both directions.
struct RandomMoves {
  /// Between the extremes of what the load was beside the exact sum of what was asked: whole pulses make it
  /// up to 1.
  double drift_pulses = 0;
  int refused = 0;  ///< moves that were not done
  std::string first_refusal{};
};
/// So many of them, on an axis without limits; the same ones for the same `count`.
RandomMoves move_at_random(const Setup& setup, int count);

Finding run_scenario(const Scenario& scenario, const Manual& manual, const Variant& variant,
                     const TargetMaker& make_target = &make_virtual_target, bool brief = false);

}  // namespace axisd::conformance
