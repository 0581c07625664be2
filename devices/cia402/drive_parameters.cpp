// The catalogue by object, the drive's memory, its node-ID and bit rate.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/canopen/sdo_abort.hpp"
#include "devices/cia402/drive.hpp"
#include "devices/cia402/unit_objects.hpp"
#include "devices/drive_access.hpp"

namespace axisd::cia402 {

namespace {

/// The manuals give no figure for how long the whole dictionary takes to be saved; the drive may be silent
/// meanwhile.
constexpr auto eeprom_patience = std::chrono::seconds(3);
constexpr int canary_attempts = 3;
constexpr std::uint32_t first_own_object = 0x200000;  ///< before it: communication (CiA 301)

canopen::SdoOptions parameters() { return {.transaction_class = TransactionClass::parameters}; }
canopen::SdoOptions eeprom() {
  return {.transaction_class = TransactionClass::parameters,
          .timeout = eeprom_patience,
          .transfer_limit = eeprom_patience + std::chrono::seconds(1)};
}

bool is_writable(const ParameterSpec& parameter) {
  return parameter.access == Access::rw || parameter.access == Access::rw_saved;
}

struct Owner {
  canopen::Object object;
  std::string_view key;
};
/// Written with every motion, or by the call that is named.
constexpr Owner motion_owners[] = {{object::control_word, "AxisService.Enable"},
                                   {object::halt_option, "AxisService.Stop"},
                                   {object::mode, "each motion command"},
                                   {object::position, "AxisService.SetPosition"},
                                   {object::target_position, "each motion command"},
                                   {object::target_velocity, "each motion command"},
                                   {object::profile_velocity, "limits.velocity"},
                                   {object::acceleration, "limits.acceleration_time"},
                                   {object::deceleration, "limits.deceleration_time"}};

}  // namespace

std::string Cia402Drive::configured_by(std::uint32_t address) const {
  if (auto key = configuration_.key_of(address); !key.empty()) return key;
  const auto* parameter = find_parameter(model_->descriptor->parameters, address);
  if (parameter == nullptr || !is_writable(*parameter)) return {};
  if (address < first_own_object) return "the CANopen master";
  const auto object = Object::of(address);
  if (const auto* owner = std::ranges::find(motion_owners, object, &Owner::object);
      owner != std::end(motion_owners))
    return std::string(owner->key);
  if (object == object::homing_method && setup_.homing) return "homing.method";
  if (std::ranges::find(model_->unit_objects, object) != model_->unit_objects.end())
    return std::string(key_of(object));
  if (object == model_->objects.start_speed) return "limits.start_speed";
  if (object == model_->objects.eeprom_switch) return "persist";
  if (model_->addressing && object == model_->addressing->custom_node) return "DriveService.Readdress";
  if (model_->addressing && object == model_->addressing->custom_bitrate) return "DriveService.SetSerial";
  return {};
}

Task<Result<std::vector<ParameterValue>>> Cia402Drive::read_parameters(std::vector<std::uint32_t> addresses) {
  std::vector<ParameterValue> values;
  for (const auto address : addresses) {
    const auto value = co_await read_object(Object::of(address), parameters());
    // The manual's counts imply objects that its table does not list: asked for with all others, they are no
    // reason to read none.
    if (!value && canopen::is_missing(value.error()) && addresses.size() > 1) continue;
    if (!value) co_return fail(value.error());
    values.push_back({.address = address, .value = *value});
  }
  co_return values;
}

Task<Result<std::vector<ParameterValue>>> Cia402Drive::write_parameters(std::vector<ParameterValue> values) {
  return configuration_.write_parameters(std::move(values));
}

Error Cia402Drive::not_supported(std::string message, std::string remedy) const {
  return {.reason = Reason::not_supported,
          .message = std::move(message),
          .remedy = std::move(remedy),
          .where = {.bus = bus_->name(), .node = node_.id()}};
}

Task<Result<void>> Cia402Drive::quieten() {
  // A terminal that starts a motion (position, velocity) would run with what stands here.
  const auto velocity = co_await read_target_velocity(parameters());
  if (!velocity) co_return fail(velocity.error());
  if (*velocity != 0)
    if (const auto stopped = co_await clear_target_velocity(parameters()); !stopped) co_return stopped;
  // A terminal may have released the motor that the control word still enables.
  constexpr std::int64_t enabling = 0x0007;
  const auto word = co_await read_object(object::control_word, parameters());
  if (!word) co_return fail(word.error());
  if ((*word & enabling) != enabling) co_return Result<void>{};
  co_return co_await write_control(control_word(ControlCommand::disable_voltage), parameters());
}

Task<Result<void>> Cia402Drive::save_parameters() {
  if (!model_->objects.save)
    co_return fail(not_supported("the drive cannot save its parameters",
                                 "the configuration is applied after each power-up"));
  if (const auto permitted = permit_saves(1); !permitted) co_return permitted;
  // What is saved now stands there after the next power-up: nothing that moves or enables (M27).
  if (const auto quiet = co_await quieten(); !quiet) co_return quiet;
  const auto neutral = canary_.distinct(fresh_neutral_block());
  if (auto written = co_await write_canary(neutral, parameters()); !written) {
    if (written.error().outcome == Outcome::unknown) written.error().outcome = Outcome::not_executed;
    co_return written;
  }
  const auto saved =
      co_await write_object(model_->objects.save->object, model_->objects.save->value, 0, eeprom());
  if (saved || saved.error().outcome == Outcome::unknown) {
    count_save(
        static_cast<std::uint64_t>(std::ranges::count_if(model_->descriptor->parameters, is_writable)));
    // Saved, this block would no longer tell a power-up (M7): whatever comes now, it is no proof any more.
    canary_.note_power_up(neutral);
    const auto fresh = canary_.distinct(fresh_neutral_block());
    for (int attempt = 0; attempt < canary_attempts; ++attempt)
      if (co_await write_canary(fresh, parameters())) break;
    canary_.distrust(neutral);
  }
  if (!saved) co_return saved;
  co_return co_await check_continuity(TransactionClass::parameters);
}

/// Which node-ID and bit rate the drive will have after its factory settings.
Task<Result<std::string>> Cia402Drive::factory_address(const std::vector<std::uint8_t>& taken) {
  if (!model_->addressing) co_return std::string("the node-ID and bit rate that its switches say");
  const auto& addressing = *model_->addressing;
  const auto node = co_await read_object(addressing.node, parameters());
  if (!node) co_return fail(node.error());
  const auto custom = co_await read_object(addressing.custom_node, parameters());
  if (!custom) co_return fail(custom.error());
  const auto factory = addressing.factory_custom_node;
  // By its switches a node-ID stays as it is.
  if (*node != *custom)
    co_return fmt::format("node-ID {} by its switches, {}", *node, addressing.factory_bitrate);
  if (factory != 0 && std::ranges::find(taken, factory) != taken.end())
    co_return fail(error_at(
        Reason::misconfigured, addressing.custom_node,
        fmt::format(
            "after the next power-up the drive would have node-ID {}, which another axis of this bus has",
            factory),
        "set the drive's address switches first, or give the other drive another node-ID"));
  co_return fmt::format("node-ID {}, {}",
                        factory != 0 ? std::to_string(factory) : "undefined (set the address switches first)",
                        addressing.factory_bitrate);
}

Task<Result<std::string>> Cia402Drive::restore_factory(std::vector<std::uint8_t> taken) {
  if (!model_->objects.restore)
    co_return fail(not_supported("the drive cannot restore its factory settings", "use its maker's tool"));
  // The drive stays out of use until it is configured again, and what is kept there is saved once more.
  const auto saves = 1 + configuration_.saves_of_setup();
  if (const auto permitted = permit_saves(saves); !permitted) co_return fail(permitted.error());
  auto address = co_await factory_address(taken);
  if (!address) co_return address;
  const auto& command = *model_->objects.restore;
  const auto restored = co_await write_object(command.object, command.value, 0, eeprom());
  if (restored || restored.error().outcome == Outcome::unknown) {
    count_save(static_cast<std::uint64_t>(
        std::ranges::count(model_->descriptor->parameters, Access::rw_saved, &ParameterSpec::access)));
    const auto closed_loop = seen_.closed_loop;  // of this power cycle, which goes on
    forget_power_cycle();                        // whatever stands there now, it is not ours
    seen_.closed_loop = closed_loop;
  }
  if (!restored) co_return fail(restored.error());
  co_return address;
}

Result<std::vector<ParameterValue>> Cia402Drive::addressing_objects(const SerialChange& change) const {
  if (!model_->addressing)
    return fail(not_supported("the drive has no objects for its node-ID and bit rate",
                              "use its switches, or its maker's tool"));
  const auto& addressing = *model_->addressing;
  if (change.format)
    return fail(not_supported("CAN has no character format", "give a node-ID or a bit rate only"));
  std::vector<ParameterValue> values;
  if (change.node) {
    if (*change.node < addressing.minimum_custom_node || *change.node > addressing.maximum_custom_node) {
      auto error = error_at(Reason::out_of_range, addressing.custom_node,
                            fmt::format("node-ID {} cannot be set by an object", *change.node),
                            "use the address switches, or another node-ID");
      error.permitted = Range{.minimum = static_cast<double>(addressing.minimum_custom_node),
                              .maximum = static_cast<double>(addressing.maximum_custom_node)};
      return fail(std::move(error));
    }
    values.push_back({.address = addressing.custom_node.key(), .value = *change.node});
  }
  if (change.baud) {
    const auto code = std::ranges::find(addressing.custom_bitrates, *change.baud);
    if (code == addressing.custom_bitrates.end())
      return fail(error_at(Reason::out_of_range, addressing.custom_bitrate,
                           fmt::format("{} bit/s cannot be set by an object", *change.baud),
                           fmt::format("possible: {}; others by the drive's switches",
                                       fmt::join(addressing.custom_bitrates, ", "))));
    values.push_back(
        {.address = addressing.custom_bitrate.key(), .value = code - addressing.custom_bitrates.begin()});
  }
  if (values.empty())
    return fail(error_at(Reason::invalid_argument, addressing.custom_node, "nothing to change",
                         "name a node-ID or a bit rate"));
  return values;
}

Task<Result<std::string>> Cia402Drive::change_serial(SerialChange change) {
  auto values = addressing_objects(change);
  if (!values) co_return fail(values.error());
  const auto saved = co_await configuration_.write_saved(std::move(*values));
  if (!saved) co_return fail(saved.error());
  std::string text = "it counts from the next power-up";
  const auto& addressing = *model_->addressing;
  if (change.node && !addressing.node_switches.empty())
    text += fmt::format(", with {}", addressing.node_switches);
  if (change.baud && !addressing.bitrate_switches.empty())
    text += fmt::format(", with {}", addressing.bitrate_switches);
  co_return text;
}

}  // namespace axisd::cia402
