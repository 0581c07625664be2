#include "daemon/core/bus_access_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/modbus_rtu/node.hpp"
#include "devices/rtu_identification.hpp"

namespace axisd::core {

namespace {

constexpr int longest_quiet = 16;  // probes without a report
constexpr int garbled_attempts = 3;
constexpr int last_address = 247;  // Modbus over serial line 2.2
constexpr int slowest = 1200, fastest = 1'000'000;
constexpr Duration longest_reply = std::chrono::seconds(1);

std::unexpected<Error> invalid(std::string message, std::string remedy) {
  return fail(Reason::invalid_argument, std::move(message), std::move(remedy));
}

/// All combinations without doubles; the bus's own settings first, because they disturb nobody.
std::vector<modbus_rtu::SerialSettings> combinations(const ScanRequest& request,
                                                     const modbus_rtu::SerialSettings& own) {
  const auto bauds = request.bauds.empty() ? std::vector{own.baud} : request.bauds;
  const auto formats = request.formats.empty() ? std::vector{own.format} : request.formats;
  std::vector<modbus_rtu::SerialSettings> all;
  for (const auto baud : bauds) {
    for (const auto& format : formats) {
      const modbus_rtu::SerialSettings one{.baud = baud, .format = format};
      if (std::ranges::find(all, one) == all.end()) all.insert(one == own ? all.begin() : all.end(), one);
    }
  }
  return all;
}

}  // namespace

BusScan::BusScan(const MachineCore& machine, modbus_rtu::RtuBus& bus, ScanRequest request,
                 std::weak_ptr<void> wanted)
    : machine_(&machine),
      bus_(&bus),
      request_(std::move(request)),
      wanted_(std::move(wanted)),
      serials_(combinations(request_, bus.settings().serial())),
      nodes_(request_.last_node - request_.first_node + 1) {}

Result<void> BusScan::check() const {
  if (request_.first_node < 1 || request_.last_node > last_address ||
      request_.first_node > request_.last_node)
    return invalid(fmt::format("nodes {} to {} cannot be scanned", request_.first_node, request_.last_node),
                   fmt::format("choose a range within 1 to {}", last_address));
  for (const auto& serial : serials_)
    if (serial.baud < slowest || serial.baud > fastest)
      return invalid(fmt::format("{} baud is no rate of an RS-485 line", serial.baud),
                     fmt::format("choose rates from {} to {}", slowest, fastest));
  if (request_.reply_timeout < Duration{} || request_.reply_timeout > longest_reply)
    return invalid("the reply timeout is out of range", "choose at most 1 s, or leave it out");
  for (const auto& serial : serials_)
    if (const auto quiet = check_quiet(serial); !quiet) return quiet;
  return {};
}

/// Frames in another rate are noise to the drives of the line: only while none of them is energised or moves.
Result<void> BusScan::check_quiet(const modbus_rtu::SerialSettings& serial) const {
  const auto& bus = bus_->settings();
  if (serial == bus.serial()) return {};
  for (const auto& axis : machine_->axes()) {
    if (axis->settings().bus != bus.name) continue;
    const auto state = axis->snapshot();
    const bool moves = !axis->at_rest() || (state->link != LinkState::offline && state->moving);
    const bool energised = state->link != LinkState::offline && state->enabled;
    if (!moves && !energised) continue;
    Error error{
        .reason = moves ? Reason::moving : Reason::fault,
        .message = fmt::format("{} cannot be searched at {} while axis '{}' {}", bus.name, to_string(serial),
                               axis->settings().name, moves ? "moves" : "is enabled"),
        .remedy = "disable the axes of this bus, or scan with its own settings",
        .where = {.bus = bus.name, .node = axis->settings().node}};
    return fail(std::move(error));
  }
  return {};
}

BusScan::Probe BusScan::probe_at(int index) const {
  return {.node = static_cast<std::uint8_t>(request_.first_node + index % nodes_),
          .serial = serials_.at(static_cast<std::size_t>(index / nodes_))};
}

TransactionOptions BusScan::options(const Probe& probe) const {
  TransactionOptions options{
      .transaction_class = TransactionClass::scan, .of_others = true, .serial = probe.serial};
  // Waiting long for silent nodes blinds the line: only while nothing on it moves.
  const bool rests = std::ranges::all_of(machine_->axes(), [&](const auto& axis) {
    return axis->settings().bus != bus_->settings().name || axis->at_rest();
  });
  if (request_.reply_timeout > Duration{})
    options.turnaround_max =
        rests ? request_.reply_timeout : std::min(request_.reply_timeout, bus_->settings().turnaround_max);
  return options;
}

Task<Result<ScanProgress>> BusScan::next() {
  if (probed_ == 0)
    if (const auto checked = check(); !checked) co_return fail(checked.error());
  ScanProgress progress{.total = nodes_ * static_cast<int>(serials_.size())};
  for (int quiet = 0; probed_ < progress.total && quiet < longest_quiet && progress.found.empty(); ++quiet) {
    if (wanted_.expired()) break;
    auto found = co_await look(probe_at(probed_));
    if (!found) co_return fail(found.error());
    ++probed_;
    if (*found) progress.found.push_back(std::move(**found));
  }
  progress.probed = probed_;
  progress.finished = probed_ == progress.total;
  co_return progress;
}

/// Reads one after the other what may show its model. Who does not answer the first is not there.
Task<Result<std::optional<FoundNode>>> BusScan::look(Probe probe) {
  FoundNode found{.node = probe.node, .baud = probe.serial.baud, .format = probe.serial.format};
  bool is_there = false;
  for (const auto read : rtu_identity_reads()) {
    const auto heard = co_await ask(probe, read);
    if (!heard) co_return fail(heard.error());
    is_there = is_there || heard->answered || heard->garbled;
    if (heard->garbled)
      found.note = "garbled replies: two nodes on one address? Else check wiring and termination";
    if (!heard->answered) break;
    if (heard->registers.empty()) continue;  // it has none of these registers
    if (found.model_code == 0) found.model_code = heard->registers.front();
    const auto identified = co_await identify(probe, read, heard->registers, found);
    if (!identified) co_return fail(identified.error());
    if (*identified) break;
  }
  if (!is_there) co_return std::nullopt;
  found.configured_as = configured_as(*machine_, bus_->settings().name, probe.node);
  co_return found;
}

/// One read; repeated while damaged bytes come back.
Task<Result<BusScan::Heard>> BusScan::ask(Probe probe, RtuRead read) {
  const modbus_rtu::Request request{.node = probe.node, .address = read.address, .count = read.count};
  Heard heard;
  for (int attempt = 0; attempt < garbled_attempts; ++attempt) {
    if (const auto quiet = check_quiet(probe.serial); !quiet) co_return fail(quiet.error());
    auto answer = co_await bus_->transact(request, options(probe));
    if (answer) {
      heard.answered = true;
      heard.registers = std::move(answer->registers);
      co_return heard;
    }
    const auto reason = answer.error().reason;
    if (reason == Reason::superseded)
      co_return fail({.reason = Reason::moving,
                      .message = "the scan ends: an axis of this bus is being enabled",
                      .remedy = "scan again while the axes of this bus are disabled",
                      .where = answer.error().where});
    if (reason == Reason::refused) {
      heard.answered = true;
      co_return heard;
    }
    if (reason != Reason::no_reply) co_return fail(std::move(answer.error()));
    if (bus_->garbled(probe.node) == 0) break;  // silence
    heard.garbled = true;
  }
  co_return heard;
}

/// Names the model and its setting, as far as both can be told by `registers`, the answer to `read`. False:
/// another read may show more.
Task<Result<bool>> BusScan::identify(Probe probe, RtuRead read, std::vector<std::uint16_t> registers,
                                     FoundNode& found) {
  if (const auto quiet = check_quiet(probe.serial); !quiet) co_return fail(quiet.error());
  const auto models = rtu_models_with_code(read, registers);
  if (models.empty()) co_return false;
  const auto tell = [&](const RtuIdentification& by) {
    found.model_code = registers.at(by.code_at);
    found.version = by.version != nullptr ? by.version(registers) : std::string();
  };
  const auto model = co_await find_fitting_model(modbus_rtu::Node(*bus_, probe.node), models, options(probe));
  if (!model && model.error().reason == Reason::no_reply) {
    if (found.note.empty()) found.note = "it did not answer all reads: its model is not certain";
    tell(models.front()->identification);
    co_return true;
  }
  if (!model) co_return fail(model.error());
  if (*model == nullptr) co_return false;
  const auto& identification = (*model)->identification;
  found.model = (*model)->model;
  tell(identification);
  if (!identification.microstep_register) co_return true;
  const auto microstep = co_await ask(probe, {.address = *identification.microstep_register});
  if (!microstep) co_return fail(microstep.error());
  const auto& codes = identification.microstep_codes;
  if (!microstep->registers.empty() && microstep->registers[0] < codes.size())
    found.pulses_per_revolution = codes[microstep->registers[0]];
  co_return true;
}

std::string configured_as(const MachineCore& machine, const std::string& bus, std::uint8_t node) {
  const auto is_it = [&](const auto& one) {
    return one->settings().bus == bus && one->settings().node == node;
  };
  if (const auto axis = std::ranges::find_if(machine.axes(), is_it); axis != machine.axes().end())
    return (*axis)->settings().name;
  const auto device = std::ranges::find_if(machine.devices(), is_it);
  return device == machine.devices().end() ? std::string() : (*device)->settings().name;
}

}  // namespace axisd::core
