// Identity, and what bring-up does beside the configuration of the drive itself: identifiers, heartbeat,
// PDOs.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/canopen/cob.hpp"
#include "buses/canopen/sdo_abort.hpp"
#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

using canopen::CanopenBus;
using canopen::PdoDirection;
using std::chrono::milliseconds;

constexpr auto heartbeat_period = milliseconds(250);
constexpr auto heartbeat_patience = milliseconds(1000);
/// Nobody who takes part in the network is silent for so long.
constexpr auto silence_of_absent = milliseconds(1000);
constexpr std::uint32_t full_speed = 1'000'000;
constexpr std::uint16_t command_number = 1, start_number = 2;  ///< of RPDOs
constexpr std::uint8_t with_each_sync = 1;
canopen::PdoMapping control_alone() { return {{.object = object::control_word, .bits = 16}}; }

canopen::SdoOptions in(TransactionClass transaction_class) {
  return {.transaction_class = transaction_class};
}
/// Writes of bring-up may happen twice.
canopen::SdoOptions patiently() { return {.transaction_class = TransactionClass::parameters, .attempts = 3}; }

/// On a slower network PDOs come less often, so that they take the same share of it.
milliseconds scaled(milliseconds period, std::uint32_t bitrate) {
  return period * (full_speed / std::clamp<std::uint32_t>(bitrate, 10'000, full_speed));
}

std::string version_text(std::int64_t number) {
  return fmt::format("V{}.{}", number >> 8U, (number >> 4U) & 0xFU);
}

/// Why the node cannot have this PDO; empty: it has it.
std::string objection(const canopen::PdoOutcome& outcome, const canopen::PdoSettings& wanted) {
  const auto name = canopen::name_of(wanted.direction, wanted.number);
  const bool synchronous = wanted.transmission_type < canopen::event_driven_of_manufacturer;
  const bool timely = outcome.state.transmission_type == wanted.transmission_type &&
                      (synchronous || !wanted.event_timer || outcome.state.event_timer.value_or(0) > 0);
  if (outcome.carries(wanted.mapping) && timely) return {};
  std::string why = fmt::format("{}", fmt::join(outcome.remarks, ", "));
  if (const auto& error = outcome.error)
    why = error->where.object ? fmt::format("{}: {}", object_text(*error->where.object), error->message)
                              : error->message;
  if (!outcome.read_only.empty())
    why += fmt::format("{}{} is read-only", why.empty() ? "" : "; ", to_string(outcome.read_only.front()));
  return fmt::format("{}: {}", name, why);
}

}  // namespace

Cia402Drive::Cia402Drive(const Model& model, DriveContext context)
    : Drive({.parameters = this,
             .memory = this,
             .serial = this,
             .loading = this,
             .common_start = this,
             .drift = this,
             .marks = this,
             .news = this,
             .stops = this}),
      model_(&model),
      executor_(context.executor),
      clock_(context.clock),
      bus_(context.canopen),
      node_(context.canopen->master().node(context.node)),
      setup_(model, std::move(context.setup)),
      configuration_(make_memory(), memory_traits(), required_objects(model, setup_)),
      news_(context.executor, *context.clock),
      state_link_(*bus_, news_),
      words_(model.neutral_mode),
      canary_(default_block(model)) {
  const auto attached = bus_->attach(
      node_.id(), {.on_event = [this](const canopen::NodeEvent& event) { on_event(event); },
                   .on_emergency = [this](const canopen::Emergency& one) { on_emergency(one); },
                   .on_foreign_command = [this](const std::string& what) { on_foreign_command(what); }});
  if (!attached) configuration_.refuse(attached.error());
}

Cia402Drive::~Cia402Drive() { bus_->detach(node_.id()); }

Task<Result<DriveIdentity>> Cia402Drive::identify(TransactionClass transaction_class) {
  contact_.begin();
  // A stopped node answers no SDO (CiA 301 table 38); operational alone it does nothing.
  if (bus_->master().nmt().status(node_.id()).state == canopen::NmtState::stopped)
    if (const auto started = co_await start_node(); !started) co_return fail(started.error());
  const auto found = co_await canopen::read_identity(node_, in(transaction_class));
  if (!found) {
    if (found.error().reason == Reason::no_reply && is_silent())
      bus_->set_readiness(node_.id(), CanopenBus::Readiness::absent);
    co_return failed(found.error());
  }
  contact_.note_answer();
  if (const auto fits = canopen::check_identity(*found, model_->identity); !fits) {
    bus_->set_readiness(node_.id(), CanopenBus::Readiness::absent);  // somebody else's
    co_return fail(error_at(Reason::wrong_model, {0x1018, 0},
                            fmt::format("not a {}: {}", model_->descriptor->model, fits.error().message),
                            fits.error().remedy));
  }
  DriveIdentity identity{.model_code = found->product.value_or(0)};
  // CiA 301 7.5.2.18: major and minor revision, of what the drive can do as CANopen sees it.
  if (found->revision && !model_->objects.software_version)
    identity.version = fmt::format("{}.{}", *found->revision >> 16U, *found->revision & 0xFFFFU);
  if (model_->objects.software_version) {
    const auto version =
        co_await node_.read_if_there(*model_->objects.software_version, in(transaction_class));
    if (!version) co_return failed(version.error());
    if (*version) identity.version = version_text(static_cast<std::int64_t>(**version));
  }
  if (const auto alone = check_alone(); !alone) co_return fail(alone.error());
  co_return identity;
}

Result<void> Cia402Drive::check_alone() const {
  if (!bus_->master().sdo().answers_twice(node_.id())) return {};
  return fail(error_at(Reason::misconfigured, {0x1018, 0},
                       "requests are answered twice (two nodes with this node-ID?)",
                       "give each node of the network a node-ID of its own"));
}

/// A node that is heard, or was a moment ago, is there, and may hold something for the next SYNC (M24): it is
/// busy, or answers late.
bool Cia402Drive::is_silent() {
  contact_.note_silence(clock_->now());
  const auto heard = bus_->master().nmt().status(node_.id()).last_heard;
  return contact_.silent_for(clock_->now(), heard) >= silence_of_absent;
}

bool Cia402Drive::closed_loop() const {
  const auto mode = setup_.model_settings.find("loop_mode");
  const bool open = mode != setup_.model_settings.end() && mode->second == SettingValue(std::string("open"));
  // From when the loop mode counts is not said: a drive that came up open is open.
  const bool found = !model_->objects.loop_mode || seen_.closed_loop.value_or(false);
  return model_->descriptor->capabilities.closed_loop && !open && found;
}

/// Where the drive does not say, or has its own window switched off (6067h: FFFFFFFFh), as drives of this
/// kind have it by default.
std::int64_t Cia402Drive::position_window() const {
  const auto mode = setup_.model_settings.find("loop_mode");
  const bool open = mode != setup_.model_settings.end() && mode->second == SettingValue(std::string("open"));
  if (!model_->descriptor->capabilities.closed_loop || open || !seen_.closed_loop.value_or(true)) return 0;
  // Two readings at rest are as far apart as noise of two counts permits.
  constexpr std::int64_t usual = 10, usual_per_revolution = 1000, least = 4;
  const auto revolution = std::max<std::int64_t>(setup_.pulses_per_revolution, 1);
  const auto found = seen_.position_window.value_or(0);
  if (found <= 0 || found > revolution) return std::max(usual, revolution / usual_per_revolution);
  const auto counts = model_->meaning.counts_per_revolution;
  return std::max({least, found, counts == 0 ? found : (found * revolution + counts - 1) / counts});
}

int Cia402Drive::velocity_noise() const {
  const auto found =
      decode_velocity(*model_, setup_.pulses_per_revolution, seen_.velocity_threshold.value_or(0));
  return std::clamp(found, velocity_noise_rpm, most_velocity_noise_rpm);
}

Task<Result<void>> Cia402Drive::configure() {
  if (configuration_.error()) co_return failed(*configuration_.error());
  // Before anything else: an EMCY with the identifier 80h would be a SYNC to the others (M24).
  if (const auto set = co_await set_emergency_id(); !set) co_return set;
  // The canary goes first and is read last: a restart in between would undo what was found or written.
  const auto block = co_await read_block(patiently());
  if (!block) co_return fail(block.error());
  const bool known = canary_.is_expected(*block);
  const bool restarted = !known && canary_.expects_anything();
  if (!known) {
    forget_power_cycle();
    canary_.note_power_up(*block);
  }
  // Whatever asked for this: a restart that nobody had noticed must not be overwritten here.
  if (restarted) co_return fail(lost_memory());
  canary_.rewrite();
  if (const auto marked = co_await write_canary(canary_.distinct(fresh_neutral_block()), patiently());
      !marked)
    co_return marked;
  if (const auto fitting = co_await check_plan(); !fitting) co_return fitting;
  if (model_->objects.loop_mode && !seen_.closed_loop) {
    const auto mode = co_await read_object(*model_->objects.loop_mode, patiently());
    if (!mode) co_return fail(mode.error());
    seen_.closed_loop = *mode == 0;
  }
  for (const auto& window : {model_->objects.position_window, model_->objects.velocity_threshold}) {
    if (!window) continue;
    const auto found = co_await read_object(*window, patiently());
    const bool missing =
        !found && found.error().reason == Reason::refused;  // some list it, and do not have it
    if (!found && !missing) co_return fail(found.error());
  }
  if (const auto done = co_await configuration_.apply(); !done) co_return done;
  if (const auto halting =
          co_await write_object(object::halt_option, model_->meaning.halt_on_ramp, 0, patiently());
      halting)
    words_.set_halt_option(model_->meaning.halt_on_ramp);
  // Saved only where everything is: what is in the EEPROM is not written again after the next power-up, and
  // to switch saving off for it would itself be a write to the EEPROM at each start.
  auto switched = co_await configuration_.leave_switch();
  if (switched) switched = co_await set_heartbeat();
  if (switched) switched = co_await disarm(patiently());
  if (switched) switched = co_await set_pdos();
  if (!switched) co_return switched;
  co_return co_await check_continuity(TransactionClass::parameters);
}

/// Within the canary: what a power-up may have changed is read in the power cycle that it counts for.
Task<Result<void>> Cia402Drive::check_plan() {
  auto conflict = co_await unit_conflict(patiently());
  if (conflict && !*conflict) conflict = co_await deceleration_conflict(patiently());
  if (!conflict) co_return fail(conflict.error());
  if (!*conflict) co_return co_await read_quick_stop_ramp(patiently());
  co_return fail(
      error_at(Reason::misconfigured, (*conflict)->object, (*conflict)->message, (*conflict)->remedy));
}

Task<Result<std::optional<PlanConflict>>> Cia402Drive::unit_conflict(SdoOptions options) {
  Values values;
  for (const auto object : model_->unit_objects) {
    const auto value = co_await read_object(object, options);
    if (value) values[object.key()] = *value;
    if (value || canopen::is_missing(value.error())) continue;  // what it does not have tells nothing
    auto error = value.error();
    if (error.outcome == Outcome::refused)
      error.remedy = fmt::format("where the drive does not have it, add drive: {{ objects: {{ {} }} }}",
                                 without(object));
    co_return fail(std::move(error));
  }
  co_return find_conflict(model_->meaning.units, setup_.pulses_per_revolution, values);
}

/// The file has the value that the drive left the factory with; each bound of a stop is made of it.
Task<Result<std::optional<PlanConflict>>> Cia402Drive::deceleration_conflict(SdoOptions options) {
  const auto planned = model_->descriptor->capabilities.fixed_deceleration;
  if (planned <= 0) co_return std::nullopt;
  const auto none = fmt::format("drive: {{ objects: {{ {} }} }}", without(object::deceleration));
  const auto held = co_await read_object(object::deceleration, std::move(options));
  if (!held) {
    auto error = held.error();
    if (error.outcome == Outcome::refused) error.remedy = "where the drive does not have it, add " + none;
    co_return fail(std::move(error));
  }
  const bool times = model_->meaning.units.ramps == Ramps::times;
  if (times ? *held <= planned : *held >= planned) co_return std::nullopt;
  co_return PlanConflict{
      object::deceleration,
      fmt::format("it brakes for longer than its data sheet says: 6084h is {} instead of {}", *held, planned),
      *held > 0 ? fmt::format("write drive: {{ objects: {{ 6084h: {{ default: {} }} }} }}, or set the drive "
                              "with its own tool",
                              *held)
                : "set the drive with its own tool; where 6084h means nothing, add " + none};
}

Task<Result<void>> Cia402Drive::set_emergency_id() {
  if (!model_->sets_emergency_id) co_return Result<void>{};
  const auto wanted = canopen::emergency_id(node_.id());
  const auto present = co_await node_.read_if_there(object::emergency_id, patiently());
  if (!present) co_return failed(present.error());
  if (!*present || **present == wanted) co_return Result<void>{};
  const auto written = co_await write_object(object::emergency_id, wanted, 4, patiently());
  if (written) co_return Result<void>{};
  const bool looks_like_sync = (**present & canopen::PdoState::id_mask) == canopen::sync_id;
  if (written.error().outcome == Outcome::refused && !looks_like_sync) co_return Result<void>{};
  co_return written;
}

Task<Result<void>> Cia402Drive::set_heartbeat() {
  const auto present = co_await node_.read_if_there(object::heartbeat_time, patiently());
  if (!present) co_return failed(present.error());
  if (!*present) co_return Result<void>{};  // then only its silence tells
  const auto wanted = static_cast<std::uint64_t>(heartbeat_period / milliseconds(1));
  if (**present == 0 || **present > wanted)
    if (const auto written =
            co_await configuration_.write(object::heartbeat_time.key(), {static_cast<std::int64_t>(wanted)});
        !written)
      co_return written;
  bus_->watch_heartbeat(node_.id(), heartbeat_patience);
  co_return Result<void>{};
}

void Cia402Drive::forget_pdos() {
  state_link_.close();
  command_pdo_.reset();
  start_pdo_.forget();
}

Task<Result<void>> Cia402Drive::set_pdos() {
  forget_pdos();
  const auto why = co_await set_state_pdos();
  if (!why) co_return fail(why.error());
  why->empty() ? state_link_.way().expect() : state_link_.way().refuse(*why);
  // Stops go out by this one at once (M12). The drive may have it so by default (chapter 7, 1600h).
  const auto command = co_await set_pdo({.direction = PdoDirection::receive,
                                         .number = command_number,
                                         .cob_id = canopen::rpdo_id(command_number, node_.id()),
                                         .transmission_type = canopen::event_driven_of_profile,
                                         .mapping = control_alone()});
  const bool at_once = command.state.transmission_type.value_or(0) >= canopen::event_driven_of_manufacturer;
  if (command.carries(control_alone()) && at_once) command_pdo_ = command.state.cob_id();
  co_await set_start_pdo();
  co_return Result<void>{};
}

Task<canopen::PdoOutcome> Cia402Drive::set_pdo(canopen::PdoSettings wanted) {
  constexpr std::uint8_t most_subs = 8;
  bool saved = false;
  for (std::uint8_t sub = 0; sub <= most_subs; ++sub)
    for (const auto object : {canopen::communication_object(wanted.direction, wanted.number, sub),
                              canopen::mapping_object(wanted.direction, wanted.number, sub)})
      saved = saved || configuration_.is_saved(object.key());
  std::function<Result<void>(std::uint64_t)> permit;
  if (saved) permit = [this](std::uint64_t writes) { return permit_saves(writes); };
  auto outcome = co_await canopen::configure_pdo(node_, std::move(wanted), patiently(), std::move(permit));
  for (const auto object : outcome.written)
    if (configuration_.is_saved(object.key())) count_save(1);
  co_return outcome;
}

/// Group starts come by another one, with a SYNC (M24). Whether its type counts is proven later.
Task<> Cia402Drive::set_start_pdo() {
  const bool has_sync = bus_->settings().sync_period > Duration{};
  start_pdo_.refuse(has_sync ? "it is not configured yet" : "the network has no SYNC (sync_period is 0)");
  if (!has_sync) co_return;
  const canopen::PdoSettings wanted{.direction = PdoDirection::receive,
                                    .number = start_number,
                                    .cob_id = canopen::rpdo_id(start_number, node_.id()),
                                    .transmission_type = with_each_sync,
                                    .mapping = control_alone()};
  const auto outcome = co_await set_pdo(wanted);
  auto why = objection(outcome, wanted);
  if (why.empty() && !is_start_pdo(start_number, outcome.state))
    why = fmt::format("RPDO {} has the identifier {:03X}h", start_number, outcome.state.cob_id());
  why.empty() ? start_pdo_.configure(outcome.state.cob_id()) : start_pdo_.refuse(std::move(why));
}

bool Cia402Drive::is_start_pdo(std::uint16_t number, const canopen::PdoState& state) const {
  return number == start_number && state.enabled() && state.mapping == control_alone() &&
         state.cob_id() == canopen::rpdo_id(start_number, node_.id()) &&
         state.transmission_type == with_each_sync;
}

/// The text: why there are none. Errors: the node is gone.
Task<Result<std::string>> Cia402Drive::set_state_pdos() {
  const bool synchronous = bus_->settings().sync_period > Duration{};
  const auto bitrate = bus_->settings().bitrate;
  constexpr auto inhibit_unit = std::chrono::microseconds(100);  // 6.1.2 gives none; CiA 301 does
  auto layout = state_layout(*model_);
  std::vector<std::uint32_t> ids;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    canopen::PdoSettings wanted{
        .direction = PdoDirection::transmit,
        .number = static_cast<std::uint16_t>(i + 1),
        .cob_id = canopen::tpdo_id(static_cast<unsigned>(i + 1), node_.id()),
        .transmission_type = synchronous ? std::uint8_t{1} : canopen::event_driven_of_profile,
        .mapping = layout[i]};
    if (!synchronous) {
      // A drive whose position changes all the time must not flood the network (M24).
      wanted.inhibit_time = static_cast<std::uint16_t>(scaled(inhibit_period, bitrate) / inhibit_unit);
      wanted.event_timer = static_cast<std::uint16_t>(scaled(event_period, bitrate) / milliseconds(1));
    }
    auto outcome = co_await set_pdo(wanted);
    const bool gone = outcome.error && outcome.error->outcome != Outcome::refused &&
                      outcome.error->reason != Reason::invalid_argument &&
                      outcome.error->reason != Reason::eeprom_budget;
    if (gone) co_return failed(*outcome.error);
    if (auto why = objection(outcome, wanted); !why.empty()) co_return why;
    ids.push_back(outcome.state.cob_id());
  }
  if (state_link_.listen(*model_, std::move(layout), ids, synchronous)) co_return std::string();
  co_return std::string("a TPDO has the identifier of another node's");
}

std::unique_ptr<Drive> make_drive(const Model& model, DriveContext context) {
  return std::make_unique<Cia402Drive>(model, std::move(context));
}

}  // namespace axisd::cia402
