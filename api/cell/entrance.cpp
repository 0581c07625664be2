#include "api/cell/entrance.hpp"

#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "api/transport/listen.hpp"
#include "api/transport/server_credentials.hpp"
#include "api/transport/server_limits.hpp"

namespace axisd::cell {

namespace {

/// Calls that are passed on are not known as such here: there is room for all that are permitted, beside what
/// a machine has room for.
transport::StreamBudget::Limits streams_beside(const Settings& settings) {
  transport::StreamBudget::Limits limits;
  limits.lasting += settings.calls;
  limits.idle += settings.calls;
  return limits;
}

}  // namespace

Entrance::Entrance(Cell& cell, RouteTable& routes, OpenCalls& calls, const Settings& settings,
                   std::shared_ptr<const tls::Live> live)
    : settings_(settings),
      live_(std::move(live)),
      callers_(live_, settings),
      service_(cell, callers_, calls, settings),
      forwarder_(routes, callers_, calls) {}

Entrance::~Entrance() { close(); }

Result<int> Entrance::open() {
  auto sockets = transport::listen_on(settings_.listen, live_ != nullptr);
  if (!sockets) return fail(std::move(sockets).error());
  // Asking for gRPC's health is asking the machine that is named: it is passed on.
  grpc::EnableDefaultHealthCheckService(false);
  grpc::ServerBuilder builder;
  transport::limit(builder, "axisd-cell");
  builder.RegisterService(&service_);
  builder.RegisterCallbackGenericService(&forwarder_);
  constexpr auto from_fd = grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD;
  acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      from_fd, live_ ? transport::tls_credentials(live_) : grpc::InsecureServerCredentials());
  server_ = builder.BuildAndStart();
  if (!server_)
    return fail(Reason::internal, "gRPC refuses to start", "see the log; GRPC_VERBOSITY=debug tells more");
  const int port = sockets->front().port;
  std::vector<transport::AcceptLoop::Entry> entries;
  for (auto& socket : *sockets) {
    const int listener = socket.fd.get();
    entries.push_back({.socket = std::move(socket), .hand_over = [this, listener](FileDescriptor connection) {
                         grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
                         parameters.listener_fd = listener;
                         parameters.fd = connection.release();
                         acceptor_->HandleNewConnection(&parameters);
                       }});
  }
  if (auto accepting = accept_.start(std::move(entries), {}, streams_beside(settings_), {}); !accepting)
    return fail(std::move(accepting).error());
  return port;
}

void Entrance::close() {
  accept_.stop();
  if (!server_) return;
  server_->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  server_.reset();
}

}  // namespace axisd::cell
