#include "api/server/bus_service.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/budget/convert.hpp"
#include "api/server/audit_calls.hpp"
#include "api/server/bus_convert.hpp"
#include "api/server/bus_validate.hpp"
#include "api/server/convert.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/progress_stream.hpp"
#include "api/server/status.hpp"
#include "api/server/value_reply.hpp"
#include "buses/limited_log.hpp"
#include "devices/nearest.hpp"

namespace axisd::server {

using Call = std::shared_ptr<PendingCall>;
using Words = std::vector<std::uint16_t>;
using Bytes = std::vector<std::uint8_t>;

namespace {

/// Empty: there is no such device.
std::string bus_of(std::string_view device, const BusAccess& buses) {
  const auto devices = buses.devices();
  const auto found = std::ranges::find(devices, device, [](const auto& each) { return each->name; });
  return found == devices.end() ? std::string() : (*found)->bus;
}

}  // namespace

BusServiceImpl::BusServiceImpl(const Services& services) : BoundedService(services), services_(services) {
  begin_within_bounds(&BusServiceImpl::ListBuses, &BusServiceImpl::GetBudget, &BusServiceImpl::ListDevices,
                      &BusServiceImpl::WriteDevice, &BusServiceImpl::Transact, &BusServiceImpl::Scan,
                      &BusServiceImpl::GetBusStatistics, &BusServiceImpl::WatchBusStatistics,
                      &BusServiceImpl::ListFlightRecords, &BusServiceImpl::GetFlightRecord,
                      &BusServiceImpl::WriteFlightRecord, &BusServiceImpl::TraceBus);
}

BusServiceImpl::Reactor* BusServiceImpl::ListBuses(Context* context, const v1::ListBusesRequest*,
                                                   v1::ListBusesResponse* response) {
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    services_.machine.buses([call, response](std::vector<BusStatus> buses) {
      call->complete([response, buses = std::move(buses)] {
        for (const auto& bus : buses) to_proto(bus, *response->add_buses());
        return grpc::Status::OK;
      });
    });
  });
}

BusServiceImpl::Reactor* BusServiceImpl::GetBudget(Context* context, const v1::GetBudgetRequest* request,
                                                   v1::GetBudgetResponse* response) {
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    services_.machine.budgets([call, response, bus = request->bus()](std::vector<BusBudgetReport> budgets) {
      call->complete([response, bus, budgets = std::move(budgets)] {
        for (const auto& budget : budgets)
          if (bus.empty() || budget.predicted.bus == bus) api::to_proto(budget, *response->add_budgets());
        if (bus.empty() || !response->budgets().empty()) return grpc::Status::OK;
        std::vector<std::string> known;
        for (const auto& budget : budgets) known.push_back(budget.predicted.bus);
        return to_status({.reason = Reason::invalid_argument,
                          .message = fmt::format("there is no bus '{}'", bus),
                          .remedy = did_you_mean(bus, known, "list them: axisctl bus list, or ListBuses")});
      });
    });
  });
}

BusServiceImpl::Reactor* BusServiceImpl::ListDevices(Context* context, const v1::ListDevicesRequest*,
                                                     v1::ListDevicesResponse* response) {
  for (const auto& device : services_.machine.bus_access().devices())
    to_proto(*device, *response->add_devices());
  return answer(context, grpc::Status::OK);
}

BusServiceImpl::Reactor* BusServiceImpl::WriteDevice(Context* context, const v1::WriteDeviceRequest* request,
                                                     v1::WriteDeviceResponse* response) {
  auto& buses = services_.machine.bus_access();
  if (auto valid = check_device_write(*request, buses); !valid)
    return answer(context, to_status(valid.error()));
  const auto caller = who_asks(*context, *request);
  const auto& client = caller.name;
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    const auto text = fmt::format("{} {} = {}", request->device(), request->register_(), request->value());
    auto reply = reply_with_value<double>(
        call, [response](double written) { response->set_value(written); },
        fmt::format("{}: {}", client, text));
    buses.write_device(request->device(), request->register_(), request->value(),
                       audited<double>(services_,
                                       {.rpc = "BusService.WriteDevice",
                                        .client = client,
                                        .bus = bus_of(request->device(), buses),
                                        .text = text,
                                        .origin = caller.origin},
                                       std::move(reply)));
  });
}

BusServiceImpl::Reactor* BusServiceImpl::transact_object(Context* context, const v1::TransactRequest* request,
                                                         v1::TransactResponse* response) {
  auto transfer = to_object_request(*request);
  if (!transfer) return answer(context, to_status(transfer.error()));
  const auto caller = who_asks(*context, *request);
  const auto& client = caller.name;
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    auto fill = [response, reads = request->has_read_object(),
                 type = request->read_object().type()](const Bytes& bytes) {
      if (reads) to_proto(bytes, type, *response);
    };
    auto& buses = services_.machine.bus_access();
    if (transfer->bytes.empty())
      return buses.transact_object(*std::move(transfer), reply_with_value<Bytes>(call, std::move(fill)));
    const auto text =
        fmt::format("writes {:02x} to object {:06X}h of {} node {}", fmt::join(transfer->bytes, " "),
                    transfer->object, transfer->bus, transfer->node);
    auto reply = reply_with_value<Bytes>(call, std::move(fill), fmt::format("{}: {}", client, text));
    buses.transact_object(*std::move(transfer), audited<Bytes>(services_,
                                                               {.rpc = "BusService.Transact",
                                                                .client = client,
                                                                .bus = request->bus(),
                                                                .text = text,
                                                                .origin = caller.origin},
                                                               std::move(reply)));
  });
}

BusServiceImpl::Reactor* BusServiceImpl::Transact(Context* context, const v1::TransactRequest* request,
                                                  v1::TransactResponse* response) {
  if (names_object(*request)) return transact_object(context, request, response);
  auto transaction = to_transact(*request);
  if (!transaction) return answer(context, to_status(transaction.error()));
  const auto caller = who_asks(*context, *request);
  const auto& client = caller.name;
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    auto fill = [response](const Words& words) {
      for (const auto word : words) response->add_values(word);
    };
    auto& buses = services_.machine.bus_access();
    const auto& values = transaction->values;
    if (values.empty())
      return buses.transact(*std::move(transaction), reply_with_value<Words>(call, std::move(fill)));
    const auto text = fmt::format("writes {} to registers from {} of {} node {}", fmt::join(values, " "),
                                  transaction->address, transaction->bus, transaction->node);
    auto reply = reply_with_value<Words>(call, std::move(fill), fmt::format("{}: {}", client, text));
    buses.transact(*std::move(transaction), audited<Words>(services_,
                                                           {.rpc = "BusService.Transact",
                                                            .client = client,
                                                            .bus = request->bus(),
                                                            .text = text,
                                                            .origin = caller.origin},
                                                           std::move(reply)));
  });
}

grpc::ServerWriteReactor<v1::ScanResponse>* BusServiceImpl::Scan(Context* context,
                                                                 const v1::ScanRequest* request) {
  using Refused = RefusedStream<v1::ScanResponse>;
  using Stream = ProgressStream<v1::ScanResponse, ScanProgress>;
  auto scan = to_scan(*request);
  if (!scan) return new Refused(to_status(scan.error()));
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::stream);
  if (!ticket) return new Refused(to_status(ticket.error()));
  log_limited(spdlog::level::info, client, "streams",
              fmt::format("scans {} from node {} to {}", scan->bus, scan->first_node, scan->last_node));
  auto* stream = Stream::start(
      services_, context, *std::move(ticket),
      [&](Stream::Callback callback) {
        return services_.machine.bus_access().scan(*std::move(scan), std::move(callback));
      },
      [](const ScanProgress& from, v1::ScanResponse& to) {
        to_proto(from, to);
        return from.finished;
      });
  return stream != nullptr ? stream : new Refused(shutting_down());
}

}  // namespace axisd::server
