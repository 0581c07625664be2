#include "daemon/core/bus_access_service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "buses/modbus_rtu/node.hpp"
#include "daemon/core/bus_access_network_scan.hpp"
#include "devices/nearest.hpp"

namespace axisd::core {

namespace {

/// M28: what an axis knows of its drive must not change behind its back.
Result<void> may_write(const MachineCore& machine, Address where) {
  const auto& axes = machine.axes();
  const auto owner = std::ranges::find_if(axes, [&](const auto& axis) {
    return axis->settings().bus == where.bus && axis->settings().node == where.node;
  });
  if (owner == axes.end()) return {};
  return fail({.reason = Reason::invalid_argument,
               .message = fmt::format("node {} belongs to axis '{}'", *where.node, (*owner)->settings().name),
               .remedy = "use DriveService.WriteParameters for parameters, AxisService to move or stop",
               .where = std::move(where)});
}

Error unknown_write(Error error, std::string_view what) {
  error.message += "; whether it was written is unknown";
  error.remedy = fmt::format("read the {} back before writing again; {}", what, error.remedy);
  return error;
}

/// Nobody is told anything any more once the token was dropped.
void tell(const std::weak_ptr<void>& alive, const std::function<void(Result<ScanProgress>)>& callback,
          Result<ScanProgress> progress) {
  if (const auto held = alive.lock()) callback(std::move(progress));
}

}  // namespace

Error no_such_bus(const MachineCore& machine, const std::string& name) {
  std::vector<std::string> known;
  for (const auto& bus : machine.buses()) known.push_back(bus->name());
  return {
      .reason = Reason::invalid_argument,
      .message = fmt::format("there is no bus '{}'", name),
      .remedy = did_you_mean(name, known, fmt::format("the configuration has: {}", fmt::join(known, ", ")))};
}

BusAccessService::BusAccessService(Executor executor, Clock& clock, MachineCore& machine)
    : executor_(std::move(executor)), clock_(&clock), machine_(&machine) {}

void BusAccessService::transact(TransactRequest request,
                                std::function<void(Result<std::vector<std::uint16_t>>)> callback) {
  auto run = [](BusAccessService& self, TransactRequest asked, auto done) -> Task<> {
    done(co_await self.run_transact(std::move(asked)));
  };
  post(executor_, [this, run, request = std::move(request), callback = std::move(callback)]() mutable {
    machine_->launch(run(*this, std::move(request), std::move(callback)), "transact");
  });
}

Task<Result<std::vector<std::uint16_t>>> BusAccessService::run_transact(TransactRequest request) {
  auto* bus = machine_->find_line(request.bus);
  if (machine_->find_network(request.bus) != nullptr)
    co_return fail(Reason::invalid_argument,
                   fmt::format("{} is a CAN network: it has no registers", request.bus),
                   "read or write an object");
  if (bus == nullptr) co_return fail(no_such_bus(*machine_, request.bus));
  const bool writes = !request.values.empty();
  const Address where{.bus = request.bus, .node = request.node, .object = request.address};
  if (writes)
    if (const auto allowed = may_write(*machine_, where); !allowed) co_return fail(allowed.error());
  const modbus_rtu::Node node(*bus, request.node);
  const TransactionOptions options{.transaction_class = TransactionClass::parameters, .of_others = true};
  auto answer = !writes ? co_await node.read(request.address, request.count, options)
                : request.values.size() == 1
                    ? co_await node.write(request.address, request.values.front(), options)
                    : co_await node.write_block(request.address, request.values, options);
  if (answer) co_return std::move(answer->registers);
  auto error = std::move(answer.error());
  error.where.bus = request.bus;
  if (writes && error.outcome == Outcome::unknown) error = unknown_write(std::move(error), "register");
  co_return fail(std::move(error));
}

void BusAccessService::transact_object(ObjectRequest request,
                                       std::function<void(Result<std::vector<std::uint8_t>>)> callback) {
  auto run = [](BusAccessService& self, ObjectRequest asked, auto done) -> Task<> {
    done(co_await self.run_transact(std::move(asked)));
  };
  post(executor_, [this, run, request = std::move(request), callback = std::move(callback)]() mutable {
    machine_->launch(run(*this, std::move(request), std::move(callback)), "transact");
  });
}

Task<Result<std::vector<std::uint8_t>>> BusAccessService::run_transact(ObjectRequest request) {
  auto* bus = machine_->find_network(request.bus);
  if (machine_->find_line(request.bus) != nullptr)
    co_return fail(Reason::invalid_argument,
                   fmt::format("{} is an RS-485 line: it has no objects", request.bus),
                   "read or write registers");
  if (bus == nullptr) co_return fail(no_such_bus(*machine_, request.bus));
  const bool writes = !request.bytes.empty();
  const Address where{.bus = request.bus, .node = request.node, .object = request.object};
  if (writes)
    if (const auto allowed = may_write(*machine_, where); !allowed) co_return fail(allowed.error());
  const canopen::Object object{static_cast<std::uint16_t>(request.object >> 8U),
                               static_cast<std::uint8_t>(request.object & 0xFFU)};
  auto& sdo = bus->master().sdo();
  auto transfer = writes ? sdo.download(request.node, object, std::move(request.bytes))
                         : sdo.upload(request.node, object);
  auto answer = co_await std::move(transfer);
  if (answer) co_return std::move(answer->bytes);
  auto error = std::move(answer.error());
  if (writes && error.outcome == Outcome::unknown) error = unknown_write(std::move(error), "object");
  co_return fail(std::move(error));
}

Result<std::unique_ptr<NodeScan>> BusAccessService::scan_of(ScanRequest request,
                                                            std::weak_ptr<void> alive) const {
  if (auto* line = machine_->find_line(request.bus))
    return std::make_unique<BusScan>(*machine_, *line, std::move(request), std::move(alive));
  if (auto* network = machine_->find_network(request.bus))
    return std::make_unique<NetworkScan>(executor_, *clock_, *machine_, *network, std::move(request),
                                         std::move(alive));
  return fail(no_such_bus(*machine_, request.bus));
}

std::shared_ptr<void> BusAccessService::scan(ScanRequest request, ScanCallback callback) {
  auto token = std::make_shared<int>(0);
  post(executor_, [this, request = std::move(request), alive = std::weak_ptr<void>(token),
                   callback = std::move(callback)]() mutable {
    machine_->launch(run_scan(std::move(request), std::move(alive), std::move(callback)), "scan");
  });
  return token;
}

Task<> BusAccessService::run_scan(ScanRequest request, std::weak_ptr<void> alive, ScanCallback callback) {
  const auto name = request.bus;
  const auto scan = scan_of(std::move(request), alive);
  if (!scan) {
    tell(alive, callback, fail(scan.error()));
    co_return;
  }
  if (!scanning_.insert(name).second) {
    tell(alive, callback,
         fail(Reason::busy, fmt::format("a scan of {} is under way", name), "wait for its end, or end it"));
    co_return;
  }
  for (;;) {
    auto progress = co_await (*scan)->next();
    const bool over = !progress || progress->finished || alive.expired();
    if (over) scanning_.erase(name);  // whoever is told may start the next one at once
    tell(alive, callback, std::move(progress));
    if (over) co_return;
  }
}

std::vector<DeviceSnapshotPtr> BusAccessService::devices() const {
  std::vector<DeviceSnapshotPtr> all;
  for (const auto& device : machine_->table()->devices) all.push_back(device->snapshot.load());
  return all;
}

void BusAccessService::write_device(std::string device, std::string name, double value,
                                    std::function<void(Result<double>)> callback) {
  auto run = [](Device& found, std::shared_ptr<void> /*in_use*/, std::string register_name, double wanted,
                auto done) -> Task<> { done(co_await found.write(std::move(register_name), wanted)); };
  post(executor_, [this, run, device = std::move(device), name = std::move(name), value,
                   callback = std::move(callback)]() mutable {
    const auto& all = machine_->devices();
    const auto found = std::ranges::find_if(all, [&](const auto& d) { return d->settings().name == device; });
    if (found == all.end())
      return callback(fail(Reason::invalid_argument, fmt::format("there is no device '{}'", device),
                           "list them: axisctl device list"));
    if ((*found)->closing())
      return callback(fail(Reason::reloading, fmt::format("{}: its configuration is being reloaded", device),
                           "repeat it in a moment"));
    machine_->launch(run(**found, (*found)->use(), std::move(name), value, std::move(callback)),
                     "write device");
  });
}

}  // namespace axisd::core
