#include "api/transport/server_limits.hpp"

#include <grpcpp/resource_quota.h>

#include "api/transport/stream_budget.hpp"

namespace axisd::transport {

void limit(grpc::ServerBuilder& builder, const std::string& name) {
  builder.SetMaxReceiveMessageSize(256 * 1024);
  // gRPC unpacks a message before it looks at its size: 200 KB can be 200 MB. Requests are short enough as
  // they are.
  for (const auto packed : {GRPC_COMPRESS_DEFLATE, GRPC_COMPRESS_GZIP})
    builder.SetCompressionAlgorithmSupportStatus(packed, false);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 8 * 1024);
  // Far above what a server lets one client open: its streams must never keep its Stop waiting.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, StreamBudget::Limits::told);
  // What is read at once becomes streams before anybody can count them: 15 bytes are enough for one.
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, 8 * 1024);
  // A vanished client is noticed within 12 s instead of minutes. Not sooner: a gRPC client without calls
  // looks at its connection every 5 s only. With less patience, the Stop of a client that was idle met a
  // connection that was cut off, and failed.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 2000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 1000);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 3000);
  // Near this much memory gRPC reads less and takes no new connections; stops have another way.
  builder.SetResourceQuota(grpc::ResourceQuota(name).Resize(256U << 20U));
}

}  // namespace axisd::transport
