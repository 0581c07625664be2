#include "tests/conformance/real/vcan_suite.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

/// Scenarios mostly wait: more of them at once than there are processors (the guest has one).
constexpr int workers = 3;

/// Too long for real time, or about what a vcan cannot have.
constexpr std::string_view left_out[] = {
    "thousand_moves",  // hours
    "set_serial",      // a vcan has no bit rate, so that nobody hears the wrong one
    "scan",            // nothing but the bus: as in virtual time
    "full_bus",        // 32 drives and their SYNC are too much for the guest's processor
};

struct Job {
  const Scenario* scenario;
  const Manual* manual;
  Variant variant;
};

/// Models on CAN that have a manual of their own, plain, and inverted where direction is a subject. (What
/// axisd knows by a data sheet alone runs the same driver.)
std::vector<Job> jobs(const std::vector<Manual>& manuals, std::string_view named) {
  std::vector<Job> all;
  for (const auto& manual : manuals)
    for (const auto& subject : subjects())
      for (const auto& scenario : subject.scenarios)
        for (const bool invert : {false, true})
          if ((subject.varied || !invert) &&
              std::ranges::find(left_out, scenario.name) == std::end(left_out) &&
              scenario.name.find(named) != std::string_view::npos)
            all.push_back({.scenario = &scenario, .manual = &manual, .variant = {.invert = invert}});
  return all;
}

class Workers {
 public:
  Workers(const Programs& programs, std::vector<Job> jobs) : programs_(&programs), jobs_(std::move(jobs)) {}

  /// Jobs that failed twice: what fails runs again, alone. Real time takes its share of a loaded computer,
  /// whose lateness is no finding.
  int run() {
    run_all(workers);
    fmt::print("{} of {} passed at once\n", jobs_.size() - failed_.size(), jobs_.size());
    jobs_ = std::exchange(failed_, {});
    next_ = 0;
    run_all(1);
    fmt::print("{} failed\n", failed_.size());
    return static_cast<int>(failed_.size());
  }

 private:
  void run_all(int count) {
    std::vector<std::thread> threads;
    for (int i = 0; i < count; ++i)
      threads.emplace_back([this] { work(fmt::format("cell{}", ++interfaces_)); });
    for (auto& thread : threads) thread.join();
  }
  void work(const std::string& interface) {
    if (std::system(fmt::format("ip link add {0} type vcan && ip link set {0} up", interface).c_str()) != 0)
      throw std::runtime_error("no interface " + interface);
    while (const auto* job = next()) {
      const auto begin = monotonic_now();
      const auto finding = run_scenario(*job->scenario, *job->manual, job->variant, [&](const Plant& plant) {
        return make_process_target(*programs_, interface, plant);
      });
      report(*job, finding, monotonic_now() - begin);
    }
  }
  const Job* next() {
    const std::lock_guard lock(mutex_);
    return next_ == jobs_.size() ? nullptr : &jobs_[next_++];
  }
  void report(const Job& job, const Finding& finding, Duration took) {
    const std::lock_guard lock(mutex_);
    const bool passed = finding.failures.empty();
    if (!passed) failed_.push_back(job);
    fmt::print("{} {} {} {} ({:.1f} s)\n", passed ? "passed" : "FAILED", job.manual->model(),
               job.scenario->name, job.variant.name(), std::chrono::duration<double>(took).count());
    for (const auto& failure : finding.failures) fmt::print("  {}\n", failure);
    std::fflush(stdout);
  }

  const Programs* programs_;
  std::vector<Job> jobs_, failed_;
  std::mutex mutex_;
  std::size_t next_ = 0;
  std::atomic<int> interfaces_ = 0;
};

}  // namespace

int run_vcan_suite(const Programs& programs, std::string_view named) {
  std::vector<Manual> manuals;
  for (const auto& model : models())
    if (Manual manual(model); manual.bus() == "canopen" && !manual.has("data_sheet"))
      manuals.push_back(std::move(manual));
  auto all = jobs(manuals, named);
  return all.empty() ? -1 : Workers(programs, std::move(all)).run();
}

}  // namespace axisd::conformance
