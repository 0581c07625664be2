// gtest's main, and:
//   test_conformance --noise COUNTS                         all of the suite with such encoders
//   test_conformance --matrix                               prints the capability matrix
//   test_conformance --indexings COUNT [MODEL]              moves by thirds of a unit: do they add up?
//   test_conformance --random-moves COUNT [MODEL]           of any size: is each exact, none refused?
//   test_conformance --vcan AXISD AXISD_SIM [PART]          runs them against these programs, on vcan;
//                                                           PART of "MODEL SCENARIO" selects some
//   test_conformance --vcan-sample AXISD AXISD_SIM PART OF  each of them at least once, in parts
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

#include "buses/clock.hpp"
#include "tests/conformance/real/vcan_suite.hpp"
#include "tests/conformance/scenario.hpp"

namespace {

using namespace axisd::conformance;

int print_matrix() {
  spdlog::set_level(spdlog::level::off);
  std::vector<std::string> failures;
  fmt::print("{}", capability_matrix(failures));
  for (const auto& failure : failures) fmt::print(stderr, "{}\n", failure);
  return failures.empty() ? 0 : 1;
}

/// With encoders that waver by two counts.
int move_models_at_random(int count, std::string_view only) {
  spdlog::set_level(spdlog::level::off);
  bool exact = true;
  for (const auto& model : models()) {
    if (!only.empty() && model != only) continue;
    const Manual manual(model);
    const Variant noisy{.noise = 2};
    const auto begin = axisd::monotonic_now();
    const auto moved = move_at_random({.manual = manual, .variant = noisy}, count);
    const auto took = std::chrono::duration<double>(axisd::monotonic_now() - begin).count();
    fmt::print("{}: {} moves at random: drift {:.3f} pulses, {} refused ({:.0f} s){}\n", model, count,
               moved.drift_pulses, moved.refused, took,
               moved.refused == 0 ? "" : "; the first: " + moved.first_refusal);
    std::fflush(stdout);
    exact = exact && moved.refused == 0 && moved.drift_pulses <= 1.001;
  }
  return exact ? 0 : 1;
}

/// A model's load may rest a few pulses beside its target (closed loop), however many moves there were.
int index_models(int count, std::string_view only) {
  constexpr double close = 0.05;
  spdlog::set_level(spdlog::level::off);
  bool all_close = true;
  for (const auto& model : models()) {
    if (!only.empty() && model != only) continue;
    const Manual manual(model);
    try {
      const Variant plain;
      const double mm = index_by_thirds({.manual = manual, .variant = plain}, count);
      fmt::print("{}: {} moves by 1/3 mm: {:.3f} mm, {:+.3f} mm from {:.3f} mm\n", model, count, mm,
                 mm - (count / 3.0), count / 3.0);
      all_close = all_close && std::abs(mm - (count / 3.0)) <= close;
    } catch (const Broken& broken) {
      fmt::print("{}: {}\n", model, broken.what());
      all_close = false;
    }
    std::fflush(stdout);
  }
  return all_close ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  // The names of gtest's tests depend on it.
  for (std::size_t i = 1; i + 1 < arguments.size(); ++i)
    if (std::string_view(arguments[i]) == "--noise") suite_noise() = std::stoi(arguments[i + 1]);
  ::testing::InitGoogleTest(&argc, argv);
  arguments = {argv, static_cast<std::size_t>(argc)};
  const std::string_view mode = argc > 1 ? arguments[1] : "";
  if (mode == "--matrix") return print_matrix();
  if (mode == "--indexings" && (argc == 3 || argc == 4))
    return index_models(std::stoi(arguments[2]), argc == 4 ? arguments[3] : "");
  if (mode == "--random-moves" && (argc == 3 || argc == 4))
    return move_models_at_random(std::stoi(arguments[2]), argc == 4 ? arguments[3] : "");
  if (mode == "--vcan" && (argc == 4 || argc == 5))
    return run_vcan_suite({.axisd = arguments[2], .axisd_sim = arguments[3]}, argc > 4 ? arguments[4] : "")
               ? 0
               : 1;
  if (mode == "--vcan-sample" && argc == 6)
    return run_vcan_sample({.axisd = arguments[2], .axisd_sim = arguments[3]},
                           {.part = std::stoul(arguments[4]), .of = std::stoul(arguments[5])})
               ? 0
               : 1;
  return RUN_ALL_TESTS();
}
