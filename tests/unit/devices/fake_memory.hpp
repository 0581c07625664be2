// A drive's memory without a drive: what is asked of it stands in a log.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "devices/drive_configuration.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd {

class FakeMemory final : public DriveMemory {
 public:
  SettingValues values;
  Activity present;
  std::set<std::uint32_t> deaf;         ///< a write there changes nothing
  std::set<std::uint32_t> to_silence;   ///< what silenced() names
  std::deque<Result<void>> write_ends;  ///< of the next writes; then all succeed
  std::optional<Error> read_fails_before, read_fails_after, switch_fails, activity_fails;
  std::uint64_t budget = 100;                ///< saves that are permitted
  mutable std::vector<std::uint64_t> asked;  ///< of permit()
  std::uint64_t counted = 0;

  /// What was asked since the last call: "before 40 41", "41=0", "saves", "saves not", "look", "after 40 41".
  std::string log() { return std::exchange(log_, {}); }

  Task<Result<SettingValues>> read(std::vector<std::uint32_t> addresses, Moment moment) override {
    const bool before = moment == Moment::before;
    std::string line = before ? "before" : "after";
    SettingValues found;
    for (const auto address : addresses) {
      line += fmt::format(" {:x}", address);
      found[address] = values.at(address);
    }
    note(line);
    if (const auto& error = before ? read_fails_before : read_fails_after) co_return fail(*error);
    co_return found;
  }
  Task<Result<std::vector<ParameterValue>>> read_numbers(std::vector<std::uint32_t> addresses) override {
    std::string line = "numbers";
    std::vector<ParameterValue> found;
    for (const auto address : addresses) {
      line += fmt::format(" {:x}", address);
      found.push_back({.address = address, .value = values.at(address)});
    }
    note(line);
    if (const auto& error = read_fails_before) co_return fail(*error);
    co_return found;
  }
  Task<Result<void>> write(std::uint32_t address, std::vector<std::int64_t> written) override {
    std::string line = fmt::format("{:x}=", address);
    for (std::size_t i = 0; i < written.size(); ++i)
      line += fmt::format("{}{}", i == 0 ? "" : ",", written[i]);
    note(line);
    Result<void> end;
    if (!write_ends.empty()) {
      end = write_ends.front();
      write_ends.pop_front();
    }
    for (std::uint32_t i = 0; end && i < written.size(); ++i)
      if (!deaf.contains(address + i)) values[address + i] = written[i];
    co_return end;
  }
  Task<Result<void>> turn_switch(bool saves) override {
    note(saves ? "saves" : "saves not");
    if (switch_fails) co_return fail(*switch_fails);
    co_return Result<void>{};
  }
  Task<Result<Activity>> activity() override {
    note("look");
    if (activity_fails) co_return fail(*activity_fails);
    co_return present;
  }
  [[nodiscard]] std::vector<DriveSetting> silenced(std::span<const DriveSetting> /*required*/,
                                                   const SettingValues& /*present*/) const override {
    std::vector<DriveSetting> all;
    for (const auto address : to_silence)
      all.push_back({.address = address, .key = "segments", .starts_motion = true});
    return all;
  }
  [[nodiscard]] std::string name_of(std::uint32_t address) const override {
    return fmt::format("place {:x}", address);
  }
  [[nodiscard]] Error error_at(Reason reason, std::uint32_t address, std::string message,
                               std::string remedy) const override {
    return {.reason = reason,
            .message = std::move(message),
            .remedy = std::move(remedy),
            .where = {.object = address}};
  }
  [[nodiscard]] Result<void> permit(std::uint64_t saves) const override {
    asked.push_back(saves);
    if (saves > budget) return fail(Reason::eeprom_budget, "no more today");
    return {};
  }
  void count(std::uint64_t saved) override { counted += saved; }

 private:
  void note(const std::string& line) { log_ += (log_.empty() ? "" : "; ") + line; }

  std::string log_;
};

/// Runs a sequence to its end.
template <class T>
Result<T> run(Task<Result<T>> task) {
  test::VirtualWorld world;
  std::optional<Result<T>> result;
  const auto store = [](Task<Result<T>> task, std::optional<Result<T>>& result) -> Task<> {
    result = co_await std::move(task);
  };
  spawn(world.executor(), store(std::move(task), result), "test");
  world.run_until([&] { return result.has_value(); }, std::chrono::minutes(1));
  return result.value_or(fail(Reason::internal, "it does not end"));
}

}  // namespace axisd
