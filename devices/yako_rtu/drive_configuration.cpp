// The registers of the configuration: how they are read and written, and whether they are still as they were.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {

namespace {

constexpr std::size_t longest_write = 16;
constexpr int write_attempts = 3;

TransactionOptions parameters() { return {.transaction_class = TransactionClass::parameters}; }

std::uint16_t register_of(std::uint32_t address) { return static_cast<std::uint16_t>(address); }

std::vector<std::uint16_t> registers_of(const std::vector<std::uint32_t>& addresses) {
  return {addresses.begin(), addresses.end()};
}

}  // namespace

/// Thread: core.
class YakoRtuDrive::Memory final : public DriveMemory {
 public:
  explicit Memory(YakoRtuDrive& drive) : drive_(&drive) {}

  Task<Result<SettingValues>> read(std::vector<std::uint32_t> addresses, Moment moment) override;
  Task<Result<std::vector<ParameterValue>>> read_numbers(std::vector<std::uint32_t> addresses) override {
    return drive_->read_values(std::move(addresses), parameters());
  }
  Task<Result<void>> write(std::uint32_t address, std::vector<std::int64_t> values) override;
  Task<Result<void>> turn_switch(bool saves) override;
  Task<Result<Activity>> activity() override;
  [[nodiscard]] std::vector<DriveSetting> silenced(std::span<const DriveSetting> required,
                                                   const SettingValues& present) const override {
    const auto& setup = drive_->setup_;
    return silenced_segments(required, present, segment_enables(*drive_->model_, setup),
                             setup.persist.segments);
  }
  [[nodiscard]] std::string name_of(std::uint32_t address) const override {
    return fmt::format("register 0x{:04X}", address);
  }
  [[nodiscard]] Error error_at(Reason reason, std::uint32_t address, std::string message,
                               std::string remedy) const override {
    return drive_->error_at(reason, register_of(address), std::move(message), std::move(remedy));
  }
  [[nodiscard]] Result<void> permit(std::uint64_t saves) const override {
    return drive_->permit_saves(saves);
  }
  void count(std::uint64_t saved) override { drive_->count_save(saved); }

 private:
  YakoRtuDrive* drive_;
};

Task<Result<SettingValues>> YakoRtuDrive::Memory::read(std::vector<std::uint32_t> addresses, Moment moment) {
  const bool has_loop_mode = drive_->model_->descriptor->capabilities.closed_loop;
  if (has_loop_mode && moment == Moment::before) addresses.push_back(reg::loop_mode);
  const auto found = co_await drive_->read_registers(registers_of(addresses), parameters());
  if (!found) co_return fail(found.error());
  if (moment == Moment::after)
    for (const auto& [address, value] : *found) drive_->note_register(address, value);
  else if (const auto mode = found->find(reg::loop_mode);
           has_loop_mode && mode != found->end() && !drive_->found_closed_)
    drive_->found_closed_ = mode->second == 0;
  co_return SettingValues(found->begin(), found->end());
}

Task<Result<void>> YakoRtuDrive::Memory::write(std::uint32_t address, std::vector<std::int64_t> values) {
  drive_->proven_at_.reset();
  if (address <= reg::terminal_move_mode && address + values.size() > reg::terminal_move_mode)
    drive_->terminal_move_mode_.reset();  // until it was read again
  std::vector<std::uint16_t> words;
  std::ranges::transform(values, std::back_inserter(words),
                         [](std::int64_t value) { return static_cast<std::uint16_t>(value); });
  const auto& node = drive_->node_;
  const auto written = words.size() == 1
                           ? co_await node.write(register_of(address), words.front(), parameters())
                           : co_await node.write_block(register_of(address), words, parameters());
  if (!written) co_return drive_->failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::Memory::turn_switch(bool saves) {
  const std::uint16_t value = saves ? 0 : 1;
  const auto written = co_await drive_->node_.write_patiently(reg::eeprom_update, value, parameters());
  if (!written) co_return drive_->failed(written.error());
  co_return Result<void>{};
}

Task<Result<DriveMemory::Activity>> YakoRtuDrive::Memory::activity() {
  const auto answer = co_await drive_->node_.read(reg::mode, state_count, parameters());
  if (!answer) co_return drive_->failed(answer.error());
  const auto state = decode_state(answer->registers);
  co_return Activity{.enabled = state.enabled, .moving = state.moving, .inputs = state.inputs};
}

std::unique_ptr<DriveMemory> YakoRtuDrive::make_memory() { return std::make_unique<Memory>(*this); }

MemoryTraits YakoRtuDrive::memory_traits() const {
  return {.saving_switch = reg::eeprom_update,
          .input_levels = reg::input_levels,
          .input_functions = model_->descriptor->input_functions,
          .parameters = model_->descriptor->parameters,
          .saves_at_rest = setup_.persist == PersistSettings::all(),
          .value_mask = 0xFFFF,
          .longest_run = longest_write,
          .write_attempts = write_attempts};
}

Task<Result<Drift>> YakoRtuDrive::check_drift(TransactionOptions options) {
  const auto present = co_await read_registers(registers_of(configuration_.watched()), std::move(options));
  if (!present) co_return fail(present.error());
  co_return configuration_.drift_in({present->begin(), present->end()});
}

}  // namespace axisd::yako_rtu
