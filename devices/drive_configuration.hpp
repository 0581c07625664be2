// The configuration of a drive, step by step, whatever bus it is on (M3): compare, take what could start a
// motion off the inputs, write what differs, verify, leave saving as it is to be; and find what others
// changed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "buses/error.hpp"
#include "buses/task.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive.hpp"
#include "devices/drive_settings.hpp"

namespace axisd {

/// How the memory of one drive is read and written. Errors: as the bus has them, with the address. Thread:
/// core.
class DriveMemory {
 public:
  enum class Moment : std::uint8_t {
    before,  ///< nothing was written yet
    after,   ///< all was written: it is verified
  };
  struct Activity {
    bool enabled = false, moving = false;
    std::uint32_t inputs = 0;  ///< as DriveSample::inputs
  };
  DriveMemory() = default;
  DriveMemory(const DriveMemory&) = delete;
  virtual ~DriveMemory() = default;

  /// All of these that the drive has.
  virtual Task<Result<SettingValues>> read(std::vector<std::uint32_t> addresses, Moment moment) = 0;
  /// As a client sees them: numbers with their sign, in the order asked, all of them.
  virtual Task<Result<std::vector<ParameterValue>>> read_numbers(std::vector<std::uint32_t> addresses) = 0;
  /// One request for values side by side, MemoryTraits::longest_run of them at most.
  virtual Task<Result<void>> write(std::uint32_t address, std::vector<std::int64_t> values) = 0;
  /// Turns MemoryTraits::saving_switch.
  virtual Task<Result<void>> turn_switch(bool saves) = 0;
  virtual Task<Result<Activity>> activity() = 0;
  /// What is written as 0 before `required` is, as long as it is not: else a lost frame could leave behind
  /// what a terminal starts.
  [[nodiscard]] virtual std::vector<DriveSetting> silenced(std::span<const DriveSetting> /*required*/,
                                                           const SettingValues& /*present*/) const {
    return {};
  }
  /// "register 0x0040".
  [[nodiscard]] virtual std::string name_of(std::uint32_t address) const = 0;
  /// Of the drive, not executed.
  [[nodiscard]] virtual Error error_at(Reason reason, std::uint32_t address, std::string message,
                                       std::string remedy) const = 0;
  /// So many requests follow that make it save.
  [[nodiscard]] virtual Result<void> permit(std::uint64_t saves) const = 0;
  /// One request that made it save was sent.
  virtual void count(std::uint64_t saved) = 0;
};

/// What is known of the memory of a model.
struct MemoryTraits {
  std::optional<std::uint32_t> saving_switch{};  ///< 0: what is written is saved as well; 1: it is not
  std::optional<std::uint32_t> input_levels{};
  std::span<const TerminalFunctionSpec> input_functions{};
  std::span<const ParameterSpec> parameters{};  ///< those of rw_saved are saved as they are written
  bool saves_at_rest = false;                   ///< how the switch is left behind
  std::int64_t value_mask = -1;                 ///< bits of a value, where the sign of a number is not sent
  std::size_t longest_run = 1;                  ///< values side by side that one request writes
  int write_attempts = 1;                       ///< as long as no reply comes; each is permitted and counted
};

/// Thread: core.
class DriveConfiguration {
 public:
  /// `required`: what the drive is to hold by its setup, or why it cannot be had.
  DriveConfiguration(std::unique_ptr<DriveMemory> memory, MemoryTraits traits,
                     Result<std::vector<DriveSetting>> required);

  /// Brings the drive to its setup. Errors: misconfigured, refused, no_reply, eeprom_budget.
  Task<Result<void>> apply();
  /// The same for these alone: writes what differs, each part saved or not as it says, and verifies all.
  Task<Result<void>> bring_to(std::vector<DriveSetting> required);
  /// Writes values side by side, and counts what is saved of them.
  Task<Result<void>> write(std::uint32_t address, std::vector<std::int64_t> values);
  /// Writes those that differ, none if not all may be saved, and reads all back. Errors: misconfigured
  /// (differs), refused, no_reply, eeprom_budget.
  Task<Result<std::vector<ParameterValue>>> write_parameters(std::vector<ParameterValue> values);
  /// The same for what counts from the next power-up: they are saved, whatever `persist` says.
  Task<Result<void>> write_saved(std::vector<ParameterValue> values);
  /// Turns the switch of saving, if it is not so already. `then`: saves that it is turned on for; they are
  /// permitted together, as turned in vain it only wears.
  Task<Result<void>> save_writes(bool saved, std::uint64_t then = 0);
  /// As it is to be between configurations.
  Task<Result<void>> leave_switch() { return save_writes(traits_.saves_at_rest); }

  /// A write to it is saved, as far as is known.
  [[nodiscard]] bool is_saved(std::uint32_t address) const { return saved_of(address, 1) > 0; }
  /// The drive saves what is written, as far as is known.
  [[nodiscard]] bool saves() const { return saving_.value_or(true); }
  /// How many requests save when the setup is applied to a drive that holds nothing of it.
  [[nodiscard]] std::uint64_t saves_of_setup() const;
  /// The key of the configuration that decides this one, or empty.
  [[nodiscard]] std::string key_of(std::uint32_t address) const;
  /// The drive was switched off and on, or is as the factory made it: what it refused to hold is tried again.
  void forget_power_cycle();
  /// It cannot be configured, for this reason.
  void refuse(Error error) { error_ = std::move(error); }
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

  /// What drift is looked for in.
  [[nodiscard]] std::vector<std::uint32_t> watched() const { return addresses_of(watched_); }
  [[nodiscard]] Drift drift_in(const SettingValues& present) const;

 private:
  Task<Result<void>> write_all(std::vector<DriveSetting> required, SettingValues present);
  Task<Result<void>> neutralise(DriveSetting input);
  Task<Result<void>> prepare_write(DriveSetting setting);
  Task<Result<void>> check_inactive(DriveSetting setting);
  Task<Result<void>> verify(std::vector<DriveSetting> required);
  /// Inputs that get another function or level, and have one that can start motion: the new level could act
  /// like an edge of the old function.
  [[nodiscard]] std::vector<DriveSetting> starting_inputs(std::span<const DriveSetting> required,
                                                          const SettingValues& present) const;
  /// The values that one request writes, from the first of `required` on, which differs.
  [[nodiscard]] std::vector<std::int64_t> run_of(std::span<const DriveSetting> required,
                                                 const SettingValues& present) const;
  [[nodiscard]] std::uint64_t saved_of(std::uint32_t address, std::size_t count) const;
  [[nodiscard]] Error not_held(const DriveSetting& setting, std::int64_t actual) const;

  std::unique_ptr<DriveMemory> memory_;
  MemoryTraits traits_;
  std::vector<DriveSetting> required_;  ///< empty if it cannot be had
  std::vector<DriveSetting> watched_;
  std::optional<Error> error_;
  // Of this power cycle.
  std::optional<bool> saving_;        ///< what the switch says, if it is known
  std::set<std::uint32_t> not_held_;  ///< saved ones that did not hold what was written
};

}  // namespace axisd
