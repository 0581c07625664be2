// What waits in the drive for a SYNC is thrown away before SYNC may run (M24); and its NMT state.
#include <utility>

#include "buses/canopen/cob.hpp"
#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

using canopen::CanopenBus;
using canopen::PdoDirection;
using std::chrono::milliseconds;

/// For a node to follow an NMT command that it does not confirm (it may have no heartbeat).
constexpr auto nmt_patience = milliseconds(50);
/// Two heartbeats, where it has one.
constexpr auto heartbeat_limit = milliseconds(500);

/// Of an RPDO.
canopen::Object transmission_type(std::uint16_t number) {
  constexpr std::uint8_t sub_type = 2;
  return canopen::communication_object(PdoDirection::receive, number, sub_type);
}

}  // namespace

/// Another master, or an earlier program, may have armed it; and so may a common start that was given up.
Task<Result<void>> Cia402Drive::settle(SdoOptions options) {
  while (start_pdo_.work() != StartPdo::Work::none) co_await news_.wait_until(clock_->now() + nmt_patience);
  if (contact_.is_settled() && !bus_->armed(node_.id())) co_return Result<void>{};
  start_pdo_.begin(StartPdo::Work::settling);
  auto disarmed = co_await disarm(std::move(options));
  start_pdo_.end_work();
  news_.notify_all();
  if (!disarmed) co_return disarmed;
  contact_.settle();
  bus_->set_readiness(node_.id(), CanopenBus::Readiness::settled);
  co_return Result<void>{};
}

/// What may wait in one RPDO is overwritten.
Task<Result<Cia402Drive::Waits>> Cia402Drive::disarm_pdo(std::uint16_t number, SdoOptions options) {
  const auto type = co_await node_.read_if_there(transmission_type(number), options);
  if (!type) co_return failed(type.error());
  if (!*type || **type >= canopen::event_driven_of_manufacturer) co_return Waits::nothing;
  const auto state = co_await canopen::read_pdo(node_, PdoDirection::receive, number, options);
  if (!state) co_return failed(state.error());
  const bool ours = bus_->settings().sync_period > Duration{} && is_start_pdo(number, *state);
  const bool in_use = ours && start_pdo_.id();
  if (in_use && !bus_->armed(node_.id())) co_return Waits::nothing;
  const bool keeps_type = ours && start_pdo_.state() != StartPdo::State::disproven;
  const auto overwritten = co_await overwrite_waiting(number, *state, std::move(options));
  if (!overwritten) co_return fail(overwritten.error());
  co_return keeps_type ? Waits::overwritten : Waits::until_retyped;
}

/// What an RPDO has received already waits in the drive whatever its type becomes, or is applied by the very
/// change: it is gone where there are no PDOs, in Pre-Operational. Where it outlives even that, it asks for
/// nothing new. The RPDO of group starts keeps its type (some drives save it), and holds nothing that this
/// program did not send.
Task<Result<void>> Cia402Drive::disarm(SdoOptions options) {
  constexpr std::uint16_t pdos = 4;
  std::vector<Object> armed;
  bool any = false;
  for (std::uint16_t number = 1; number <= pdos; ++number) {
    const auto waits = co_await disarm_pdo(number, options);
    if (!waits) co_return fail(waits.error());
    any = any || *waits != Waits::nothing;
    if (*waits == Waits::until_retyped) armed.push_back(transmission_type(number));
  }
  if (!any) co_return Result<void>{};
  if (const auto left = co_await leave_operational(true); !left) co_return left;
  Result<void> written;
  for (const auto object : armed) {
    if (!written) break;
    // Counted, but not asked for: what is armed may move at the next SYNC.
    written = co_await write_object(object, canopen::event_driven_of_profile, 1, options);
    const bool executed = written || written.error().outcome == Outcome::unknown;
    if (executed && configuration_.is_saved(object.key())) count_save(1);
  }
  // Whatever came of it: its state comes by PDO.
  const auto started = co_await enter_operational();
  co_return written ? started : written;
}

/// By what stands in the drive already. An identifier that other nodes may listen to is left alone. A
/// set-point or a reset that was taken stands there, too, and would be a new one behind a stop.
Task<Result<void>> Cia402Drive::overwrite_waiting(std::uint16_t number, canopen::PdoState state,
                                                  SdoOptions options) {
  if (!state.enabled() || state.cob_id() != canopen::rpdo_id(number, node_.id())) co_return Result<void>{};
  std::vector<std::uint64_t> values;
  for (const auto& mapped : state.mapping) {
    const auto value = co_await node_.read(mapped.object, options);
    if (!value && value.error().outcome != Outcome::refused) co_return failed(value.error());
    auto standing = value.value_or(0);
    if (mapped.object == object::control_word)
      standing &= ~std::uint64_t{control::start | control::fault_reset};
    values.push_back(standing);
  }
  const auto sent = co_await bus_->master().send_pdo(state.cob_id(), canopen::pack_pdo(state.mapping, values),
                                                     {.transaction_class = TransactionClass::motion});
  if (!sent) co_return fail(sent.error());
  co_return Result<void>{};
}

/// A node with a heartbeat says that it followed: `confirmed` waits for that, and tells it once more.
Task<Result<void>> Cia402Drive::leave_operational(bool confirmed) {
  constexpr int attempts = 2;
  const auto state = [this] { return bus_->master().nmt().status(node_.id()).state; };
  const bool tells = confirmed && state() == canopen::NmtState::operational;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    const auto told = co_await bus_->master().command(node_.id(), canopen::NmtCommand::enter_pre_operational);
    if (!told) co_return told;
    const auto until = clock_->now() + (tells ? heartbeat_limit : nmt_patience);
    while (clock_->now() < until && state() != canopen::NmtState::pre_operational)
      co_await news_.wait_until(until);
    if (!tells || state() == canopen::NmtState::pre_operational) co_return Result<void>{};
  }
  co_return fail(error_at(Reason::not_confirmed, object::heartbeat_time,
                          "the node does not say that it left Operational",
                          "check whether another master starts it, and how often its heartbeat comes"));
}

Task<Result<void>> Cia402Drive::enter_operational() {
  const auto started = co_await bus_->master().command(node_.id(), canopen::NmtCommand::start);
  contact_.note_started(started.has_value());
  co_return started;
}

Task<Result<void>> Cia402Drive::start_node() {
  // A node without heartbeat does not say what it is: then it is started once.
  const auto state = bus_->master().nmt().status(node_.id()).state;
  const bool unsaid = state == canopen::NmtState::unknown;
  if (state == canopen::NmtState::operational || (unsaid && contact_.started())) co_return Result<void>{};
  co_return co_await enter_operational();
}

}  // namespace axisd::cia402
