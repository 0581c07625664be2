#include "api/axisctl/client.hpp"

#include <fmt/format.h>
#include <grpc/support/log.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/client_interceptor.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "api/axisctl/address.hpp"
#include "api/transport/channel.hpp"

namespace axisd::axisctl {
namespace {

std::string read_pem(const std::string& path, std::string_view option) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw Failure(ExitCode::usage, fmt::format("{}: cannot read '{}': {}; give a PEM file that you may read",
                                               option, path, std::strerror(errno)));
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file || text.empty())
    throw Failure(ExitCode::usage, fmt::format("{}: cannot read '{}'; it must be a PEM file", option, path));
  return text;
}

std::shared_ptr<grpc::ChannelCredentials> credentials(const Connection& connection) {
  if (connection.tls_certificate.empty() != connection.tls_key.empty())
    throw Failure(ExitCode::usage, "--tls-cert and --tls-key belong together");
  if (connection.tls_ca.empty()) {
    if (!connection.tls_certificate.empty())
      throw Failure(ExitCode::usage,
                    "--tls-cert needs --tls-ca, the certificate that the daemon's is checked with");
    return grpc::InsecureChannelCredentials();
  }
  grpc::SslCredentialsOptions options;
  options.pem_root_certs = read_pem(connection.tls_ca, "--tls-ca");
  if (!connection.tls_certificate.empty()) {
    options.pem_cert_chain = read_pem(connection.tls_certificate, "--tls-cert");
    options.pem_private_key = read_pem(connection.tls_key, "--tls-key");
  }
  return grpc::SslCredentials(options);
}

using Metadata = std::multimap<std::string, std::string>;

/// Adds its metadata to each call.
class Speaker final : public grpc::experimental::Interceptor {
 public:
  explicit Speaker(Metadata metadata) : metadata_(std::move(metadata)) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    constexpr auto begins = grpc::experimental::InterceptionHookPoints::PRE_SEND_INITIAL_METADATA;
    if (methods->QueryInterceptionHookPoint(begins))
      methods->GetSendInitialMetadata()->insert(metadata_.begin(), metadata_.end());
    methods->Proceed();
  }

 private:
  const Metadata metadata_;
};

class Speakers final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit Speakers(Metadata metadata) : metadata_(std::move(metadata)) {}
  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo*) override {
    return new Speaker(metadata_);
  }

 private:
  const Metadata metadata_;
};

/// Of USER or USER:ROLE, as docs/access.md says.
Metadata metadata_for(const std::string& person) {
  const auto colon = person.rfind(':');
  Metadata metadata{{"axisd-user", person.substr(0, colon)}};
  if (colon != std::string::npos) metadata.emplace("axisd-role", person.substr(colon + 1));
  return metadata;
}

/// CellService is the entrance's own.
bool is_for_the_entrance(const google::protobuf::Message& request) {
  return request.GetDescriptor()->file()->package() == "axisd.cell.v1";
}

std::shared_ptr<grpc::Channel> channel_to(const std::string& address,
                                          const std::shared_ptr<grpc::ChannelCredentials>& trusted,
                                          const std::string& person) {
  if (person.empty()) return grpc::CreateCustomChannel(address, trusted, transport::client_arguments());
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> speakers;
  speakers.push_back(std::make_unique<Speakers>(metadata_for(person)));
  return grpc::experimental::CreateCustomChannelWithInterceptors(
      address, trusted, transport::client_arguments(), std::move(speakers));
}

}  // namespace

std::string Connection::address() const {
  return through_entrance() ? with_port(cell, usual_cell_port) : with_port(server, usual_port);
}

Client::Client(Connection connection) : connection_(std::move(connection)) {
  if (!connection_.machine.empty()) {
    if (!connection_.through_entrance())
      throw Failure(ExitCode::usage, "--machine names one of a cell: --cell says where its entrance is");
    check_machine_name(connection_.machine);
  }
  connection_.stop_server = with_port(connection_.stop_server, usual_stop_port);
  // Errors are one line on standard error; gRPC's own log would add to it. GRPC_VERBOSITY brings it back.
  if (std::getenv("GRPC_VERBOSITY") == nullptr) gpr_set_log_function([](gpr_log_func_args*) {});
  const auto trusted = credentials(connection_);
  const auto& person = connection_.speaks_for;
  const auto address = connection_.address();
  if (address.empty()) throw Failure(ExitCode::usage, "--server is empty; it is the daemon's HOST:PORT");
  channel_ = channel_to(address, trusted, person);
  stop_channel_ = channel_to(address, trusted, person);
  if (connection_.through_entrance()) {
    // What is asked of StopService there is passed on to the machine's lane.
    lane_channel_ = stop_channel_;
    return;
  }
  const auto lane = connection_.stop_server.empty() ? stop_lane_of(address) : connection_.stop_server;
  if (!lane.empty()) lane_channel_ = channel_to(lane, trusted, person);
}

Client::Client(const Client& other, const std::string& machine)
    : connection_(other.connection_),
      channel_(other.channel_),
      stop_channel_(other.stop_channel_),
      lane_channel_(other.lane_channel_) {
  connection_.machine.clear();
  connection_.only_machine = machine;
}

Client Client::at(const std::string& machine) const { return {*this, machine}; }

Client::Way Client::way_of(google::protobuf::Message& request) const {
  if (!connection_.through_entrance() || is_for_the_entrance(request)) return {};
  auto way = way_to_names(request);
  if (!connection_.lease_machine.empty() && connection_.lease_machine != way.machine)
    drop_lease_token(request);
  return way;
}

Client::Way Client::way_to_names(google::protobuf::Message& request) const {
  const auto named = take_machine(request);
  if (!named.machine.empty() && !named.bare) return {.machine = named.machine, .shown = true};
  if (!connection_.machine.empty() && named.machine.empty()) return {.machine = connection_.machine};
  if (named.bare)
    throw Failure(ExitCode::usage,
                  fmt::format("'{0}' names no machine of the cell; write {1}/{0}", *named.bare,
                              named.machine.empty() ? "MACHINE" : named.machine));
  if (!connection_.lease_machine.empty() && has_lease_token(request))
    return {.machine = connection_.lease_machine, .shown = true};
  if (!connection_.only_machine.empty()) return {.machine = connection_.only_machine, .shown = true};
  throw Failure(ExitCode::usage, "this is asked of one machine of the cell; name it with --machine");
}

void Client::set(grpc::ClientContext& context, const Way& way) {
  if (!way.machine.empty()) context.AddMetadata("axisd-machine", way.machine);
}

bool Client::lane_is_reachable() const {
  if (!lane_channel_) return false;
  constexpr std::chrono::milliseconds patience(300);
  const bool there = is_reachable(*lane_channel_, lane_is_deaf_ ? std::chrono::milliseconds(0) : patience);
  lane_is_deaf_ = !there;
  return there;
}

void Client::wait_for_connection(Lane lane, std::chrono::milliseconds limit) const {
  const auto until = std::chrono::system_clock::now() + limit;
  if (channel(lane)->GetState(true) == GRPC_CHANNEL_READY)
    channel(lane)->WaitForStateChange(GRPC_CHANNEL_READY, until);
  else
    channel(lane)->WaitForConnected(until);
}

Failure Client::failure(const grpc::Status& status, std::string_view subject) const {
  return failure_of(status, subject, connection_.address(), !connection_.tls_ca.empty(),
                    connection_.through_entrance() ? Asked::entrance : Asked::daemon);
}

std::string random_uuid() {
  std::random_device source;
  std::array<std::uint32_t, 4> words{source(), source(), source(), source()};
  words[1] = (words[1] & 0xFFFF0FFFU) | 0x4000U;      // version 4
  words[2] = (words[2] & 0x3FFFFFFFU) | 0x80000000U;  // variant of RFC 4122
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:04x}{:08x}", words[0], words[1] >> 16U,
                     words[1] & 0xFFFFU, words[2] >> 16U, words[2] & 0xFFFFU, words[3]);
}

}  // namespace axisd::axisctl
