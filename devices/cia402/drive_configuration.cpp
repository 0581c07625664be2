// The objects of the configuration: how they are read and written, and whether they are still as they were.
#include <fmt/format.h>

#include <utility>

#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

/// Writes of the configuration may happen twice.
canopen::SdoOptions patiently() { return {.transaction_class = TransactionClass::parameters, .attempts = 3}; }

}  // namespace

/// Thread: core.
class Cia402Drive::Memory final : public DriveMemory {
 public:
  explicit Memory(Cia402Drive& drive) : drive_(&drive) {}

  Task<Result<SettingValues>> read(std::vector<std::uint32_t> addresses, Moment /*moment*/) override {
    return drive_->read_values(std::move(addresses), patiently());
  }
  Task<Result<std::vector<ParameterValue>>> read_numbers(std::vector<std::uint32_t> addresses) override;
  Task<Result<void>> write(std::uint32_t address, std::vector<std::int64_t> values) override {
    return drive_->write_object(Object::of(address), values.front(), 0, patiently());
  }
  Task<Result<void>> turn_switch(bool saves) override {
    return drive_->write_object(*drive_->model_->objects.eeprom_switch, saves ? 0 : 1, 0, patiently());
  }
  Task<Result<Activity>> activity() override;
  [[nodiscard]] std::string name_of(std::uint32_t address) const override { return object_text(address); }
  [[nodiscard]] Error error_at(Reason reason, std::uint32_t address, std::string message,
                               std::string remedy) const override {
    return drive_->error_at(reason, Object::of(address), std::move(message), std::move(remedy));
  }
  [[nodiscard]] Result<void> permit(std::uint64_t saves) const override {
    return drive_->permit_saves(saves);
  }
  void count(std::uint64_t saved) override { drive_->count_save(saved); }

 private:
  Cia402Drive* drive_;
};

Task<Result<std::vector<ParameterValue>>> Cia402Drive::Memory::read_numbers(
    std::vector<std::uint32_t> addresses) {
  std::vector<ParameterValue> values;
  for (const auto address : addresses) {
    const auto value = co_await drive_->read_object(Object::of(address),
                                                    {.transaction_class = TransactionClass::parameters});
    if (!value) co_return fail(value.error());
    values.push_back({.address = address, .value = *value});
  }
  co_return values;
}

Task<Result<DriveMemory::Activity>> Cia402Drive::Memory::activity() {
  const auto& model = *drive_->model_;
  std::vector<std::uint32_t> addresses;
  for (const auto object : state_objects(model)) addresses.push_back(object.key());
  if (model.objects.moving) addresses.push_back(model.objects.moving->key());
  const auto values = co_await drive_->read_values(std::move(addresses), patiently());
  if (!values) co_return fail(values.error());
  const auto state = drive_->decoded(*values);
  co_return Activity{.enabled = state.enabled, .moving = state.moving, .inputs = state.inputs};
}

std::unique_ptr<DriveMemory> Cia402Drive::make_memory() { return std::make_unique<Memory>(*this); }

MemoryTraits Cia402Drive::memory_traits() const {
  MemoryTraits traits{.input_functions = model_->descriptor->input_functions,
                      .parameters = model_->descriptor->parameters,
                      .saves_at_rest = setup_.persist == PersistSettings::all()};
  if (const auto& saving = model_->objects.eeprom_switch) traits.saving_switch = saving->key();
  if (const auto& levels = model_->objects.input_levels) traits.input_levels = levels->key();
  return traits;
}

Task<Result<Values>> Cia402Drive::read_values(std::vector<std::uint32_t> addresses, SdoOptions options) {
  Values values;
  for (const auto address : addresses) {
    const auto value = co_await read_object(Object::of(address), options);
    if (!value) co_return fail(value.error());
    values[address] = *value;
  }
  co_return values;
}

Task<Result<Drift>> Cia402Drive::check_drift(TransactionOptions options) {
  const SdoOptions asked{.transaction_class = options.transaction_class,
                         .deadline = options.deadline,
                         .guard = std::move(options.guard)};
  const auto present = co_await read_values(configuration_.watched(), asked);
  if (!present) co_return fail(present.error());
  auto drift = configuration_.drift_in(*present);
  const auto units = co_await unit_conflict(asked);
  if (!units) co_return fail(units.error());
  const auto braking = co_await deceleration_conflict(asked);
  if (!braking) co_return fail(braking.error());
  if (const auto quick = co_await read_quick_stop_ramp(asked); !quick) co_return fail(quick.error());
  for (const auto* conflict : {&*units, &*braking})
    if (*conflict) drift.text += (drift.text.empty() ? "" : "; ") + (*conflict)->message;
  drift.scale_changed = drift.scale_changed || units->has_value();
  drift.limits_changed = drift.limits_changed || braking->has_value();
  co_return drift;
}

}  // namespace axisd::cia402
