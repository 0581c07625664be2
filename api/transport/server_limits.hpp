#pragma once

#include <grpcpp/server_builder.h>

#include <string>

namespace axisd::transport {

/// What one client can cost a server of this house: messages, metadata, calls on a connection, pings, memory.
/// `name`: of its memory quota.
void limit(grpc::ServerBuilder& builder, const std::string& name);

}  // namespace axisd::transport
