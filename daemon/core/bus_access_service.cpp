#include "daemon/core/bus_access_service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "buses/modbus_rtu/node.hpp"
#include "daemon/core/bus_access_scan.hpp"

namespace axisd::core {

namespace {

Address at(const TransactRequest& request) {
  return {.bus = request.bus, .node = request.node, .object = request.address};
}

/// M28: what an axis knows of its drive must not change behind its back.
Result<void> may_write(const MachineCore& machine, const TransactRequest& request) {
  const auto& axes = machine.axes();
  const auto owner = std::ranges::find_if(axes, [&](const auto& axis) {
    return axis->settings().bus == request.bus && axis->settings().node == request.node;
  });
  if (owner == axes.end()) return {};
  return fail(
      {.reason = Reason::invalid_argument,
       .message = fmt::format("node {} belongs to axis '{}'", request.node, (*owner)->settings().name),
       .remedy = "use DriveService.WriteParameters for parameters, AxisService to move or stop",
       .where = at(request)});
}

/// Nobody is told anything any more once the token was dropped.
void tell(const std::weak_ptr<void>& alive, const std::function<void(Result<ScanProgress>)>& callback,
          Result<ScanProgress> progress) {
  if (const auto held = alive.lock()) callback(std::move(progress));
}

}  // namespace

BusAccessService::BusAccessService(Executor executor, MachineCore& machine)
    : executor_(std::move(executor)), machine_(&machine) {}

Result<modbus_rtu::RtuBus*> BusAccessService::bus_named(const std::string& name) const {
  if (auto* bus = machine_->find_line(name)) return bus;
  std::string known;
  for (const auto& bus : machine_->buses()) known += (known.empty() ? "" : ", ") + bus->name();
  return fail(Reason::invalid_argument, fmt::format("there is no bus '{}'", name),
              fmt::format("the configuration has: {}", known));
}

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
  const auto bus = bus_named(request.bus);
  if (!bus) co_return fail(bus.error());
  const bool writes = !request.values.empty();
  if (writes)
    if (const auto allowed = may_write(*machine_, request); !allowed) co_return fail(allowed.error());
  const modbus_rtu::Node node(**bus, request.node);
  const TransactionOptions options{.transaction_class = TransactionClass::parameters};
  auto answer = !writes ? co_await node.read(request.address, request.count, options)
                : request.values.size() == 1
                    ? co_await node.write(request.address, request.values.front(), options)
                    : co_await node.write_block(request.address, request.values, options);
  if (answer) co_return std::move(answer->registers);
  auto error = std::move(answer.error());
  error.where.bus = request.bus;
  if (writes && error.outcome == Outcome::unknown) {
    error.message += "; whether it was written is unknown";
    error.remedy = "read the register back before writing again; " + error.remedy;
  }
  co_return fail(std::move(error));
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
  const auto bus = bus_named(request.bus);
  if (!bus) {
    tell(alive, callback, fail(bus.error()));
    co_return;
  }
  const auto name = request.bus;
  if (!scanning_.insert(name).second) {
    tell(alive, callback,
         fail(Reason::busy, fmt::format("a scan of {} is under way", name), "wait for its end, or end it"));
    co_return;
  }
  BusScan scan(*machine_, **bus, std::move(request), alive);
  for (;;) {
    auto progress = co_await scan.next();
    const bool over = !progress || progress->finished || alive.expired();
    if (over) scanning_.erase(name);  // whoever is told may start the next one at once
    tell(alive, callback, std::move(progress));
    if (over) co_return;
  }
}

std::vector<DeviceSnapshotPtr> BusAccessService::devices() const {
  std::vector<DeviceSnapshotPtr> all;
  for (const auto& device : machine_->devices()) all.push_back(device->snapshot());
  return all;
}

void BusAccessService::write_device(std::string device, std::string name, double value,
                                    std::function<void(Result<double>)> callback) {
  auto run = [](Device& found, std::string register_name, double wanted, auto done) -> Task<> {
    done(co_await found.write(std::move(register_name), wanted));
  };
  post(executor_, [this, run, device = std::move(device), name = std::move(name), value,
                   callback = std::move(callback)]() mutable {
    const auto& all = machine_->devices();
    const auto found = std::ranges::find_if(all, [&](const auto& d) { return d->settings().name == device; });
    if (found == all.end())
      return callback(fail(Reason::invalid_argument, fmt::format("there is no device '{}'", device),
                           "list them: axisctl device list"));
    machine_->launch(run(**found, std::move(name), value, std::move(callback)), "write device");
  });
}

}  // namespace axisd::core
