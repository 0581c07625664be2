#include "daemon/core/drive_access_service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "buses/limited_log.hpp"
#include "buses/signal.hpp"
#include "daemon/core/bus_access_network_scan.hpp"
#include "devices/nearest.hpp"

namespace axisd::core {

namespace {

constexpr auto look_again = std::chrono::milliseconds(500);

/// Holds what the sequence needs until it has ended; the axis is not exchanged meanwhile.
template <class T>
Task<> answer(DriveOperations operations, std::shared_ptr<void> /*in_use*/,
              std::function<Task<Result<T>>(const DriveOperations&)> operation,
              std::function<void(Result<T>)> callback) {
  callback(co_await operation(operations));
}

template <class T>
Task<Result<T>> refused(Error error) {
  co_return fail(std::move(error));
}

std::optional<std::int64_t> value_of(const std::vector<ParameterValue>& values, std::uint32_t address) {
  const auto found = std::ranges::find(values, address, &ParameterValue::address);
  return found == values.end() ? std::nullopt : std::optional(found->value);
}

std::string text_of(const SerialChange& change) {
  std::string text = "changes";
  if (change.node) text += fmt::format(" the address to {}", *change.node);
  if (change.baud) text += fmt::format("{} the rate to {} bit/s", change.node ? "," : "", *change.baud);
  if (change.format)
    text +=
        fmt::format("{} the format to {}", change.node || change.baud ? "," : "", to_string(*change.format));
  return text;
}

}  // namespace

template <class T>
void DriveAccessService::run(std::string axis,
                             std::function<Task<Result<T>>(const DriveOperations&)> operation,
                             std::function<void(Result<T>)> callback, const char* name) {
  post(executor_, [this, axis = std::move(axis), operation = std::move(operation),
                   callback = std::move(callback), name]() mutable {
    auto* found = machine_->find(axis);
    if (found == nullptr) return callback(fail(no_such_axis(axis, machine_->table()->axes)));
    auto use = found->use();
    if (!use) return callback(fail(use.error()));
    machine_->launch(
        answer<T>(DriveOperations(*found), *std::move(use), std::move(operation), std::move(callback)), name);
  });
}

template <class T>
void DriveAccessService::run_leased(std::string axis, Requester requester,
                                    std::function<Task<Result<T>>(const DriveOperations&)> operation,
                                    std::function<void(Result<T>)> callback, const char* name) {
  auto guarded = [this, axis, requester = std::move(requester),
                  operation = std::move(operation)](const DriveOperations& drive) {
    const auto allowed = machine_->find(axis)->check_lease(requester);
    return allowed ? operation(drive) : refused<T>(allowed.error());
  };
  run<T>(std::move(axis), std::move(guarded), std::move(callback), name);
}

template <class T>
void DriveAccessService::run_at_rest(std::string axis, Requester requester,
                                     std::function<Task<Result<T>>(const DriveOperations&)> operation,
                                     std::function<void(Result<T>)> callback, const char* name) {
  auto guarded = [this, axis, operation = std::move(operation)](const DriveOperations& drive) {
    const auto rests = check_bus_rests(*machine_->find(axis));
    return rests ? operation(drive) : refused<T>(rests.error());
  };
  run_leased<T>(std::move(axis), std::move(requester), std::move(guarded), std::move(callback), name);
}

Result<void> DriveAccessService::check_bus_rests(const Axis& axis) const {
  if (machine_->find_network(axis.settings().bus) != nullptr) return {};  // each node has a queue of its own
  for (const auto& other : machine_->axes())
    if (other->settings().bus == axis.settings().bus && !other->at_rest())
      return fail(
          {.reason = Reason::moving,
           .message = fmt::format("axis '{}' of the same bus moves: a drive that saves may be silent for "
                                  "seconds, and its line with it",
                                  other->settings().name),
           .remedy = "wait for standstill",
           .where = {.bus = axis.settings().bus, .node = axis.settings().node}});
  return {};
}

void DriveAccessService::drive_info(std::string axis, std::function<void(Result<DriveInfo>)> callback) {
  post(executor_, [this, axis = std::move(axis), callback = std::move(callback)] {
    auto* found = machine_->find(axis);
    if (found == nullptr) return callback(fail(no_such_axis(axis, machine_->table()->axes)));
    callback(DriveOperations(*found).info());
  });
}

void DriveAccessService::read_parameters(std::string axis, std::vector<std::uint32_t> addresses,
                                         ValuesCallback callback) {
  run<std::vector<ParameterValue>>(
      std::move(axis),
      [addresses = std::move(addresses)](const DriveOperations& drive) {
        return drive.read_parameters(addresses);
      },
      std::move(callback), "read parameters");
}

void DriveAccessService::write_parameters(std::string axis, std::vector<ParameterValue> values,
                                          Requester requester, ValuesCallback callback) {
  auto call = begin("WriteParameters", axis, requester, fmt::format("writes {} parameters", values.size()));
  for (const auto& value : values)
    call->parameters.push_back({.address = value.address, .asked = value.value});
  const auto before = std::make_shared<std::vector<ParameterValue>>();
  auto told = [call, before, callback = audited<std::vector<ParameterValue>>(call, std::move(callback))](
                  Result<std::vector<ParameterValue>> result) {
    for (auto& parameter : call->parameters) {
      parameter.before = value_of(*before, parameter.address);
      if (result) parameter.after = value_of(*result, parameter.address);
    }
    callback(std::move(result));
  };
  run_leased<std::vector<ParameterValue>>(
      std::move(axis), std::move(requester),
      [values = std::move(values), before, machine = machine_](const DriveOperations& drive) {
        return drive.write_parameters(values, machine->audit().kept() ? before.get() : nullptr);
      },
      std::move(told), "write parameters");
}

void DriveAccessService::save_parameters(std::string axis, Requester requester,
                                         std::function<void(Result<void>)> callback) {
  auto told = audited<void>(begin("SaveParameters", axis, requester, "saves all parameters to the EEPROM"),
                            std::move(callback));
  run_at_rest<void>(
      std::move(axis), std::move(requester),
      [](const DriveOperations& drive) { return drive.save_parameters(); }, std::move(told),
      "save parameters");
}

void DriveAccessService::restore_factory(std::string axis, Requester requester,
                                         std::function<void(Result<std::string>)> callback) {
  auto told = audited<std::string>(begin("RestoreFactory", axis, requester, "restores the factory settings"),
                                   std::move(callback));
  auto restore = [this, axis](const DriveOperations& drive) {
    return drive.restore_factory(others_on_bus(*machine_->find(axis)));
  };
  run_at_rest<std::string>(std::move(axis), std::move(requester), std::move(restore), std::move(told),
                           "restore factory settings");
}

void DriveAccessService::read_segments(std::string axis, SegmentsCallback callback) {
  run<SegmentSettings>(
      std::move(axis), [](const DriveOperations& drive) { return drive.read_segments(); },
      std::move(callback), "read segments");
}

void DriveAccessService::write_segments(std::string axis, SegmentSettings segments, Requester requester,
                                        SegmentsCallback callback) {
  auto told = audited<SegmentSettings>(begin("WriteSegments", axis, requester, "writes the segment table"),
                                       std::move(callback));
  run_leased<SegmentSettings>(
      std::move(axis), std::move(requester),
      [segments = std::move(segments)](const DriveOperations& drive) {
        return drive.write_segments(segments);
      },
      std::move(told), "write segments");
}

std::shared_ptr<void> DriveAccessService::change_serial(std::string axis, SerialChange change,
                                                        Requester requester, SerialCallback callback) {
  auto token = std::make_shared<int>(0);
  auto call = begin(change.node ? "Readdress" : "SetSerial", axis, requester, text_of(change));
  post(executor_, [this, call] { machine_->audit().call(*call); });
  // What is written counts; whether the drive is found there later, and whether somebody still waits for
  // that, is another thing.
  auto told = [this, call, callback = std::move(callback),
               alive = std::weak_ptr<void>(token)](Result<SerialProgress> progress) {
    if (call->phase == AuditedCall::Phase::asked) end(*call, progress ? nullptr : &progress.error());
    if (const auto held = alive.lock()) callback(std::move(progress));
  };
  post(executor_, [this, axis = std::move(axis), requester = std::move(requester), change,
                   callback = SerialCallback(std::move(told)), alive = std::weak_ptr<void>(token)]() mutable {
    auto* found = machine_->find(axis);
    if (found == nullptr) return callback(fail(no_such_axis(axis, machine_->table()->axes)));
    auto use = found->use();
    if (!use) return callback(fail(use.error()));
    machine_->launch(run_serial_change(*found, *std::move(use), std::move(requester), change,
                                       std::move(alive), std::move(callback)),
                     "change address");
  });
  return token;
}

Task<> DriveAccessService::run_serial_change(Axis& axis, std::shared_ptr<void> /*in_use*/,
                                             Requester requester, SerialChange change,
                                             std::weak_ptr<void> alive, SerialCallback tell) {
  if (const auto allowed = axis.check_lease(requester); !allowed) co_return tell(fail(allowed.error()));
  if (const auto possible = check_serial(axis, change); !possible) co_return tell(fail(possible.error()));
  const auto written = co_await DriveOperations(axis).change_serial(change, others_on_bus(axis));
  if (!written) co_return tell(fail(written.error()));
  tell(SerialProgress{.phase = SerialProgress::Phase::written, .text = *written});
  if (change.verify <= Duration{}) co_return;
  tell(SerialProgress{.phase = SerialProgress::Phase::waiting, .text = "switch the drive off and on now"});
  const auto found = co_await find_again(axis, change, alive);
  if (!found) co_return tell(fail(found.error()));
  tell(SerialProgress{.phase = SerialProgress::Phase::verified,
                      .text = "the drive answers there; change the configuration accordingly"});
}

/// What a CAN network cannot do, before anything is written.
Result<void> DriveAccessService::check_serial(const Axis& axis, const SerialChange& change) const {
  const auto* network = machine_->find_network(axis.settings().bus);
  if (network == nullptr) return {};
  const Address where{.bus = axis.settings().bus, .node = axis.settings().node};
  if (change.format)
    return fail({.reason = Reason::not_supported,
                 .message = "a drive on a CAN network has no serial format",
                 .remedy = "leave the format out",
                 .where = where});
  const bool other_rate = change.baud && *change.baud != static_cast<int>(network->settings().bitrate);
  if (other_rate && change.verify > Duration{})
    return fail(
        {.reason = Reason::not_supported,
         .message = fmt::format("the drive cannot be looked for at {} bit/s: {} runs at {}, and axisd "
                                "does not change that",
                                *change.baud, network->name(), network->settings().bitrate),
         .remedy = "leave verify out; then change the interface, all its nodes and the configuration",
         .where = where});
  return {};
}

std::unique_ptr<NodeScan> DriveAccessService::look_for(const Axis& axis, const SerialChange& change,
                                                       const std::weak_ptr<void>& alive) const {
  const auto& bus = axis.settings().bus;
  const auto node = change.node.value_or(axis.settings().node);
  ScanRequest request{.bus = bus, .first_node = node, .last_node = node};
  if (change.baud) request.bauds = {*change.baud};
  if (change.format) request.formats = {*change.format};
  if (auto* network = machine_->find_network(bus))
    return std::make_unique<NetworkScan>(executor_, *clock_, *machine_, *network, std::move(request), alive);
  return std::make_unique<BusScan>(*machine_, *machine_->find_line(bus), std::move(request), alive);
}

Task<Result<void>> DriveAccessService::find_again(Axis& axis, SerialChange change,
                                                  std::weak_ptr<void> alive) {
  const auto deadline = clock_->now() + change.verify;
  while (!alive.expired() && clock_->now() < deadline) {
    const auto scan = look_for(axis, change, alive);
    const auto progress = co_await scan->next();
    if (!progress) co_return fail(progress.error());
    if (!progress->found.empty() && !progress->found.front().model.empty()) {
      if (progress->found.front().model == axis.descriptor().model) co_return Result<void>{};
      co_return fail(Reason::wrong_model, fmt::format("a {} answers there", progress->found.front().model),
                     "give each drive an address of its own");
    }
    co_await sleep_until(executor_, *clock_, clock_->now() + look_again);
  }
  co_return fail(
      {.reason = Reason::no_reply,
       .message = "the drive does not answer with its new address or settings",
       .remedy = "check its switches, and that it was switched off and on; look for it with axisctl bus scan",
       .where = {.bus = axis.settings().bus, .node = change.node.value_or(axis.settings().node)}});
}

std::vector<std::uint8_t> DriveAccessService::others_on_bus(const Axis& axis) const {
  std::vector<std::uint8_t> nodes;
  for (const auto& other : machine_->axes())
    if (other.get() != &axis && other->settings().bus == axis.settings().bus)
      nodes.push_back(other->settings().node);
  for (const auto& device : machine_->devices())
    if (device->settings().bus == axis.settings().bus) nodes.push_back(device->settings().node);
  return nodes;
}

std::shared_ptr<AuditedCall> DriveAccessService::begin(std::string_view rpc, const std::string& axis,
                                                       const Requester& requester, std::string text) {
  log_limited(spdlog::level::warn, requester.client, "changes of drives", fmt::format("{}: {}", axis, text),
              LogKind::drive_changed, {.axis = axis, .client = requester.client});
  return std::make_shared<AuditedCall>(AuditedCall{.rpc = fmt::format("DriveService.{}", rpc),
                                                   .client = requester.client,
                                                   .axis = axis,
                                                   .lease_token = requester.lease_token,
                                                   .text = std::move(text),
                                                   .origin = requester.origin});
}

template <class T>
std::function<void(Result<T>)> DriveAccessService::audited(const std::shared_ptr<AuditedCall>& call,
                                                           std::function<void(Result<T>)> callback) {
  post(executor_, [this, call] {
    if (const auto* axis = machine_->find(call->axis))
      for (auto& parameter : call->parameters)
        if (const auto* known = find_parameter(axis->descriptor().parameters, parameter.address))
          parameter.name = known->name;
    machine_->audit().call(*call);
  });
  return [this, call, callback = std::move(callback)](Result<T> result) {
    end(*call, result ? nullptr : &result.error());
    callback(std::move(result));
  };
}

void DriveAccessService::end(AuditedCall& call, const Error* error) {
  call.phase = error == nullptr ? AuditedCall::Phase::done : AuditedCall::Phase::failed;
  if (error != nullptr) call.error = *error;
  machine_->audit().call(call);
}

}  // namespace axisd::core
