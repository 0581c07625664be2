#include "daemon/core/bus_access_network_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/can_identification.hpp"

namespace axisd::core {

namespace {

/// Nodes that are asked at once: their frames take 5 ms at 1 Mbit/s, a tenth of the shortest poll of a drive.
constexpr int at_once = 16;
constexpr canopen::Object device_type{0x1000, 0};

}  // namespace

/// What was asked at once.
struct NetworkScan::Batch {
  Batch(const Executor& executor, Clock& clock) : ended(executor, clock) {}
  int waiting = 0;
  std::vector<FoundNode> found;
  std::optional<Error> error;
  Signal ended;
};

NetworkScan::NetworkScan(Executor executor, Clock& clock, const MachineCore& machine,
                         canopen::CanopenBus& bus, ScanRequest request, std::weak_ptr<void> wanted)
    : executor_(std::move(executor)),
      clock_(&clock),
      machine_(&machine),
      bus_(&bus),
      request_(std::move(request)),
      wanted_(std::move(wanted)) {}

Result<void> NetworkScan::check() const {
  if (request_.first_node < 1 || request_.last_node > canopen::highest_node ||
      request_.first_node > request_.last_node)
    return fail(Reason::invalid_argument,
                fmt::format("nodes {} to {} cannot be scanned", request_.first_node, request_.last_node),
                fmt::format("choose a range within 1 to {}", canopen::highest_node));
  if (!request_.formats.empty())
    return fail(Reason::invalid_argument, fmt::format("{} is a CAN network: it has no format", bus_->name()),
                "leave the formats out");
  const auto own = static_cast<int>(bus_->settings().bitrate);
  if (std::ranges::any_of(request_.bauds, [own](int rate) { return rate != own; }))
    return fail(Reason::not_supported,
                fmt::format("{} runs at {} bit/s, and axisd does not change the bit rate of an interface",
                            bus_->name(), own),
                "set the interface to the other rate, say so in the configuration, then scan");
  if (const auto& link = bus_->link(); !link.can_send())
    return fail(link.error.value_or(Error{.reason = Reason::bus_down,
                                          .message = "the interface is not open yet",
                                          .remedy = "try again",
                                          .where = {.bus = bus_->name()}}));
  return {};
}

canopen::SdoOptions NetworkScan::options() const {
  canopen::SdoOptions options{.transaction_class = TransactionClass::scan};
  if (request_.reply_timeout > Duration{}) options.timeout = request_.reply_timeout;
  return options;
}

Task<Result<ScanProgress>> NetworkScan::next() {
  if (probed_ == 0)
    if (const auto checked = check(); !checked) co_return fail(checked.error());
  ScanProgress progress{.total = request_.last_node - request_.first_node + 1};
  Batch batch(executor_, *clock_);
  if (!wanted_.expired()) batch.waiting = std::min(at_once, progress.total - probed_);
  for (int left = batch.waiting; left > 0; --left) {
    const auto node = static_cast<std::uint8_t>(request_.first_node + probed_++);
    spawn(executor_, ask(node, batch), fmt::format("scan {}", node));
  }
  while (batch.waiting > 0) co_await batch.ended.wait();  // it is theirs until all have ended
  if (batch.error) co_return fail(std::move(*batch.error));
  std::ranges::sort(batch.found, {}, &FoundNode::node);
  progress.found = std::move(batch.found);
  progress.probed = probed_;
  progress.finished = probed_ == progress.total;
  co_return progress;
}

Task<> NetworkScan::ask(std::uint8_t node, Batch& batch) const {
  auto result = co_await look(node);
  if (!result) {
    if (!batch.error) batch.error = std::move(result.error());
  } else if (*result) {
    batch.found.push_back(std::move(**result));
  }
  if (--batch.waiting == 0) batch.ended.notify_all();
}

Task<Result<std::optional<FoundNode>>> NetworkScan::look(std::uint8_t id) const {
  const auto node = bus_->master().node(id);
  auto once = options();
  once.attempts = 1;  // most node-IDs are silent
  const auto answer = co_await node.read(device_type, std::move(once));
  FoundNode found{.node = id,
                  .on_network = true,
                  .baud = static_cast<int>(bus_->settings().bitrate),
                  .configured_as = configured_as(*machine_, bus_->name(), id)};
  if (answer) {
    co_await identify(node, found);
    co_return found;
  }
  const auto& error = answer.error();
  if (error.outcome == Outcome::refused) {
    found.note = "it has no device type (1000h), which CiA 301 demands";
    co_return found;
  }
  if (error.reason != Reason::no_reply && error.reason != Reason::rebooted) co_return fail(error);
  if (error.reason == Reason::rebooted) {
    found.note = "it booted meanwhile: scan again";
    co_return found;
  }
  if (!bus_->master().foreign_nodes().contains(id)) co_return std::nullopt;
  found.note = "it sends, but answers no SDO: stopped, or of another kind";
  co_return found;
}

/// Object 1008h: what its maker calls it, for the search for its data sheet; empty: it does not say.
Task<std::string> NetworkScan::device_name(canopen::RemoteNode node) const {
  constexpr canopen::Object manufacturer_device_name{0x1008, 0};
  constexpr std::size_t longest = 64;
  auto once = options();
  once.upload_limit = longest;
  const auto answer = co_await node.sdo().upload(node.id(), manufacturer_device_name, std::move(once));
  std::string name;
  for (const auto byte : answer ? answer->bytes : canopen::Bytes{})
    if (byte >= 0x20 && byte < 0x7F) name += static_cast<char>(byte);
  co_return name;
}

/// Names the model and its setting, as far as both can be told.
Task<void> NetworkScan::identify(canopen::RemoteNode node, FoundNode& found) const {
  const auto identity = co_await canopen::read_identity(node, options());
  if (!identity) {
    found.note = "it did not answer all reads: its model is not certain";
    co_return;
  }
  found.identity = *identity;
  const auto* model = find_can_model(*identity);
  if (model == nullptr) co_return;
  found.model = model->model;
  if (!model->can_identification) {
    found.note = co_await device_name(node);
    co_return;
  }
  const auto& known = *model->can_identification;
  if (known.microstep_object == 0) co_return;
  const canopen::Object microstep{static_cast<std::uint16_t>(known.microstep_object >> 8U),
                                  static_cast<std::uint8_t>(known.microstep_object & 0xFFU)};
  const auto code = co_await node.read(microstep, options());
  if (code && *code < known.microstep_codes.size())
    found.pulses_per_revolution = known.microstep_codes[static_cast<std::size_t>(*code)];
}

}  // namespace axisd::core
