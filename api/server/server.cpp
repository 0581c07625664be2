#include "api/server/server.hpp"

#include <fmt/format.h>
#include <grpc/support/log.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_posix.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <utility>

#include "api/server/audit_service.hpp"
#include "api/server/axis_service.hpp"
#include "api/server/bus_service.hpp"
#include "api/server/command_service.hpp"
#include "api/server/drive_service.hpp"
#include "api/server/event_hub.hpp"
#include "api/server/event_service.hpp"
#include "api/server/group_service.hpp"
#include "api/server/health_service.hpp"
#include "api/server/lease_service.hpp"
#include "api/server/reflection_service.hpp"
#include "api/server/status.hpp"
#include "api/server/system_service.hpp"
#include "api/server/watch_hub.hpp"
#include "api/transport/accept_loop.hpp"
#include "api/transport/server_credentials.hpp"
#include "api/transport/server_limits.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {
namespace {

/// What gRPC says goes to the daemon's log. Whoever connects can make it complain, without a certificate,
/// too: each place in its sources is an origin of its own.
void log_of_grpc(gpr_log_func_args* args) {
  std::string text(args->message);
  std::ranges::replace_if(text, [](char c) { return c < ' ' || c > '~'; }, '?');
  if (args->severity != GPR_LOG_SEVERITY_ERROR) return spdlog::info("gRPC: {}", text);
  const std::string_view file(args->file);
  log_limited(spdlog::level::warn, "gRPC", fmt::format("{}:{}", file.substr(file.rfind('/') + 1), args->line),
              text);
}

}  // namespace

struct Server::Parts {
  Parts(Machine& machine, const ServerOptions& options)
      : reply(std::make_shared<ReplyThread>()),
        calls(std::make_shared<OpenCalls>()),
        guard(std::make_shared<StallGuard>(options.stalled_reader_limit)),
        admission(options.limits),
        callers(machine, options.access, options.audit_sink),
        hub(std::make_shared<WatchHub>(machine, reply, options.stalled_reader_limit)),
        events(std::make_shared<EventHub>(reply)),
        services{machine,
                 reply,
                 calls,
                 guard,
                 admission,
                 callers,
                 *hub,
                 *events,
                 options.configuration,
                 options.audit,
                 options.audit_sink,
                 options.state_copies},
        axis(services),
        command(services),
        system(services),
        bus(services),
        drive(services),
        event(services),
        lease(services),
        group(services),
        audit(services),
        health(services),
        reflection(services) {}

  std::shared_ptr<ReplyThread> reply;
  std::shared_ptr<OpenCalls> calls;
  std::shared_ptr<StallGuard> guard;
  Admission admission;
  Callers callers;
  std::shared_ptr<WatchHub> hub;
  std::shared_ptr<EventHub> events;
  Services services;
  AxisServiceImpl axis;
  CommandServiceImpl command;
  SystemServiceImpl system;
  BusServiceImpl bus;
  DriveServiceImpl drive;
  EventServiceImpl event;
  LeaseServiceImpl lease;
  GroupServiceImpl group;
  AuditServiceImpl audit;
  HealthService health;
  ReflectionService reflection;
  /// Of TCP. A unix socket is given to gRPC by its number, which then is the name of the connection.
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
  std::unique_ptr<grpc::Server> server;
  transport::AcceptLoop accept;
  bool serving = false;

  struct Served {
    const char* name;
    grpc::Service* service;
  };
  /// All services of ours, in the order of the contract.
  std::array<Served, 9> served() {
    return {{{v1::AxisService::service_full_name(), &axis},
             {v1::CommandService::service_full_name(), &command},
             {v1::SystemService::service_full_name(), &system},
             {v1::BusService::service_full_name(), &bus},
             {v1::DriveService::service_full_name(), &drive},
             {v1::EventService::service_full_name(), &event},
             {v1::LeaseService::service_full_name(), &lease},
             {v1::GroupService::service_full_name(), &group},
             {v1::AuditService::service_full_name(), &audit}}};
  }

  void take_local(FileDescriptor connection) {
    callers.enter(connection.get());
    grpc::AddInsecureChannelFromFd(server.get(), connection.release());
  }
  transport::AcceptLoop::HandOver way_in(const transport::ListeningSocket& socket) {
    if (!socket.unix_path.empty())
      return [this](FileDescriptor connection) { take_local(std::move(connection)); };
    return [this, listener = socket.fd.get()](FileDescriptor connection) {
      grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
      parameters.listener_fd = listener;
      parameters.fd = connection.release();
      acceptor->HandleNewConnection(&parameters);
    };
  }
};

Server::Server(Machine& machine, ServerOptions options)
    : machine_(machine), options_(std::move(options)), parts_(std::make_unique<Parts>(machine, options_)) {
  // The machine may publish after this server is gone.
  machine_.on_published([hub = std::weak_ptr(parts_->hub)] {
    if (const auto alive = hub.lock()) alive->published();
  });
  machine_.events().on_event([hub = std::weak_ptr(parts_->events)] {
    if (const auto alive = hub.lock()) alive->happened();
  });
}

Server::~Server() { shutdown(); }

Result<int> Server::start() {
  std::shared_ptr<grpc::ServerCredentials> tcp_credentials = grpc::InsecureServerCredentials();
  if (options_.tls) {
    tcp_credentials = transport::tls_credentials(options_.tls);
    parts_->callers.trust(options_.tls);
  }
  std::vector<transport::ListeningSocket> sockets;
  for (const auto& address : options_.listen) {
    auto opened = transport::listen_on(address, options_.tls != nullptr);
    if (!opened) return fail(std::move(opened).error());
    std::ranges::move(*opened, std::back_inserter(sockets));
  }

  gpr_set_log_function(log_of_grpc);
  grpc::EnableDefaultHealthCheckService(false);
  grpc::ServerBuilder builder;
  transport::limit(builder, "axisd");
  for (const auto& each : parts_->served()) builder.RegisterService(each.service);
  parts_->health.serve(services());
  builder.RegisterService(&parts_->health);
  if (options_.reflection) {
    auto told = services();
    told.emplace_back(HealthService::name);
    parts_->reflection.serve(std::move(told));
    builder.RegisterService(&parts_->reflection);
  }
  constexpr auto from_fd = grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD;
  parts_->acceptor = builder.experimental().AddExternalConnectionAcceptor(from_fd, tcp_credentials);
  parts_->server = builder.BuildAndStart();
  if (!parts_->server)
    return fail(Reason::internal, "gRPC refuses to start", "see the log; GRPC_VERBOSITY=debug tells more");
  parts_->serving = true;
  parts_->reply->start([hub = parts_->hub.get(), guard = parts_->guard.get(),
                        judged = options_.tls ? parts_->calls.get() : nullptr](TimePoint now) {
    const auto judges_again = judged == nullptr ? TimePoint::max() : judged->tick(now);
    return std::min({hub->tick(now), guard->tick(now), tell_left_out(now), judges_again});
  });

  int port = 0;
  std::vector<transport::AcceptLoop::Entry> entries;
  for (auto& socket : sockets) {
    if (port == 0) port = socket.port;
    entries.push_back({.socket = std::move(socket), .hand_over = {}});
    entries.back().hand_over = parts_->way_in(entries.back().socket);
  }
  auto in_progress = [calls = parts_->calls](const std::string& peer) { return calls->in_progress(peer); };
  if (auto accepting =
          parts_->accept.start(std::move(entries), options_.peers, options_.streams, std::move(in_progress));
      !accepting)
    return fail(std::move(accepting).error());
  for (const auto& address : options_.listen)
    spdlog::info("serving on {} ({})", address,
                 options_.tls && !address.starts_with("unix:") ? "mutual TLS" : "plaintext, local");
  return port;
}

void Server::shutdown(Duration deadline) {
  if (!std::exchange(parts_->serving, false)) return;
  parts_->health.end();
  parts_->accept.stop();
  parts_->calls->close_all(shutting_down(), monotonic_now() + deadline);
  // What is left has not been closed in time.
  parts_->server->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
  parts_->reply->stop();
  (void)tell_left_out(TimePoint::max());
  gpr_set_log_function(nullptr);  // gRPC's own: its threads outlive the daemon's log
}

FileDescriptor Server::connect_inside() {
  auto [ours, theirs] = transport::connected_pair();
  if (ours.get() < 0) return {};
  parts_->take_local(std::move(theirs));
  return std::move(ours);
}

std::vector<std::string> Server::services() const {
  std::vector<std::string> names;
  for (const auto& each : parts_->served()) names.emplace_back(each.name);
  return names;
}

std::vector<std::shared_ptr<transport::Knock>> Server::knocks() const { return parts_->accept.knocks(); }

TimePoint Server::last_progress() const { return parts_->accept.last_progress(); }

TimePoint Server::last_hand_over() const { return parts_->accept.last_hand_over(); }

std::uint64_t Server::batches_serialised() const { return parts_->hub->batches_serialised(); }

}  // namespace axisd::server
