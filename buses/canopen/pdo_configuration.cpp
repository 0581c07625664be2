#include "buses/canopen/pdo_configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/canopen/sdo_abort.hpp"

namespace axisd::canopen {

namespace {

constexpr std::uint8_t sub_cob_id = 1, sub_type = 2, sub_inhibit = 3, sub_event = 5;
constexpr std::uint8_t most_entries = 64;

/// One run of the procedure. Steps give false where it cannot go on; `outcome_.error` says why.
class Configuration {
 public:
  using Permit = std::function<Result<void>(std::uint64_t writes)>;

  Configuration(RemoteNode node, PdoSettings wanted, SdoOptions options, Permit permit)
      : node_(node), wanted_(std::move(wanted)), options_(std::move(options)), permit_(std::move(permit)) {
    outcome_.direction = wanted_.direction;
    outcome_.number = wanted_.number;
  }

  Task<PdoOutcome> run() {
    if (auto error = objection()) {
      outcome_.error = std::move(error);
      co_return outcome_;
    }
    if (!co_await read_state()) co_return outcome_;
    if (differences(outcome_.state, wanted_).empty()) {
      outcome_.kind = PdoOutcome::Kind::as_found;
      co_return outcome_;
    }
    if (const auto permitted = permit_ ? permit_(most_writes()) : Result<void>{}; !permitted) {
      outcome_.error = permitted.error();
      co_return outcome_;
    }
    before_ = outcome_.state;
    const bool written = co_await write_all();
    const auto refused = std::exchange(outcome_.error, std::nullopt);
    if (!written && refused && refused->outcome != Outcome::refused) {  // the node or the link is gone
      outcome_.error = refused;
      co_return outcome_;
    }
    if (!co_await read_state()) co_return outcome_;
    outcome_.remarks = differences(outcome_.state, wanted_);
    outcome_.error = refused;
    outcome_.kind = !written                   ? PdoOutcome::Kind::failed
                    : outcome_.remarks.empty() ? PdoOutcome::Kind::changed
                                               : PdoOutcome::Kind::deviates;
    co_return outcome_;
  }

 private:
  [[nodiscard]] Object communication(std::uint8_t sub) const {
    return communication_object(wanted_.direction, wanted_.number, sub);
  }
  [[nodiscard]] Object mapping(std::uint8_t sub) const {
    return mapping_object(wanted_.direction, wanted_.number, sub);
  }

  /// Of write_all().
  [[nodiscard]] std::uint64_t most_writes() const {
    constexpr std::uint64_t off_and_on = 2, count_twice = 2, times = 3;
    return off_and_on + count_twice + wanted_.mapping.size() + times;
  }

  [[nodiscard]] std::optional<Error> objection() const {
    constexpr std::uint16_t most_pdos = 512;
    constexpr std::uint32_t highest_id = 0x7FF;
    if (wanted_.number == 0 || wanted_.number > most_pdos)
      return Error{.reason = Reason::invalid_argument,
                   .message = fmt::format("{} does not exist", name_of(wanted_.direction, wanted_.number)),
                   .remedy = "use 1 to 512"};
    if (wanted_.enabled && (wanted_.cob_id == 0 || wanted_.cob_id > highest_id))
      return Error{.reason = Reason::invalid_argument,
                   .message = fmt::format("COB-ID {:X}h for a PDO", wanted_.cob_id),
                   .remedy = "use 11 bits and not 0"};
    if (auto checked = check_mapping(wanted_.mapping); !checked) return checked.error();
    return std::nullopt;
  }

  Task<bool> read_state() {
    auto state = co_await read_pdo(node_, wanted_.direction, wanted_.number, options_);
    if (!state) {
      outcome_.error = std::move(state.error());
      outcome_.kind = PdoOutcome::Kind::failed;
      co_return false;
    }
    outcome_.state = std::move(*state);
    co_return true;
  }

  /// A read-only entry is no failure: what it holds is compared in the end.
  Task<bool> write(Object object, std::uint64_t value, std::size_t size) {
    auto written = co_await node_.write(object, value, size, options_);
    if (written) {
      outcome_.written.push_back(object);
      co_return true;
    }
    if (is_read_only(written.error())) {
      if (std::ranges::find(outcome_.read_only, object) == outcome_.read_only.end())
        outcome_.read_only.push_back(object);
      co_return true;
    }
    outcome_.error = std::move(written.error());
    co_return false;
  }

  Task<bool> write_all() {
    // The identifier must not change while the PDO is on (CiA 301 7.5.2.35): off first with the old one.
    if (before_.enabled() &&
        !co_await write(communication(sub_cob_id), before_.cob_id_entry | PdoState::off_bit, 4))
      co_return false;
    if (!wanted_.enabled) co_return true;
    if (before_.mapping != wanted_.mapping && !co_await write_mapping()) co_return false;
    if (!co_await write_times()) co_return false;
    const auto remote = before_.cob_id_entry & PdoState::no_remote_bit;
    co_return co_await write(communication(sub_cob_id), wanted_.cob_id | remote, 4);
  }

  Task<bool> write_mapping() {
    if (!co_await write(mapping(0), 0, 1)) co_return false;
    for (std::size_t i = 0; i < wanted_.mapping.size(); ++i) {
      const auto entry = mapping(static_cast<std::uint8_t>(i + 1));
      // Entries beyond the count may hold anything, so each is looked at, not only those that counted.
      const auto found = co_await node_.read_if_there(entry, options_);
      if (!found) {
        outcome_.error = found.error();
        co_return false;
      }
      if (*found == wanted_.mapping[i].raw()) continue;
      if (!co_await write(entry, wanted_.mapping[i].raw(), 4)) co_return false;
    }
    co_return co_await write(mapping(0), wanted_.mapping.size(), 1);
  }

  Task<bool> write_times() {
    if (before_.transmission_type != wanted_.transmission_type &&
        !co_await write(communication(sub_type), wanted_.transmission_type, 1))
      co_return false;
    // Where the node lacks the entry there is nothing to write; the comparison says so.
    if (wanted_.inhibit_time && before_.inhibit_time && before_.inhibit_time != wanted_.inhibit_time &&
        !co_await write(communication(sub_inhibit), *wanted_.inhibit_time, 2))
      co_return false;
    if (wanted_.event_timer && before_.event_timer && before_.event_timer != wanted_.event_timer &&
        !co_await write(communication(sub_event), *wanted_.event_timer, 2))
      co_return false;
    co_return true;
  }

  RemoteNode node_;
  PdoSettings wanted_;
  SdoOptions options_;
  Permit permit_;
  PdoOutcome outcome_;
  PdoState before_;
};

template <class T>
std::optional<T> narrowed(const std::optional<std::uint64_t>& value) {
  return value ? std::optional(static_cast<T>(*value)) : std::nullopt;
}

}  // namespace

Task<Result<PdoState>> read_pdo(RemoteNode node, PdoDirection direction, std::uint16_t number,
                                SdoOptions options) {
  PdoState state;
  const auto cob_id = co_await node.read(communication_object(direction, number, sub_cob_id), options);
  if (!cob_id) co_return fail(cob_id.error());
  state.cob_id_entry = static_cast<std::uint32_t>(*cob_id);
  const auto type = co_await node.read_if_there(communication_object(direction, number, sub_type), options);
  if (!type) co_return fail(type.error());
  state.transmission_type = narrowed<std::uint8_t>(*type);
  const auto inhibit =
      co_await node.read_if_there(communication_object(direction, number, sub_inhibit), options);
  if (!inhibit) co_return fail(inhibit.error());
  state.inhibit_time = narrowed<std::uint16_t>(*inhibit);
  const auto event = co_await node.read_if_there(communication_object(direction, number, sub_event), options);
  if (!event) co_return fail(event.error());
  state.event_timer = narrowed<std::uint16_t>(*event);
  const auto count = co_await node.read(mapping_object(direction, number, 0), options);
  if (!count) co_return fail(count.error());
  // More than 64 are no count: 254 and 255 say that values are mapped in the manner of an MPDO.
  if (*count > most_entries) co_return state;
  for (unsigned sub = 1; sub <= *count; ++sub) {
    const auto entry =
        co_await node.read(mapping_object(direction, number, static_cast<std::uint8_t>(sub)), options);
    if (!entry) co_return fail(entry.error());
    state.mapping.push_back(MappedObject::of(static_cast<std::uint32_t>(*entry)));
  }
  co_return state;
}

Task<PdoOutcome> configure_pdo(RemoteNode node, PdoSettings wanted, SdoOptions options,
                               std::function<Result<void>(std::uint64_t writes)> permit) {
  Configuration configuration(node, std::move(wanted), std::move(options), std::move(permit));
  co_return co_await configuration.run();
}

Task<std::vector<PdoOutcome>> configure_pdos(RemoteNode node, std::vector<PdoSettings> wanted,
                                             SdoOptions options) {
  std::vector<PdoOutcome> outcomes;
  std::optional<Error> lost;
  for (const auto& settings : wanted) {
    PdoOutcome outcome{.direction = settings.direction, .number = settings.number, .error = lost};
    if (!lost) outcome = co_await configure_pdo(node, settings, options);
    if (outcome.error && outcome.error->outcome != Outcome::refused &&
        outcome.error->reason != Reason::invalid_argument)
      lost = outcome.error;
    outcomes.push_back(std::move(outcome));
  }
  co_return outcomes;
}

}  // namespace axisd::canopen
