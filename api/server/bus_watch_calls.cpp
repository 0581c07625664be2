// BusService: what goes over a bus. Statistics, traces, flight records.
#include <fmt/format.h>

#include <utility>

#include "api/server/bus_service.hpp"
#include "api/server/bus_watch_convert.hpp"
#include "api/server/paced_stream.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/status.hpp"
#include "api/server/validate.hpp"
#include "api/server/value_reply.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {

using Call = std::shared_ptr<PendingCall>;

BusServiceImpl::Reactor* BusServiceImpl::GetBusStatistics(Context* context,
                                                          const v1::GetBusStatisticsRequest* request,
                                                          v1::GetBusStatisticsResponse* response) {
  using All = std::vector<BusStatistics>;
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    services_.machine.bus_watch().statistics(request->bus(),
                                             reply_with_value<All>(call, [response](const All& all) {
                                               for (const auto& bus : all)
                                                 to_proto(bus, *response->add_buses());
                                             }));
  });
}

grpc::ServerWriteReactor<v1::WatchBusStatisticsResponse>* BusServiceImpl::WatchBusStatistics(
    Context* context, const v1::WatchBusStatisticsRequest* request) {
  using Stream = PacedStream<v1::WatchBusStatisticsResponse, StatisticsTick>;
  using Refused = RefusedStream<v1::WatchBusStatisticsResponse>;
  const auto period = watch_period(*request);
  if (!period) return new Refused(to_status(period.error()));
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::stream);
  if (!ticket) return new Refused(to_status(ticket.error()));
  auto* stream = Stream::start(
      services_, context, *std::move(ticket),
      [&](Stream::Take take) {
        return services_.machine.bus_watch().watch_statistics(request->bus(), *period, std::move(take));
      },
      [](const StatisticsTick& from, v1::WatchBusStatisticsResponse& to) {
        to.set_missed(from.missed);
        for (const auto& bus : from.buses) to_proto(bus, *to.add_buses());
      });
  return stream != nullptr ? stream : new Refused(shutting_down());
}

grpc::ServerWriteReactor<v1::TraceBusResponse>* BusServiceImpl::TraceBus(Context* context,
                                                                         const v1::TraceBusRequest* request) {
  using Stream = PacedStream<v1::TraceBusResponse, TraceBatch>;
  using Refused = RefusedStream<v1::TraceBusResponse>;
  TraceRequest trace{.bus = request->bus()};
  if (request->has_node()) {
    if (request->node() < 1 || request->node() > canopen::highest_node)
      return new Refused(to_status(Error{.reason = Reason::invalid_argument,
                                         .message = fmt::format("node {} does not exist", request->node()),
                                         .remedy = "use 1 to 127, or none for all"}));
    trace.node = static_cast<std::uint8_t>(request->node());
  }
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::stream);
  if (!ticket) return new Refused(to_status(ticket.error()));
  log_limited(spdlog::level::info, client, "streams", fmt::format("traces {}", trace.bus));
  auto* stream = Stream::start(
      services_, context, *std::move(ticket),
      [&](Stream::Take take) {
        return services_.machine.bus_watch().trace(std::move(trace), std::move(take));
      },
      [bus = request->bus()](const TraceBatch& from, v1::TraceBusResponse& to) { to_proto(from, bus, to); });
  return stream != nullptr ? stream : new Refused(shutting_down());
}

BusServiceImpl::Reactor* BusServiceImpl::ListFlightRecords(Context* context,
                                                           const v1::ListFlightRecordsRequest*,
                                                           v1::ListFlightRecordsResponse* response) {
  using All = std::vector<FlightRecord>;
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    services_.machine.bus_watch().flight_records(reply_with_value<All>(call, [response](const All& all) {
      for (const auto& record : all) to_proto(record, *response->add_records());
    }));
  });
}

BusServiceImpl::Reactor* BusServiceImpl::GetFlightRecord(Context* context,
                                                         const v1::GetFlightRecordRequest* request,
                                                         v1::GetFlightRecordResponse* response) {
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    services_.machine.bus_watch().flight_record(
        request->name(), reply_with_value<std::string>(
                             call, [response](const std::string& text) { response->set_text(text); }));
  });
}

BusServiceImpl::Reactor* BusServiceImpl::WriteFlightRecord(Context* context,
                                                           const v1::WriteFlightRecordRequest* request,
                                                           v1::WriteFlightRecordResponse* response) {
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), [&](const Call& call) {
    services_.machine.bus_watch().write_flight_record(
        request->bus(), client,
        reply_with_value<std::string>(
            call, [response](const std::string& name) { response->set_name(name); },
            fmt::format("{}: writes a flight record of {}", client, request->bus())));
  });
}

}  // namespace axisd::server
