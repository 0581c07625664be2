#include "api/transport/channel.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <utility>

namespace axisd::transport {
namespace {

Result<std::string> read_pem(const std::string& path, std::string_view section) {
  if (path.empty()) return std::string();
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file || text.empty())
    return fail(Reason::invalid_argument, fmt::format("{}: cannot be read", path),
                fmt::format("check {}", section));
  return text;
}

}  // namespace

grpc::ChannelArguments client_arguments() {
  grpc::ChannelArguments arguments;
  // A daemon permits one ping per second; faster ones are answered with GOAWAY.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 2000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 1000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // A machine is on the local network; an http_proxy of the environment must not redirect its commands.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // A call that failed is reported, never sent again behind somebody's back: only stops are.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  // A daemon that is being restarted is found again soon; gRPC's own pauses grow to two minutes.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  // Without this, two channel objects of one process share one connection.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return arguments;
}

Result<std::shared_ptr<grpc::ChannelCredentials>> client_credentials(const ClientFiles& files,
                                                                     std::string_view section) {
  if (files.ca.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions options;
  for (const auto& [path, text] :
       {std::pair(&files.ca, &options.pem_root_certs), std::pair(&files.certificate, &options.pem_cert_chain),
        std::pair(&files.key, &options.pem_private_key)}) {
    auto read = read_pem(*path, section);
    if (!read) return fail(std::move(read).error());
    *text = *std::move(read);
  }
  return grpc::SslCredentials(options);
}

}  // namespace axisd::transport
